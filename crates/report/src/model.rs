//! What was modelled, and why no more.

use std::fmt;

use crate::words::counted;
use radiosity::{Method, Scene, Sides, Space, methods::AbsorptionMode};
use serde::Serialize;

use crate::method::MethodWords;

/// What was modelled, and why so.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Model {
    /// 1: grey; 3: red, green, blue.
    pub channels: usize,
    /// `one`, `two`, or `mixed`: the active sides of the surfaces.
    pub sides: &'static str,
    /// `flat` (every surface is met) or `tree`.
    pub index: &'static str,
    /// The space of the walks: `discrete` or `continuous`.
    pub space: &'static str,
    /// The kind of walk: `shooting`, …
    pub walk: &'static str,
    /// Where chains of rays take the place of walks: `links`, or the kind of iterations.
    pub jacobi: Option<String>,
    /// Patches whose light rays of their own gather from what is found elsewhere; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub final_gather: Vec<u32>,
    /// Power sums kept per patch: always 2.
    pub moments: usize,
    /// The number of patches.
    pub patches: usize,
    /// The number of surfaces.
    pub surfaces: usize,
    /// The number of emitting patches.
    pub emitters: usize,
    /// Boxes that a node of the tree holds; `null` where there is none.
    pub tree_width: Option<usize>,
    /// Which part of the power arrives after how many reflections; `null` where only walks that gather could tell.
    pub bounces: Option<Vec<Bounce>>,
    /// What radwalk can model and this scene never used.
    pub unused: Vec<&'static str>,
    /// The reasons, a short sentence each.
    pub why: Vec<String>,
}

impl Model {
    /// What a method models in a scene, with `bounces` as a pilot tells.
    pub fn new(scene: &Scene, method: &Method, bounces: Option<Vec<Bounce>>) -> Self {
        let words = MethodWords::of(method);
        let emitters = scene.faces().iter().filter(|patch| patch.emittance.is_lit()).count();
        let mut model = Model {
            channels: scene.channels(),
            sides: sides(scene),
            index: if scene.has_tree() { "tree" } else { "flat" },
            space: words.space,
            walk: words.walk,
            jacobi: words.chains,
            final_gather: method.final_gather().to_vec(),
            moments: 2,
            patches: scene.faces().patch_count(),
            surfaces: scene.surfaces().len(),
            emitters,
            tree_width: scene.tree_width(),
            bounces,
            unused: unused(scene, method),
            why: Vec::new(),
        };
        model.why = model.reasons();
        model
    }

    fn reasons(&self) -> Vec<String> {
        let sides = match self.sides {
            "one" => "Every surface is one-sided: a ray that meets a back is absorbed there and counted.",
            "two" => "Every surface is two-sided: each side of a patch is an unknown of its own.",
            _ => "Some surfaces are one-sided, some two-sided: only backs of the former absorb all.",
        };
        let index = match self.index {
            "flat" if self.surfaces == 1 => "There is one surface: each ray meets it or nothing.".into(),
            "flat" => format!("{} surfaces are few: each ray meets every one of them.", self.surfaces),
            _ => {
                format!("{} surfaces are many: rays find the nearest through a tree of boxes.", self.surfaces)
            }
        };
        let linked = self.jacobi.as_deref() == Some("links");
        let space = match self.space {
            _ if linked => {
                "Chains of single rays count how patches are linked: the answer is that of the patches' radiosity system."
            }
            _ if self.jacobi.is_some() => {
                "Chains propagate power by single rays again and again: the answer is that of the patches' radiosity system."
            }
            "continuous" => {
                "Walks go on from the point they hit: the answer is that of the integral equation."
            }
            _ => {
                "Walks go on from a fresh point of the patch they hit: the answer is that of the patches' radiosity system."
            }
        };
        let channels = match self.channels {
            1 => "Every reflectance and emittance is grey: one channel is modelled.",
            _ if linked => {
                "Some reflectance or emittance is coloured: the same links are solved for red, green and blue."
            }
            _ if self.jacobi.is_some() => {
                "Some reflectance or emittance is coloured: each ray serves red, green and blue by three weights."
            }
            _ => {
                "Some reflectance or emittance is coloured: each walk serves red, green and blue by three weights."
            }
        };
        let sums = match self.jacobi {
            Some(_) => "Chains are the sample: two sums of each patch over them are all that is kept.",
            None => "Intervals follow from two sums of each patch, Σx and Σx²: no higher ones are kept.",
        };
        let mut why = vec![channels.into(), sides.into(), index, space.into(), sums.into()];
        if !self.final_gather.is_empty() {
            why.push(
                "Some patches were chosen: rays of their own gather what each batch has found elsewhere."
                    .into(),
            );
        }
        why
    }

    /// The model in two lines.
    pub fn lines(&self) -> [String; 2] {
        let channels = if self.channels == 1 { "grey" } else { "red, green, blue" };
        let sides = match self.sides {
            "one" => "one-sided",
            "two" => "two-sided",
            _ => "one- and two-sided",
        };
        let index =
            self.tree_width.map_or("all met by each ray".into(), |width| format!("in a tree {width} wide"));
        let what = format!(
            "{channels}, {sides}, {} {index}, {} of {} sums, {} {}",
            counted(self.surfaces as u64, "surface"),
            counted(self.patches as u64, "patch"),
            self.moments,
            self.space,
            self.walk
        );
        let bounce = |bounce: &Bounce| bounce.to_string();
        let bounces = self.bounces.as_ref().map(|all| all.iter().map(bounce).collect::<Vec<_>>().join(", "));
        let light = bounces.map_or(String::new(), |bounces| format!("power that arrives: {bounces}; "));
        let unused = if self.unused.is_empty() { "nothing".into() } else { self.unused.join(", ") };
        [what, format!("{light}never used: {unused}")]
    }
}

/// Power that arrives after some reflections.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounce {
    /// The number of reflections before the arrival.
    pub reflections: usize,
    /// Whether more of them count too.
    pub or_more: bool,
    /// The part of all power that arrives.
    pub part: f64,
    /// The standard error of `part`.
    pub std_error: f64,
}

impl fmt::Display for Bounce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (part, error) = (100.0 * self.part, 100.0 * self.std_error);
        match (self.reflections, self.or_more) {
            (0, _) => write!(f, "{part:.1} ± {error:.1} % directly"),
            (n, false) => write!(f, "{part:.1} ± {error:.1} % after {n}"),
            (n, true) => write!(f, "{part:.1} ± {error:.1} % after {n} or more reflections"),
        }
    }
}

/// Features of the program that this job does not use; they cost nothing.
fn unused(scene: &Scene, method: &Method) -> Vec<&'static str> {
    let surfaces = || scene.surfaces().iter();
    let patches = || scene.faces().iter();
    let triangles = surfaces().any(|surface| surface.is_triangle());
    let features = [
        (scene.channels() == 1, "colour"),
        (surfaces().all(|surface| surface.sides() == Sides::Front), "second sides"),
        (surfaces().all(|surface| surface.sides() == Sides::Both), "backs that absorb"),
        (!triangles, "triangles"),
        (scene.faces().piece_count() == scene.surfaces().len(), "grids of patches"),
        (!scene.has_tree(), "a tree"),
        (patches().all(|patch| patch.reflectance.is_lit()), "black surfaces"),
        (
            scene.channels() == 1
                && method.estimator_kind().is_some_and(|kind| kind.absorption() != AbsorptionMode::Implicit),
            "weights of walks",
        ),
        (method.space() != Space::Continuous, "continuous walks"),
    ];
    features.into_iter().filter(|(is_unused, _)| *is_unused).map(|(_, name)| name).collect()
}

fn sides(scene: &Scene) -> &'static str {
    let two_sided = scene.surfaces().iter().filter(|surface| surface.sides() == Sides::Both).count();
    match two_sided {
        0 => "one",
        n if n == scene.surfaces().len() => "two",
        _ => "mixed",
    }
}

#[cfg(test)]
mod tests {
    use radiosity::{EstimatorKind, IndexChoice};

    use super::*;
    use crate::scenes::{cornell, cube};

    fn method() -> Method {
        Method::shooting(EstimatorKind::Collision)
    }

    #[test]
    fn the_model_tells_trees_and_sides() {
        let model = |scene: &Scene| Model::new(scene, &method(), None);
        assert_eq!(model(&cube()).sides, "one");
        let mut spec = cornell();
        spec.surfaces[0].sides = Sides::Both;
        let mixed = model(&Scene::build(&spec, IndexChoice::Tree).unwrap());
        assert_eq!((mixed.sides, mixed.index), ("mixed", "tree"));
        assert!(mixed.why.iter().any(|reason| reason.contains("tree of boxes")));
    }

    #[test]
    fn two_lines_tell_what_is_there_and_what_is_not() {
        let bounces = [0, 1].map(|n| Bounce { reflections: n, or_more: n == 1, part: 0.5, std_error: 0.01 });
        let [what, light] = Model::new(&cube(), &method(), Some(bounces.into())).lines();
        assert_eq!(
            what,
            "grey, one-sided, 6 surfaces all met by each ray, 54 patches of 2 sums, discrete shooting"
        );
        assert_eq!(
            light,
            "power that arrives: 50.0 ± 1.0 % directly, 50.0 ± 1.0 % after 1 or more reflections; never used: \
             colour, second sides, triangles, a tree, black surfaces, weights of walks, continuous walks"
        );
    }
}
