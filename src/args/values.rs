//! Numbers and words as people type them.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use job::{Keyword, OutputFile};
use radiosity::daylight::SkyPatches;

/// A whole number as people write it: 1000000, 1_000_000 or 1e6. TOML holds none beyond 63 bits.
pub(super) fn count(typed: &str) -> Result<u64, String> {
    let largest = i64::MAX as u64;
    let no_number = "it is not a whole number; write 1000000, 1_000_000 or 1e6";
    let digits = typed.replace('_', "");
    let number = job::whole_number(&digits).filter(|_| !typed.starts_with('_')).ok_or(no_number)?;
    let number = u64::try_from(number).ok().filter(|&number| number <= largest);
    number.ok_or_else(|| format!("it is above {largest}, the largest number of a job file"))
}

/// A source and its factor.
pub(super) fn factor(typed: &str) -> Result<(String, f64), String> {
    let (name, factor) = typed.rsplit_once('=').ok_or("write NAME=FACTOR, such as lamp=0.3")?;
    let factor = factor.trim().parse().map_err(|_| format!("{factor:?} is not a number; write lamp=0.3"))?;
    Ok((name.trim().into(), factor))
}

/// A lamp by the name of a material or a part.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NamedLamp {
    pub name: String,
    /// The flux [lm] or the power [W].
    pub power: f64,
    /// Whether the power is a flux.
    pub lumens: bool,
}

/// A lamp: `Lamp=1000lm` or `Lamp=60W`.
pub(super) fn lamp(typed: &str) -> Result<NamedLamp, String> {
    let wrong = || "write NAME=1000lm or NAME=60W, with the name of a material or a part".to_owned();
    let (name, power) = typed.rsplit_once('=').ok_or_else(wrong)?;
    let power = power.trim();
    let (number, lumens) = match (power.strip_suffix("lm"), power.strip_suffix('W')) {
        (Some(number), _) => (number, true),
        (None, Some(number)) => (number, false),
        (None, None) => return Err(wrong()),
    };
    let power = number.trim().parse().ok().filter(|power: &f64| *power > 0.0 && power.is_finite());
    let name = Some(name.trim().to_owned()).filter(|name| !name.is_empty());
    let (name, power) = name.zip(power).ok_or_else(wrong)?;
    Ok(NamedLamp { name, power, lumens })
}

/// The most illuminance that is asked of anything [lx]; the sun's disc alone brings 130,000.
const MOST_LUX: f64 = 1e12;

/// An illuminance above 0 [lx].
pub(super) fn illuminance(typed: &str) -> Result<f64, String> {
    let number: Option<f64> = typed.strip_suffix("lx").unwrap_or(typed).trim().parse().ok();
    number
        .filter(|number| *number > 0.0 && *number <= MOST_LUX)
        .ok_or_else(|| format!("write a number of lx above 0 and up to {MOST_LUX:e}, such as 10000"))
}

/// The altitude of the sun over the horizon [°].
pub(super) fn altitude(typed: &str) -> Result<f64, String> {
    let number = typed.parse().ok().filter(|number: &f64| (0.0..=90.0).contains(number));
    number.ok_or_else(|| "the sun of a sky is above the horizon; write 0 to 90 degrees".into())
}

/// The azimuth of the sun [°].
pub(super) fn azimuth(typed: &str) -> Result<f64, String> {
    let number = typed.parse().ok().filter(|number: &f64| (-360.0..=360.0).contains(number));
    number.ok_or_else(|| "write degrees from the north over the east, -360 to 360".into())
}

/// A number of worker processes.
pub(super) fn workers(typed: &str) -> Result<u32, String> {
    within(typed, 4096)
}

/// A number of threads.
pub(super) fn threads(typed: &str) -> Result<u32, String> {
    within(typed, 1024)
}

/// An accuracy relative to what is known.
pub(super) fn tolerance(typed: &str) -> Result<f64, String> {
    let number: Option<f64> = typed.parse().ok();
    number
        .filter(|number| *number > 0.0 && *number < 1.0)
        .ok_or("write a number between 0 and 1, such as 0.01".into())
}

/// A reflectance.
pub(super) fn reflectance(typed: &str) -> Result<f64, String> {
    let number: Option<f64> = typed.parse().ok();
    number
        .filter(|number| (0.0..=1.0).contains(number))
        .ok_or("write a number from 0 to 1, such as 0.2".into())
}

/// A part of the rows: `1/4` is the first quarter.
pub(super) fn part(typed: &str) -> Result<[u32; 2], String> {
    let numbers =
        typed.split_once('/').and_then(|(part, parts)| Some([part.parse().ok()?, parts.parse().ok()?]));
    let fits = |[part, parts]: &[u32; 2]| (1..=*parts).contains(part);
    numbers.filter(fits).ok_or_else(|| format!("{typed:?} is no part; write 1/4 for the first of four"))
}

/// A number of patches of the sky.
pub(super) fn sky_patches(typed: &str) -> Result<u32, String> {
    let sizes = SkyPatches::SIZES;
    let size = typed.parse().ok().filter(|size| sizes.contains(size));
    size.ok_or_else(|| {
        format!("the sky has no {typed:?} patches; choose {}, {} or {}", sizes[0], sizes[1], sizes[2])
    })
}

/// The steps at which a scene repeats along x and y [m].
pub(super) fn periods(typed: &str) -> Result<[f64; 2], String> {
    let numbers =
        typed.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    let fits = |periods: &[f64; 2]| periods.iter().all(|period| *period >= 0.0 && period.is_finite());
    numbers.filter(fits).ok_or_else(|| {
        format!("{typed:?} are no two lengths; write 30,20 for steps of 30 m along x and 20 m along y, 0 for no step")
    })
}

/// A number of walks of a row.
pub(super) fn row_walks(typed: &str) -> Result<u32, String> {
    let rays = u32::try_from(count(typed)?).ok().filter(|&rays| rays > 0);
    rays.ok_or_else(|| format!("a row has from 1 to {} walks; {typed} is none of these", u32::MAX))
}

fn within(typed: &str, most: u32) -> Result<u32, String> {
    let number = count(typed).ok().and_then(|number| u32::try_from(number).ok());
    number
        .filter(|number| (1..=most).contains(number))
        .ok_or(format!("write a whole number from 1 to {most}"))
}

/// The rays of a comparison's longest runs.
pub(super) fn rays(typed: &str) -> Result<u64, String> {
    count(typed)?
        .checked_sub(1024)
        .map(|more| more + 1024)
        .ok_or("fewer than 1024 rays are too few to measure anything".into())
}

/// The words of `[output] files`.
pub(super) fn output_file() -> impl TypedValueParser<Value = OutputFile> {
    let word = |file: &OutputFile| {
        PossibleValue::new(file.word()).help(format!("{}: {}", file.name(), file.purpose()))
    };
    let named = |word: String| OutputFile::ALL.iter().copied().find(|file| file.word() == word);
    let words = PossibleValuesParser::new(OutputFile::ALL.iter().map(word));
    words.map(move |word| named(word).expect("one of these words"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_may_have_any_name() {
        assert_eq!(factor("lamp=0.3"), Ok(("lamp".into(), 0.3)));
        assert_eq!(factor("a = b = 1e2"), Ok(("a = b".into(), 100.0)));
        assert!(factor("lamp").unwrap_err().contains("NAME=FACTOR"));
        assert!(factor("lamp=bright").unwrap_err().contains("not a number"));
    }

    #[test]
    fn lamps_have_a_name_and_a_unit() {
        let read = |typed| lamp(typed).map(|NamedLamp { name, power, lumens }| (name, power, lumens));
        assert_eq!(read("Lamp.001=1000lm"), Ok(("Lamp.001".into(), 1000.0, true)));
        assert_eq!(read("a=b = 6.5e1 W"), Ok(("a=b".into(), 65.0, false)));
        for typed in ["Lamp", "Lamp=", "Lamp=10", "=10lm", "Lamp=-1W", "Lamp=brightW"] {
            assert!(read(typed).unwrap_err().contains("NAME=1000lm"), "{typed}");
        }
        assert_eq!((illuminance("500"), illuminance("5e3lx")), (Ok(500.0), Ok(5000.0)));
        assert!(illuminance("0").is_err() && illuminance("dusk").is_err());
    }

    #[test]
    fn counts_are_written_as_people_write_them() {
        for (typed, number) in [
            ("0", 0),
            ("1_000_000", 1_000_000),
            ("1e6", 1_000_000),
            ("2.5E3", 2500),
            ("1e18", 1_000_000_000_000_000_000),
            ("123456789.0123456789e10", 1_234_567_890_123_456_789),
            ("100e-2", 1),
            ("9223372036854775807", i64::MAX as u64),
        ] {
            assert_eq!(count(typed), Ok(number), "{typed}");
        }
        for typed in ["", "_1", "-1", "1.5", "1e-3", "many", "inf", "nan", "0x10"] {
            assert!(count(typed).unwrap_err().contains("1_000_000"), "{typed}");
        }
        assert_eq!((workers("4096"), threads("1e3")), (Ok(4096), Ok(1000)));
        for typed in ["0", "4097", "many", "-1"] {
            assert_eq!(workers(typed), Err("write a whole number from 1 to 4096".into()), "{typed}");
        }
        for typed in ["9223372036854775808", "99999999999999999999", "1e30"] {
            assert!(count(typed).unwrap_err().contains("largest number"), "{typed}");
        }
    }
}
