//! The options by which a mesh becomes a scene: the keys of `[import]`.

use glam::DVec3;
use radiosity::Spectrum;

/// The keys of `[import]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The file's up axis, which becomes z; `None` means y for glTF and OBJ, and z for the others.
    pub up: Option<UpAxis>,
    /// The length of the file's unit in metres.
    pub unit: f64,
    /// The choice of active sides.
    pub sides: SidesChoice,
    /// The longest edge that a patch may have [m]; with `None` each face is one patch.
    pub patch_size: Option<f64>,
    /// The largest area that a patch may have [m²]; `None` sets no limit.
    pub max_patch_area: Option<f64>,
    /// The treatment of faces that cannot be modelled.
    pub faults: Faults,
    /// Whether neighbouring triangles that form a parallelogram become one.
    pub join: bool,
    /// The limit that reflectances are clamped to; with `None` 0.95 where some are 1 and more.
    pub reflectance_limit: Option<f64>,
    /// Whether a file is refused where something would have to be assumed: reflectances of 1 and more, and light.
    pub strict: bool,
    /// The emittance of a uniform sky around the mesh; `None` leaves a mesh without light to what is most likely meant.
    pub sky: Option<Spectrum>,
    /// The most distance of facets within a curved surface, in parts of its radius.
    pub curve_error: f64,
    /// Changes of materials, in the order in which they apply.
    pub materials: Vec<MaterialOverride>,
}

/// The default of [`Options::curve_error`]: 20 facets round a circle.
const CURVE_ERROR: f64 = 0.0125;

impl Default for Options {
    fn default() -> Self {
        Options {
            up: None,
            unit: 1.0,
            sides: SidesChoice::File,
            patch_size: None,
            max_patch_area: None,
            faults: Faults::Report,
            join: false,
            reflectance_limit: None,
            strict: false,
            sky: None,
            curve_error: CURVE_ERROR,
            materials: Vec::new(),
        }
    }
}

/// An axis of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UpAxis {
    /// The axis of the first coordinate.
    X,
    /// The axis of the second coordinate.
    Y,
    /// The axis of the third coordinate.
    Z,
}

impl UpAxis {
    /// Turns a point of a file so that this axis becomes z. Coordinates change places and signs, nothing is rounded.
    pub(crate) fn turn(self, point: DVec3) -> DVec3 {
        match self {
            UpAxis::X => DVec3::new(point.y, point.z, point.x),
            UpAxis::Y => DVec3::new(point.x, -point.z, point.y),
            UpAxis::Z => point,
        }
    }
}

/// The sides of imported faces that are active.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SidesChoice {
    /// The sides that the file gives; both if it gives none.
    File,
    /// The front only, whatever the file says.
    One,
    /// Both sides, whatever the file says.
    Two,
}

/// The treatment of degenerate and doubled faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faults {
    /// Faulty faces are left out, and a note says so.
    Report,
    /// The file is refused, with all of them in one message.
    Refuse,
}

/// The changes of one table `[import.material."PATTERN"]`.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialOverride {
    /// Names of materials or, if none has such a name, of parts; `*` stands for any text.
    pub pattern: String,
    /// The reflectance that replaces the material's.
    pub reflectance: Option<Spectrum>,
    /// The emittance that replaces the material's [W/m²].
    pub emittance: Option<Spectrum>,
    /// The power [W] over the active sides of all faces of matching materials, which replaces the emittance.
    pub power: Option<Spectrum>,
    /// The sides that replace the material's.
    pub sides: Option<SidesChoice>,
    /// Whether faces of the material are left out.
    pub leave_out: Option<bool>,
}

impl MaterialOverride {
    /// An entry that changes nothing yet.
    pub fn of(pattern: impl Into<String>) -> Self {
        MaterialOverride {
            pattern: pattern.into(),
            reflectance: None,
            emittance: None,
            power: None,
            sides: None,
            leave_out: None,
        }
    }
}

/// Whether a name matches a pattern in which `*` stands for any text.
pub fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    // Taking the first place of each part leaves the most room for the parts after it.
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_stand_for_any_text() {
        for (pattern, name) in
            [("Lamp*", "Lamp"), ("Lamp*", "Lamp.001"), ("*", ""), ("a*b*c", "abbc"), ("*b", "ab"), ("a", "a")]
        {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in
            [("Lamp", "Lamp1"), ("Lamp*", "lamp"), ("a*b*c", "acb"), ("ab*ba", "aba"), ("", "a")]
        {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn turns_keep_the_hand() {
        for axis in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|unit| axis.turn(unit));
            assert_eq!(x.cross(y), z);
        }
        assert_eq!(UpAxis::Y.turn(DVec3::Y), DVec3::Z);
        assert_eq!(UpAxis::X.turn(DVec3::X), DVec3::Z);
    }
}
