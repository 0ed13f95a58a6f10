//! ANSI/IES LM-63, editions of 1986, 1991, 1995, 2002 and 2019.

use crate::distribution::{Distribution, Poles};
use crate::text::{Malformed, ascending, at, number, quoted, whole};
use crate::web::{CPlane, Symmetry, complete};
use crate::{LampSet, Luminaire, LuminousOpening, Tilt};

/// Metres in a foot.
const FOOT: f64 = 0.3048;

/// Most vertical and most horizontal angles.
const MOST_ANGLES: usize = 4096;

/// Most intensities.
pub(crate) const MOST_VALUES: usize = 1 << 20;

/// Whether the data begin after this line: TILT=, where some files have spaces about the sign.
pub(crate) fn is_tilt(line: &str) -> bool {
    tilt(line).is_some()
}

/// What follows TILT=.
fn tilt(line: &str) -> Option<&str> {
    let (word, value) = line.split_once('=')?;
    word.trim().eq_ignore_ascii_case("TILT").then_some(value.trim())
}

/// Whether a first line says that the file is LM-63.
pub(crate) fn names_itself(line: &str) -> bool {
    line.trim_start().starts_with("IES")
}

/// The edition by the first line; files of 1986 have no such line.
fn edition(line: &str) -> u32 {
    let line = line.trim().to_ascii_uppercase();
    let rest = match line.split_once("LM-63-") {
        Some((before, rest)) if before.starts_with("IES") => rest,
        _ => line.strip_prefix("IESNA").unwrap_or(""),
    };
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let year = match (digits, rest[..digits].parse::<u32>()) {
        (2, Ok(year)) => year + if year < 86 { 2000 } else { 1900 },
        (4, Ok(year)) => year,
        _ => 0,
    };
    match EDITIONS.iter().rev().find(|&&edition| edition <= year) {
        Some(&edition) => edition,
        // Later editions than this reader keep the form of 2002.
        None if line.starts_with("IES") && line.contains("LM-63") => 2002,
        None => EDITIONS[0],
    }
}

const EDITIONS: [u32; 5] = [1986, 1991, 1995, 2002, 2019];

/// The numbers after TILT=, wherever lines end.
struct IesNumbers<'a> {
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

impl<'a> IesNumbers<'a> {
    fn next(&mut self, what: &str) -> Result<f64, Malformed> {
        let Some((line, word)) = self.words.next() else {
            return Err(at(
                self.line,
                format!("the file ends where {what} is expected (it is cut off); get it whole"),
            ));
        };
        self.line = line;
        number(word, line, what)
    }

    fn whole(&mut self, what: &str, range: [usize; 2]) -> Result<usize, Malformed> {
        let value = self.next(what)?;
        whole(value, self.line, what, range)
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Malformed> {
        (0..count).map(|_| self.next(what)).collect()
    }
}

/// Reads the lines of a file that has a line TILT=.
pub(crate) fn read(lines: &[&str]) -> Result<Luminaire, Malformed> {
    let edition = edition(lines[0]);
    let start = lines.iter().position(|line| is_tilt(line)).unwrap_or(0);
    let words = lines.iter().enumerate().skip(start + 1).flat_map(|(index, line)| {
        let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        words.map(move |word| (index + 1, word))
    });
    let mut numbers = IesNumbers { words: Box::new(words), line: start + 1 };
    let tilt = read_tilt(lines[start], start + 1, &mut numbers)?;
    let head = IesHead::read(&mut numbers, edition)?;
    let (distribution, symmetry) = IesTable::read(&mut numbers, &head)?.distribution(head.kind)?;

    let labels = Labels::read(&lines[usize::from(edition > 1986 || names_itself(lines[0]))..start], edition);
    let standard = if edition == 2019 { "IES LM-63-2019" } else { &format!("IES LM-63-{edition}") };
    Ok(Luminaire {
        format: format!("{standard}, type {}", ["C", "B", "A"][head.kind - 1]),
        name: labels.first(&["LUMINAIRE", "OTHER"]),
        manufacturer: labels.first(&["MANUFAC"]),
        catalogue: labels.first(&["LUMCAT"]),
        lamps: vec![LampSet {
            number: head.lamps as u32,
            kind: labels.first(&["LAMP", "LAMPCAT"]),
            flux: Some(head.lumens * head.lamps.max(1) as f64).filter(|_| head.lumens > 0.0),
        }],
        watts: head.watts,
        stated_ratio: None,
        shape: head.shape,
        tilt,
        symmetry,
        measured: [head.horizontal, head.vertical],
        distribution,
    })
}

/// The numbers before the angles.
struct IesHead {
    /// How many lamps there are, and the lumens of each.
    lamps: usize,
    lumens: f64,
    /// By what all intensities are multiplied.
    factor: f64,
    /// The numbers of angles.
    vertical: usize,
    horizontal: usize,
    /// The type of photometry: 1 is C, 2 is B, 3 is A.
    kind: usize,
    shape: LuminousOpening,
    watts: Option<f64>,
}

impl IesHead {
    fn read(numbers: &mut IesNumbers, edition: u32) -> Result<Self, Malformed> {
        let lamps = numbers.next("the number of lamps")?;
        let lamps = whole(lamps.abs(), numbers.line, "the number of lamps", [0, 1_000_000])?;
        let lumens = numbers.next("the lumens of a lamp")?;
        let multiplier = numbers.next("the multiplier of the intensities")?;
        let vertical = numbers.whole("the number of vertical angles", [2, MOST_ANGLES])?;
        let horizontal = numbers.whole("the number of horizontal angles", [1, MOST_ANGLES])?;
        if vertical * horizontal > MOST_VALUES {
            let problem = format!(
                "{vertical} × {horizontal} intensities (no more than {MOST_VALUES} are read); thin the table out"
            );
            return Err(at(numbers.line, problem));
        }
        let kind = numbers.whole("the type of photometry", [1, 3])?;
        let metres = [FOOT, 1.0][numbers.whole("the unit of lengths", [1, 2])? - 1];
        let size: [f64; 3] = [
            metres * numbers.next("the width of the opening")?,
            metres * numbers.next("the length of the opening")?,
            metres * numbers.next("the height of the opening")?,
        ];
        let shape = shape(size, edition, numbers.line)?;
        let ballast = numbers.next("the ballast factor")?;
        let ballast_lamp = numbers.next("the ballast-lamp factor")?;
        // From 2002 on the second number says no factor: it is reserved, and in 2019 the way that the file was made.
        let factor = multiplier * ballast * if edition < 2002 { ballast_lamp } else { 1.0 };
        if !(factor > 0.0 && factor.is_finite()) {
            let problem = format!(
                "multiplier × ballast factors is {factor} (no light would be left); write positive factors"
            );
            return Err(at(numbers.line, problem));
        }
        let watts = Some(numbers.next("the input power")?).filter(|watts| *watts > 0.0);
        Ok(IesHead { lamps, lumens, factor, vertical, horizontal, kind, shape, watts })
    }
}

/// The angles and the intensities [cd], as they stand in the file.
struct IesTable {
    vertical: Vec<f64>,
    planes: Vec<CPlane>,
    /// The line of the last angle.
    angles_end: usize,
    /// The line of the last intensity.
    end: usize,
}

impl IesTable {
    fn read(numbers: &mut IesNumbers, head: &IesHead) -> Result<Self, Malformed> {
        let [vertical_range, horizontal_range] =
            if head.kind == 1 { [[0.0, 180.0], [0.0, 360.0]] } else { [[-90.0, 90.0]; 2] };
        let vertical = numbers.list(head.vertical, "a vertical angle")?;
        ascending(&vertical, numbers.line, "the vertical angle", vertical_range)?;
        let horizontal = numbers.list(head.horizontal, "a horizontal angle")?;
        ascending(&horizontal, numbers.line, "the horizontal angle", horizontal_range)?;
        let angles_end = numbers.line;
        let mut planes: Vec<CPlane> = Vec::with_capacity(head.horizontal);
        for angle in horizontal {
            let mut row = numbers.list(head.vertical, "an intensity")?;
            if let Some(negative) = row.iter().find(|candela| **candela < 0.0) {
                let problem = format!(
                    "the intensity {negative} in the plane of {angle}° is negative (light is not); write 0"
                );
                return Err(at(numbers.line, problem));
            }
            row.iter_mut().for_each(|candela| *candela *= head.factor);
            planes.push((angle, row));
        }
        let end = numbers.line;
        if let Some((line, word)) = numbers.words.next()
            && word.parse::<f64>().is_ok()
        {
            let problem = format!(
                "{} follows the last of {} × {} intensities (the counts of angles do not fit the table); correct the counts",
                quoted(word),
                head.horizontal,
                head.vertical
            );
            return Err(at(line, problem));
        }
        Ok(IesTable { vertical, planes, angles_end, end })
    }

    /// The intensities by direction, and the symmetry that completed the table, of a type of photometry.
    fn distribution(self, kind: usize) -> Result<(Distribution, Symmetry), Malformed> {
        let IesTable { vertical, planes, angles_end, end } = self;
        let (symmetry, poles) = match kind {
            1 => (symmetry(&planes, angles_end)?, Poles::Vertical),
            kind => {
                if planes.len() < 2 {
                    let problem = "one horizontal angle in photometry of type A or B (they have no axis of symmetry); use type C";
                    return Err(at(angles_end, problem));
                }
                let lateral = if planes[0].0 == 0.0 { Symmetry::Lateral } else { Symmetry::None };
                (lateral, if kind == 2 { Poles::Horizontal } else { Poles::Vertical })
            }
        };
        let from_nadir = if kind == 1 { 0.0 } else { 90.0 };
        let gamma = vertical.iter().map(|angle| angle + from_nadir).collect();
        let planes = if kind == 1 { complete(planes, symmetry) } else { clockwise(planes, symmetry) };
        let (c, rows): (Vec<f64>, Vec<Vec<f64>>) = planes.into_iter().unzip();
        let distribution = Distribution::new(poles, c, gamma, rows.concat())
            .ok_or_else(|| at(end, "all intensities are 0 (the lamp would be dark); check the table"))?;
        Ok((distribution, symmetry))
    }
}

fn read_tilt(line: &str, at_line: usize, numbers: &mut IesNumbers) -> Result<Option<Tilt>, Malformed> {
    let word = tilt(line).unwrap_or_default();
    match word.to_ascii_uppercase().as_str() {
        "NONE" => Ok(None),
        "INCLUDE" => {
            let geometry = numbers.whole("the position of the lamp (tilt)", [1, 3])? as u8;
            let count = numbers.whole("the number of tilt angles", [1, MOST_ANGLES])?;
            let angles = numbers.list(count, "a tilt angle")?;
            ascending(&angles, numbers.line, "the tilt angle", [0.0, 180.0])?;
            let factors = numbers.list(count, "a tilt factor")?;
            Ok(Some(Tilt { geometry, angles, factors }))
        }
        _ => Err(at(
            at_line,
            format!(
                "TILT={} names another file (a luminaire is read from one file); put its lines after TILT=INCLUDE, or write TILT=NONE",
                quoted(word)
            ),
        )),
    }
}

/// The symmetry of type C by the first and the last horizontal angle. Tables from 0 to less than 360 in even steps are closed.
fn symmetry(planes: &[CPlane], line: usize) -> Result<Symmetry, Malformed> {
    let (first, last) = (planes[0].0, planes[planes.len() - 1].0);
    let widest = planes.windows(2).fold(0.0_f64, |widest, pair| widest.max(pair[1].0 - pair[0].0));
    match (first, last) {
        _ if planes.len() == 1 => Ok(Symmetry::Axial),
        (0.0, 90.0) => Ok(Symmetry::Quadrants),
        (0.0, 180.0) => Ok(Symmetry::C0),
        (90.0, 270.0) => Ok(Symmetry::C90),
        (0.0, 360.0) => Ok(Symmetry::None),
        (0.0, last) if last > 180.0 && 360.0 - last <= widest + 1e-6 => Ok(Symmetry::None),
        _ => Err(at(
            line,
            format!(
                "horizontal angles from {first}° to {last}° (the rest of the circle follows only from 0, 0–90, 0–180, 90–270 or 0–360°); give all planes"
            ),
        )),
    }
}

/// Planes of types A and B, whose horizontal angles are clockwise, in ascending C.
fn clockwise(planes: Vec<CPlane>, symmetry: Symmetry) -> Vec<CPlane> {
    let mut turned: Vec<CPlane> = planes.iter().rev().map(|(angle, row)| (-angle, row.clone())).collect();
    if symmetry == Symmetry::Lateral {
        turned.extend(planes.into_iter().skip(1));
    }
    turned
}

/// The opening by the signs of width, length and height (LM-63-1995 and LM-63-2002, "luminous opening"): width is along C90–C270 and
/// length along C0–C180; negative ones are round.
fn shape([width, length, height]: [f64; 3], edition: u32, line: usize) -> Result<LuminousOpening, Malformed> {
    let (x, y, z) = (length.abs(), width.abs(), height.abs());
    let size = [x, y, z];
    let sign = |extent: f64| if extent == 0.0 { 0 } else { extent.signum() as i32 };
    let early = edition < 2002;
    // A diameter may be given once.
    let round = [if x > 0.0 { x } else { y }, if y > 0.0 { y } else { x }];
    Ok(match (sign(width), sign(length), sign(height)) {
        (0, 0, 0) => LuminousOpening::Point,
        (1, 1, 0) => LuminousOpening::Rectangle { x, y },
        (0 | 1, 0 | 1, 0 | 1) => LuminousOpening::Box { size },
        (-1, _, 0) | (_, -1, 0) => LuminousOpening::Disc { x: round[0], y: round[1] },
        (-1, _, 1) | (_, -1, 1) => LuminousOpening::Cylinder { size: [round[0], round[1], z], axis: 2 },
        (-1, -1, _) => LuminousOpening::Ellipsoid { size },
        (-1, 0, _) if early => LuminousOpening::Ellipsoid { size: [y, y, z] },
        (0, -1, _) if early => LuminousOpening::Ellipsoid { size: [x, x, z] },
        (-1, 1, _) | (1, -1, _) if early => LuminousOpening::Ellipsoid { size },
        (-1, 0 | 1, _) => LuminousOpening::Cylinder { size, axis: 0 },
        (0 | 1, -1, _) => LuminousOpening::Cylinder { size, axis: 1 },
        (0, 1, _) => LuminousOpening::Cylinder { size: [x, z, z], axis: 0 },
        (1, 0, _) => LuminousOpening::Cylinder { size: [z, y, z], axis: 1 },
        _ => {
            let problem = format!(
                "width {width} m, length {length} m and height {height} m of the opening are no shape of LM-63 (only round ones have a negative height); correct them"
            );
            return Err(at(line, problem));
        }
    })
}

/// The lines before TILT=.
struct Labels {
    pairs: Vec<(String, String)>,
}

impl Labels {
    fn read(lines: &[&str], edition: u32) -> Self {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for line in lines.iter().take(1000) {
            let line = line.trim();
            let keyword = line.strip_prefix('[').and_then(|rest| rest.split_once(']'));
            match keyword {
                Some((key, value)) if key.eq_ignore_ascii_case("MORE") => {
                    if let Some((_, before)) = pairs.last_mut() {
                        before.push(' ');
                        before.push_str(value.trim());
                    }
                }
                Some((key, value)) => pairs.push((key.to_ascii_uppercase(), value.trim().into())),
                // The first line of a file without keywords is taken for the name.
                None if edition <= 1991 && !line.is_empty() => pairs.push(("OTHER".into(), line.into())),
                None => {}
            }
        }
        Labels { pairs }
    }

    /// The value of the first of some keywords that has one.
    fn first(&self, keys: &[&str]) -> String {
        let value = |key: &&str| self.pairs.iter().find(|pair| pair.0 == *key && !pair.1.is_empty());
        keys.iter().find_map(value).map(|pair| pair.1.chars().take(400).collect()).unwrap_or_default()
    }
}
