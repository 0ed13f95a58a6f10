//! `radwalk sky`: sky vectors and matrices.

use radiosity::daylight::SkyPatches;
use report::write_atomically;
use sky::{Dome, EFFICACY, Encoding, Matrix, Sky, SkyUnit, SunPosition, Year};

use crate::args::SkyArgs;
use crate::fault::{Fault, Outcome};

/// Writes a sky vector or matrix.
pub(crate) fn sky(args: &SkyArgs) -> Result<Outcome, Fault> {
    let patches = SkyPatches::new(args.sky_patches).expect("the number was checked when it was read");
    let dome = Dome::new(patches);
    if args.out.exists() && !args.force {
        return Err(Fault::Taken { path: args.out.clone() });
    }
    let (matrix, what) = match &args.weather {
        Some(weather) => {
            let weather = job::load_weather(weather)?;
            let what = format!("{} hours of {}", weather.hours.len(), weather.city);
            (year(args, &dome, &weather), what)
        }
        None => (standard(args, &dome), format!("standard sky {}", args.cie.unwrap_or_default())),
    };
    let encoding = if args.binary { Encoding::Float } else { Encoding::Ascii };
    write_atomically(&args.out, |file| matrix.write(encoding, file))?;
    let line =
        format!("{what} in {} patches and the ground: wrote {}", dome.patches().count(), args.out.display());
    args.told.tell(&args.out, &[line]);
    Ok(Outcome::Done)
}

/// A standard sky over the ground, in radiance of light as eyes see it.
fn standard(args: &SkyArgs, dome: &Dome) -> Matrix {
    let sun = SunPosition { altitude: args.altitude, azimuth: args.azimuth };
    let sky = Sky::standard(args.cie.unwrap_or_default(), sun.direction(), args.horizontal / EFFICACY);
    let mut vector = sky.map(|sky| dome.vector(&sky)).unwrap_or_default();
    vector[0] = args.ground * args.horizontal / EFFICACY / std::f64::consts::PI;
    Matrix { rows: vector.len(), columns: 1, numbers: vector }
}

/// A column for each hour.
fn year(args: &SkyArgs, dome: &Dome, weather: &sky::Weather) -> Matrix {
    let (quantity, unit) =
        if args.solar { (SkyUnit::Irradiance, 1.0) } else { (SkyUnit::Illuminance, EFFICACY) };
    let hours = Year::new(weather, dome, quantity, args.ground).hours;
    let mut numbers = vec![0.0; dome.size() * hours.len()];
    for (column, hour) in hours.iter().enumerate() {
        let mut add = |row: usize, radiance: f64| numbers[row * hours.len() + column] += radiance / unit;
        hour.sky.iter().enumerate().for_each(|(row, &radiance)| add(row, radiance));
        let sun = hour.sun.iter().filter(|_| !args.no_sun);
        sun.for_each(|&(row, radiance)| add(row, radiance));
    }
    Matrix { rows: dome.size(), columns: hours.len(), numbers }
}
