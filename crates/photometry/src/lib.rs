//! Catalogue luminaires: readers of ANSI/IES LM-63 and EULUMDAT files, and the light distribution that both become.
//!
//! [`Luminaire::read`] takes the bytes of a file. Its [`Distribution`] is a table of intensities over the angles (C, γ), which is
//! interpolated bilinearly:
//!
//! - [`Distribution::cells`] cuts the table into cells of known flux, from which births of light are drawn in exact proportion.
//! - [`Distribution::intensity`] is the interpolated intensity [cd] in a direction, for shadow rays: E = I cos θ / d² [lx].
//!
//! Both use only + − × ÷ √ ([`arithmetic`]), so that they give the same bits on every machine. Directions are in the frame of the
//! luminaire: x towards C = 0°, y towards C = 90°, z up, and γ = 0° is −z.
//!
//! ```
//! let file = "IESNA:LM-63-2002\n[LUMINAIRE] Down\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n100 80 0\n";
//! let lamp = photometry::Luminaire::read(file.as_bytes()).unwrap();
//! let light = &lamp.distribution;
//! assert_eq!(light.intensity(glam::DVec3::NEG_Z), 100.0);
//! let flux: f64 = light.cells().iter().map(|cell| cell.flux).sum();
//! assert_eq!(flux, light.flux());
//! ```

#![warn(unreachable_pub, unnameable_types)]

use serde::{Deserialize, Serialize};

mod arithmetic;
mod distribution;
mod figures;
mod glare;
mod ies;
mod ldt;
mod polar;
mod text;
mod web;

pub use distribution::{Cell, Distribution, strip_flux};
pub use figures::BeamAngles;
pub use glare::position_index;
pub use text::Malformed;
pub use web::Symmetry;

/// The largest file that is read [bytes].
pub const LARGEST_FILE: usize = 16 << 20;

/// A luminaire as its file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Luminaire {
    /// The standard and the kind of photometry, in words.
    pub format: String,
    /// The name of the luminaire; empty where the file has none.
    pub name: String,
    /// The manufacturer; empty where the file has none.
    pub manufacturer: String,
    /// The catalogue number; empty where the file has none.
    pub catalogue: String,
    /// The lamps that the luminaire may have. The distribution is that of the first set.
    pub lamps: Vec<LampSet>,
    /// The power that the luminaire takes with the first set [W], ballast included; `None` where the file does not say.
    pub watts: Option<f64>,
    /// The light output ratio that the file states.
    pub stated_ratio: Option<f64>,
    /// The luminous opening.
    pub shape: LuminousOpening,
    /// How the flux of the lamps changes where the luminaire is tilted; not applied to the distribution.
    pub tilt: Option<Tilt>,
    /// The symmetry by which the table was completed.
    pub symmetry: Symmetry,
    /// Numbers of planes and of angles in the file.
    pub measured: [usize; 2],
    /// The intensities.
    pub distribution: Distribution,
}

/// Lamps of a luminaire.
#[derive(Clone, Debug, PartialEq)]
pub struct LampSet {
    /// The number of lamps.
    pub number: u32,
    /// The type of lamp, in the words of the file.
    pub kind: String,
    /// The flux of all lamps of the set [lm]; `None` where only the luminaire was measured (absolute photometry).
    pub flux: Option<f64>,
}

/// The luminous opening of a luminaire [m]: x along C0–C180, y along C90–C270, z up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LuminousOpening {
    /// No extent.
    Point,
    /// A horizontal rectangle.
    Rectangle {
        /// Side along x.
        x: f64,
        /// Side along y.
        y: f64,
    },
    /// A horizontal disc or ellipse.
    Disc {
        /// Diameter along x.
        x: f64,
        /// Diameter along y.
        y: f64,
    },
    /// A box with luminous sides; a side may be 0.
    Box {
        /// Extents along x, y and z.
        size: [f64; 3],
    },
    /// A cylinder, round or elliptic; of length 0: a vertical disc.
    Cylinder {
        /// Extents along x, y and z.
        size: [f64; 3],
        /// Its axis: 0 for x, 1 for y, 2 for z.
        axis: usize,
    },
    /// A sphere or ellipsoid.
    Ellipsoid {
        /// Diameters along x, y and z.
        size: [f64; 3],
    },
}

/// Flux of tilted lamps (`TILT=INCLUDE` of LM-63).
#[derive(Clone, Debug, PartialEq)]
pub struct Tilt {
    /// The position of the lamp in the luminaire: 1 vertical, 2 horizontal and still so if tilted, 3 horizontal and tilted along.
    pub geometry: u8,
    /// Angles [°], ascending.
    pub angles: Vec<f64>,
    /// The factor of the flux at each angle.
    pub factors: Vec<f64>,
}

impl Luminaire {
    /// Reads a file of either format, which its contents tell.
    ///
    /// # Errors
    /// If the file is of neither format, or breaks its rules.
    pub fn read(bytes: &[u8]) -> Result<Self, Malformed> {
        if bytes.len() > LARGEST_FILE {
            let largest = LARGEST_FILE >> 20;
            return Err(text::at(
                1,
                format!("the file is larger than {largest} MB (luminaires take some kB); name another file"),
            ));
        }
        let text = text::decode(bytes);
        let lines = text::lines(&text);
        if lines.iter().any(|line| ies::is_tilt(line)) {
            return ies::read(&lines);
        }
        if lines.len() > 26 && matches!(lines[2].trim(), "0" | "1" | "2" | "3" | "4") {
            return ldt::read(&lines);
        }
        if ies::names_itself(lines[0]) {
            return Err(text::at(
                1,
                "there is no line TILT= (the data of LM-63 begin after it); add TILT=NONE before the numbers",
            ));
        }
        Err(text::at(
            1,
            "neither LM-63 nor EULUMDAT (there is no line TILT=, and line 3 is no symmetry of EULUMDAT); give an .ies or .ldt file",
        ))
    }

    /// The flux of the lamps of the first set [lm]; `None` in absolute photometry.
    pub fn lamp_flux(&self) -> Option<f64> {
        self.lamps.first().and_then(|set| set.flux)
    }

    /// The light output ratio: the flux of the luminaire over that of its lamps; `None` in absolute photometry.
    pub fn output_ratio(&self) -> Option<f64> {
        self.lamp_flux().map(|lamps| self.distribution.flux() / lamps)
    }

    /// The luminous efficacy [lm/W].
    pub fn efficacy(&self) -> Option<f64> {
        self.watts.map(|watts| self.distribution.flux() / watts)
    }
}
