//! Tallies have the same bits on any machine, with or without a tree, however the walks are split.

use crate::common::{box_scene, bumpy_sphere, collision, cube54, experiment, map_corners, rotation, walk};
use glam::DVec3;
use radiosity::{IndexChoice, SceneSpec, Space, Tally};

fn tally(spec: &SceneSpec, index: IndexChoice, space: Space, cuts: &[u64]) -> Tally {
    let experiment = experiment(spec, index, collision(space));
    let mut total = experiment.tally();
    for range in cuts.windows(2) {
        total.merge(&walk(&experiment, 42, range[0]..range[1])).unwrap();
    }
    total
}

/// A digest of the rays and of every sum, whatever format tallies are kept in.
fn digest(tally: &Tally) -> String {
    let mut hasher = blake3::Hasher::new();
    for number in tally.sums().iter().chain([&u128::from(tally.counts.rays)]) {
        hasher.update(&number.to_le_bytes());
    }
    hasher.finalize().to_hex()[..16].into()
}

/// Scenes whose coordinates are written, not computed: platforms may differ in sin and cos.
fn written_scenes() -> [(&'static str, SceneSpec); 3] {
    let skew = |p: DVec3| {
        DVec3::new(p.x + 0.25 * p.y - 0.1 * p.z, p.y + 0.3 * p.z, 0.9 * p.z - 0.2 * p.x) + DVec3::splat(17.3)
    };
    let mut two_sided = cube54();
    let plate =
        crate::common::quad(DVec3::new(0.3, 0.2, 0.5), DVec3::X * 0.5, DVec3::new(0.0, 0.4, 0.1), [2, 2]);
    let triangle = radiosity::Shape::Triangle {
        a: DVec3::new(0.2, 0.2, 0.2),
        b: DVec3::new(0.8, 0.3, 0.2),
        c: DVec3::new(0.4, 0.9, 0.3),
        rows: 3,
    };
    for shape in [plate, triangle] {
        two_sided.surfaces.push(radiosity::SurfaceSpec {
            sides: radiosity::Sides::Both,
            emittance: 0.5.into(),
            ..crate::common::surface(shape, 0.6)
        });
    }
    [
        ("cube54", cube54()),
        ("skewed box", map_corners(&box_scene(DVec3::new(1.0, 2.0, 0.5), [4, 3]), skew)),
        ("two-sided", two_sided),
    ]
}

/// These digests may change only where the walk itself is meant to change: then all results do.
#[test]
fn tallies_are_the_same_bits_on_every_machine() {
    let golden = [
        ["f35078e158cf4e88", "bbbd1e1d35819265"],
        ["7dd2c035b9a407da", "03a6a4a8defe7e7f"],
        ["69ea0032c0582f80", "e3ad1889d2d28c3e"],
    ];
    let found = written_scenes().map(|(_, spec)| {
        [Space::Discrete, Space::Continuous]
            .map(|space| digest(&tally(&spec, IndexChoice::Flat, space, &[0, 20_000])))
    });
    assert_eq!(found, golden);
}

#[test]
fn a_tree_gives_the_same_bits_as_none() {
    let sphere = bumpy_sphere(2, 2);
    let slivers =
        map_corners(&sphere, |p| rotation() * (p * DVec3::new(1.0, 1e-3, 1.0)) + DVec3::splat(100.0));
    let scenes = written_scenes().into_iter().chain([("sphere", sphere), ("slivers", slivers)]);
    for (name, spec) in scenes {
        for space in [Space::Discrete, Space::Continuous] {
            let flat = tally(&spec, IndexChoice::Flat, space, &[0, 50_000]);
            let tree = tally(&spec, IndexChoice::Tree, space, &[0, 50_000]);
            assert_eq!(flat.hash(), tree.hash(), "{name}, {space:?}");
        }
    }
}

#[test]
fn any_split_of_the_walks_gives_the_same_bits() {
    let whole = tally(&cube54(), IndexChoice::Auto, Space::Discrete, &[0, 10_000]);
    for cuts in [&[0, 1, 2, 9_999, 10_000][..], &[0, 4_096, 8_192, 10_000], &[0, 3_333, 10_000]] {
        assert_eq!(tally(&cube54(), IndexChoice::Auto, Space::Discrete, cuts).hash(), whole.hash());
    }
}

/// Reusing a walk number would go unnoticed in means; here it changes the tally.
#[test]
fn walks_are_distinct() {
    let halves = [
        tally(&cube54(), IndexChoice::Auto, Space::Discrete, &[0, 5_000]),
        tally(&cube54(), IndexChoice::Auto, Space::Discrete, &[5_000, 10_000]),
    ];
    assert_ne!(halves[0].sums(), halves[1].sums());
}
