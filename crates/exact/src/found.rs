//! How form factors were found.

use std::fmt;

use crate::box_scene::NotABox;

/// The form factors of a scene, with the method that found each of them.
#[derive(Clone, Debug, PartialEq)]
pub enum FormFactors {
    /// The form factors were given by the caller.
    Given,
    /// In closed form: the scene is a closed box of axis-aligned rectangles.
    ClosedForm,
    /// In closed form, by contour integrals or by cubature, pair by pair.
    General {
        /// Why the closed form of boxes does not apply.
        because: NotABox,
    },
}

impl fmt::Display for FormFactors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FormFactors::Given => f.write_str("as given"),
            FormFactors::ClosedForm => f.write_str("in closed form"),
            FormFactors::General { .. } => f.write_str(
                "pair by pair: in closed form, by contour integrals or, where hidden in part, by cubature",
            ),
        }
    }
}
