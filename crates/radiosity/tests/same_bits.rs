//! Tallies have the same bits on any machine, with or without a tree, however the walks are split.

use crate::common::{box_scene, bumpy_sphere, collision, cube54, experiment, map_corners, rotation, walk};
use glam::DVec3;
use photometry::Luminaire;
use radiosity::{
    IndexChoice, SceneSpec, Space, Tally,
    lamps::{Emission, LampSpec},
};

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

/// A scene without its second surface, through which the light of distant lamps comes, and with lamps of all kinds.
fn lit_by_lamps(mut spec: SceneSpec) -> SceneSpec {
    spec.surfaces.remove(1);
    let file = "TILT=NONE\n1 -1 1 3 3 1 2 0 0 0\n1 1 10\n0 60 170\n0 90 180\n90 80 5\n90 10 0\n90 50 60\n";
    spec.lamps.tables = vec![Luminaire::read(file.as_bytes()).unwrap().distribution];
    let lamp = |emission: Emission, strength: f64, aim: DVec3| {
        LampSpec::new(DVec3::new(0.6, 0.3, 0.8), emission, strength).aimed(aim, 0.0)
    };
    spec.lamps.list = vec![
        lamp(Emission::Uniform, 0.3, DVec3::Y),
        lamp(Emission::Spot { inner: 0.9, outer: 0.25 }, 1.5, DVec3::new(2.0, -1.0, -2.0)),
        lamp(Emission::Table(0), 0.01, DVec3::new(0.1, -0.2, -1.0)),
        lamp(Emission::Distant { rim: 0.9 }, 0.4, DVec3::new(-0.3, 0.2, -1.0)),
    ];
    spec
}

/// Scenes whose coordinates are written, not computed: platforms may differ in sin and cos.
fn written_scenes() -> [(&'static str, SceneSpec); 4] {
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
        ("two-sided", two_sided.clone()),
        ("lamps", lit_by_lamps(two_sided)),
    ]
}

/// These digests may change only where the walk itself is meant to change: then all results do.
#[test]
fn tallies_are_the_same_bits_on_every_machine() {
    let golden = [
        ["f35078e158cf4e88", "bbbd1e1d35819265"],
        ["7dd2c035b9a407da", "03a6a4a8defe7e7f"],
        ["69ea0032c0582f80", "e3ad1889d2d28c3e"],
        ["90619a2ca1d9ea89", "9693c6afb86d49ac"],
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
