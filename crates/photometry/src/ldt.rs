//! EULUMDAT (Stockmar 1990): one value a line. Numbers of lines are those of the public description.

use crate::distribution::{Distribution, Poles};
use crate::ies::MOST_VALUES;
use crate::text::{Malformed, ascending, at, number, whole};
use crate::web::{CPlane, Symmetry, complete};
use crate::{LampSet, Luminaire, LuminousOpening};

/// Metres in a millimetre.
const MILLIMETRE: f64 = 1e-3;

/// The lines before the lamp sets, and those of a lamp set.
const HEAD: usize = 26;
const SET: usize = 6;

/// The direct ratios after the lamp sets, which are not read: they follow from the intensities.
const RATIOS: usize = 10;

struct LdtLines<'a> {
    lines: &'a [&'a str],
}

impl LdtLines<'_> {
    fn text(&self, line: usize) -> String {
        self.lines.get(line - 1).map(|text| text.trim().chars().take(400).collect()).unwrap_or_default()
    }

    fn number(&self, line: usize, what: &str) -> Result<f64, Malformed> {
        let Some(text) = self.lines.get(line - 1) else {
            let problem = format!("the file ends where {what} is expected (it is cut off); get it whole");
            return Err(at(self.lines.len(), problem));
        };
        // A decimal comma is as good as a point here: numbers stand alone.
        let word = text.split_whitespace().next().unwrap_or_default().replace(',', ".");
        number(&word, line, what)
    }

    fn positive(&self, line: usize, what: &str) -> Result<f64, Malformed> {
        let value = self.number(line, what)?;
        if value >= 0.0 {
            Ok(value)
        } else {
            Err(at(line, format!("{what} is {value} (it cannot be negative); correct it")))
        }
    }

    fn whole(&self, line: usize, what: &str, range: [usize; 2]) -> Result<usize, Malformed> {
        whole(self.number(line, what)?, line, what, range)
    }

    fn list(&self, first: usize, count: usize, what: &str) -> Result<Vec<f64>, Malformed> {
        (first..first + count).map(|line| self.number(line, what)).collect()
    }
}

/// Reads the lines of a file.
pub(crate) fn read(lines: &[&str]) -> Result<Luminaire, Malformed> {
    let lines = LdtLines { lines };
    let grid = LdtGrid::read(&lines)?;
    let shape = shape(&lines)?;
    let ratio = lines.positive(23, "the light output ratio")? / 100.0;
    let conversion = lines.positive(24, "the conversion factor")?;
    let lamps = read_lamps(&lines)?;
    let watts = Some(lines.number(HEAD + SET, "the power of the lamps")?).filter(|watts| *watts > 0.0);
    let flux = lines.number(HEAD + 3, "the flux of the lamps")?;
    let factor = conversion * flux / 1000.0;
    if !(factor > 0.0 && factor.is_finite()) {
        let problem = format!(
            "the flux {flux} lm × the conversion factor {conversion} is not positive (intensities are per 1,000 lm of it); write the flux"
        );
        return Err(at(HEAD + 3, problem));
    }
    let distribution = grid.distribution(&lines, HEAD + SET * lamps.len() + RATIOS + 1, factor)?;
    Ok(Luminaire {
        format: "EULUMDAT".into(),
        name: lines.text(9),
        manufacturer: lines.text(1),
        catalogue: lines.text(10),
        lamps,
        watts,
        stated_ratio: Some(ratio).filter(|ratio| *ratio > 0.0),
        shape,
        tilt: None,
        symmetry: grid.symmetry,
        measured: [grid.planes, grid.angles],
        distribution,
    })
}

/// Which planes and angles the intensities are given in.
struct LdtGrid {
    /// The symmetry as the file numbers it.
    number: usize,
    symmetry: Symmetry,
    /// The C planes all around, and those that are given, from which one on.
    circle: usize,
    planes: usize,
    first: usize,
    /// The angles γ in a plane.
    angles: usize,
}

impl LdtGrid {
    fn read(lines: &LdtLines) -> Result<Self, Malformed> {
        let number = lines.whole(3, "the symmetry", [0, 4])?;
        let circle = lines.whole(4, "the number of C planes", [1, 4096])?;
        let angles = lines.whole(6, "the number of angles in a plane", [2, 4096])?;
        let (symmetry, planes, first) = match number {
            0 => (Symmetry::None, circle, 0),
            1 => (Symmetry::Axial, 1, 0),
            2 => (Symmetry::C0, circle / 2 + 1, 0),
            3 => (Symmetry::C90, circle / 2 + 1, 3 * circle / 4),
            _ => (Symmetry::Quadrants, circle / 4 + 1, 0),
        };
        let divisor = [1, 1, 2, 4, 4][number];
        if circle % divisor != 0 {
            let problem = format!(
                "{circle} C planes with symmetry {number} (their number is a multiple of {divisor} then); correct it"
            );
            return Err(at(4, problem));
        }
        if planes * angles > MOST_VALUES {
            let problem = format!(
                "{planes} × {angles} intensities (no more than {MOST_VALUES} are read); thin the table out"
            );
            return Err(at(6, problem));
        }
        Ok(LdtGrid { number, symmetry, circle, planes, first, angles })
    }

    /// The intensities by direction. The C planes begin in line `azimuths`, and each number of the table is multiplied by `factor`.
    fn distribution(
        &self,
        lines: &LdtLines,
        azimuths: usize,
        factor: f64,
    ) -> Result<Distribution, Malformed> {
        let &LdtGrid { number, symmetry, circle, planes, first, angles } = self;
        let c = lines.list(azimuths, circle, "a C plane")?;
        let gamma = lines.list(azimuths + circle, angles, "an angle γ")?;
        ascending(&c, azimuths, "the C plane", [0.0, 360.0])?;
        ascending(&gamma, azimuths + circle, "the angle γ", [0.0, 180.0])?;
        let begin = azimuths + circle + angles;
        let mut table: Vec<CPlane> = Vec::with_capacity(planes);
        for plane in 0..planes {
            let row = (begin + plane * angles..begin + (plane + 1) * angles)
                .map(|line| Ok(factor * lines.positive(line, "an intensity")?))
                .collect::<Result<_, Malformed>>()?;
            table.push((c[(first + plane) % circle], row));
        }
        let ends = [table[0].0, table[planes - 1].0];
        let expected = [None, None, Some([0.0, 180.0]), Some([270.0, 90.0]), Some([0.0, 90.0])][number];
        if let Some(expected) = expected.filter(|expected| *expected != ends) {
            let problem = format!(
                "with symmetry {number} the planes given are C{} to C{} (they must be C{} to C{}); correct the symmetry or the list of planes",
                ends[0], ends[1], expected[0], expected[1]
            );
            return Err(at(azimuths, problem));
        }
        let (c, rows): (Vec<f64>, Vec<Vec<f64>>) = complete(table, symmetry).into_iter().unzip();
        Distribution::new(Poles::Vertical, c, gamma, rows.concat()).ok_or_else(|| {
            let end = begin + planes * angles - 1;
            at(end, "all intensities are 0 (the lamp would be dark); check the table")
        })
    }
}

/// The luminous area. The length of a luminaire is along C90–C270; without a width the area is round.
fn shape(lines: &LdtLines) -> Result<LuminousOpening, Malformed> {
    let extent =
        |line| Ok::<f64, Malformed>(MILLIMETRE * lines.positive(line, "an extent of the luminous area")?);
    let [length, width] = [extent(16)?, extent(17)?];
    let height = [18, 19, 20, 21].into_iter().try_fold(0.0_f64, |most, line| Ok(most.max(extent(line)?)))?;
    Ok(match (length > 0.0, width > 0.0, height > 0.0) {
        (false, false, false) => LuminousOpening::Point,
        (true, false, false) => LuminousOpening::Disc { x: length, y: length },
        (true, false, true) => LuminousOpening::Cylinder { size: [length, length, height], axis: 2 },
        (true, true, false) => LuminousOpening::Rectangle { x: width, y: length },
        _ => LuminousOpening::Box { size: [width, length, height] },
    })
}

fn read_lamps(lines: &LdtLines) -> Result<Vec<LampSet>, Malformed> {
    let sets = lines.whole(26, "the number of lamp sets", [1, 100])?;
    let mut lamps = Vec::with_capacity(sets);
    for set in 0..sets {
        let line = HEAD + 1 + SET * set;
        let count = lines.number(line, "the number of lamps")?;
        // A negative number of lamps: the flux is that of the luminaire.
        let flux = lines.positive(line + 2, "the flux of the lamps")?;
        lamps.push(LampSet {
            number: whole(count.abs(), line, "the number of lamps", [0, 1_000_000])? as u32,
            kind: lines.text(line + 1),
            flux: Some(flux).filter(|flux| count >= 0.0 && *flux > 0.0),
        });
    }
    Ok(lamps)
}
