//! Weighted scores against whole hits: where all channels are alike, weights are 1, and a score is a number of hits.

use crate::common::{box_scene, collision, experiment, walk};
use glam::DVec3;
use radiosity::{EstimatorKind, IndexChoice, SceneSpec, Space, Spectrum, Tally, Walks, methods::Score};

/// A closed box of two patches a wall that all reflect and emit alike.
fn room(reflectance: Spectrum, emittance: Spectrum) -> SceneSpec {
    let mut spec = box_scene(DVec3::new(1.0, 1.5, 0.7), [2, 1]);
    for surface in &mut spec.surfaces {
        surface.cell_emittance.clear();
        (surface.reflectance, surface.emittance) = (reflectance, emittance);
    }
    spec
}

fn tally(spec: &SceneSpec, score: Score, space: Space, walks: u64) -> Tally {
    let method = Walks { score, ..collision(space) };
    walk(&experiment(spec, IndexChoice::Flat, method), 3, 0..walks)
}

/// Short walks, walks that come back to their patches again and again, and walks that are longer than is searched at each hit.
#[test]
fn weights_of_one_are_hits() {
    for (reflectance, walks) in [(0.5, 3_000), (0.93, 1_000), (0.998, 100)] {
        let grey = room(reflectance.into(), 1.0.into());
        // One channel differs where it scores nothing, so that the scene has colours.
        let coloured = room(Spectrum::rgb([reflectance; 3]), Spectrum::rgb([1.0, 1.0, 0.0]));
        for kind in [EstimatorKind::Collision, EstimatorKind::Survival, EstimatorKind::Absorption] {
            for space in [Space::Discrete, Space::Continuous] {
                let scores: [fn(EstimatorKind) -> Score; 2] =
                    [|kind| Score::Of(kind.into()), |kind| Score::Linear(kind.into())];
                for (linear, score) in scores.into_iter().enumerate() {
                    let [hits, weights] =
                        [&grey, &coloured].map(|spec| tally(spec, score(kind), space, walks));
                    let what = format!("{kind:?}, {space:?}, R = {reflectance}, linear: {linear}");
                    assert_alike(&hits, &weights, linear == 1, &what);
                }
            }
        }
    }
}

/// Asserts that scores in units of 2⁻⁴⁰ are hits, and their slopes those of hits, which are in units of 2⁻¹².
fn assert_alike(hits: &Tally, weights: &Tally, linear: bool, what: &str) {
    for patch in 0..12 {
        let &[sum, squares] = hits.patch(patch, 0) else { unreachable!("two power sums") };
        assert_eq!(weights.events(patch), sum, "{what}");
        for channel in 0..2 {
            assert_eq!(weights.patch(patch, channel), [sum << 40, squares << 80], "{what}");
            for k in (0..2).filter(|_| linear) {
                let (sum, squares) = hits.slope(patch, 0, k);
                assert_eq!(weights.slope(patch, channel, k), (sum << 28, squares << 56), "{what}");
            }
        }
        assert_eq!(weights.patch(patch, 2), [0, 0], "{what}");
    }
}
