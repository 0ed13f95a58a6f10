//! How a mesh becomes a scene: the keys of `[import]`.

use glam::DVec3;
use radiosity::Spectrum;

/// What `[import]` says.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The file's up axis, which becomes z; `None`: y for glTF and OBJ, else z.
    pub up: Option<Axis>,
    /// Metres per unit of the file.
    pub unit: f64,
    /// Which sides are active.
    pub sides: SidesChoice,
    /// The longest edge that a patch may have [m]; `None`: one patch a face.
    pub patch_size: Option<f64>,
    /// The largest area that a patch may have [m²]; `None`: any.
    pub max_patch_area: Option<f64>,
    /// What to do with faces that cannot be modelled.
    pub faults: Faults,
    /// Whether neighbouring triangles that form a parallelogram become one.
    pub join: bool,
    /// What reflectances are clamped to; `None`: those of 1 and more are refused.
    pub reflectance_limit: Option<f64>,
    /// How far facets of curved surfaces may lie inside them, in parts of their radius.
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
            curve_error: CURVE_ERROR,
            materials: Vec::new(),
        }
    }
}

/// An axis of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
    Z,
}

impl Axis {
    /// Turns a point of a file so that this axis becomes z. Coordinates change places and signs, nothing is rounded.
    pub(crate) fn turn(self, point: DVec3) -> DVec3 {
        match self {
            Axis::X => DVec3::new(point.y, point.z, point.x),
            Axis::Y => DVec3::new(point.x, -point.z, point.y),
            Axis::Z => point,
        }
    }
}

/// The sides of imported faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SidesChoice {
    /// What the file says, and both where it does not.
    File,
    /// The front only.
    One,
    /// Both.
    Two,
}

/// What to do with degenerate and doubled faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Faults {
    /// Leave them out and say so.
    Report,
    /// Refuse the file, all of them in one message.
    Refuse,
}

/// One table `[import.material."PATTERN"]`.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialOverride {
    /// Names of materials; `*` stands for any text.
    pub pattern: String,
    /// Replaces the reflectance.
    pub reflectance: Option<Spectrum>,
    /// Replaces the emittance [W/m²].
    pub emittance: Option<Spectrum>,
    /// Replaces the emittance by this power [W] over the active sides of all faces of matching materials.
    pub power: Option<Spectrum>,
    /// Replaces the sides.
    pub sides: Option<SidesChoice>,
}

/// Whether a name matches a pattern in which `*` stands for any text.
pub fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    // Taking the first place of each part leaves most room for those that follow.
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
        for axis in [Axis::X, Axis::Y, Axis::Z] {
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|unit| axis.turn(unit));
            assert_eq!(x.cross(y), z);
        }
        assert_eq!(Axis::Y.turn(DVec3::Y), DVec3::Z);
        assert_eq!(Axis::X.turn(DVec3::X), DVec3::Z);
    }
}
