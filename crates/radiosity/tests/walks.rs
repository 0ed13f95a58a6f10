//! What walks do where it is known without solving anything: where they begin, how they leave, what stops
//! them, what they cannot reach. Most of it is exact and holds for any seed.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::common::{box_scene, box_walls, collision, cube54, experiment, map_corners, quad, surface, walk};
use glam::DVec3;
use radiosity::{
    Birth, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Side, Sides,
    Solution, Space, Spectrum, SurfaceSpec, Tally,
    methods::{Sampler, Score},
    rays::Ray,
};

const BOTH_SPACES: [Space; 2] = [Space::Discrete, Space::Continuous];
const BOTH_INDEXES: [IndexChoice; 2] = [IndexChoice::Flat, IndexChoice::Tree];

/// Shoots collision walks with seed 42.
fn shoot(spec: &SceneSpec, index: IndexChoice, space: Space, walks: u64) -> (Experiment, Tally) {
    let experiment = experiment(spec, index, collision(space));
    let tally = walk(&experiment, 42, 0..walks);
    (experiment, tally)
}

/// Σx of every surface.
fn hits_by_surface((experiment, tally): &(Experiment, Tally)) -> Vec<u128> {
    let mut hits = vec![0; experiment.scene().surfaces().len()];
    for (i, patch) in experiment.scene().faces().iter().enumerate() {
        hits[patch.surface as usize] += tally.patch(i, 0)[0];
    }
    hits
}

fn square(corner: DVec3, reflectance: f64) -> SurfaceSpec {
    surface(quad(corner, DVec3::X, DVec3::Y, [1, 1]), reflectance)
}

/// A unit cube cut in two at z = ½ by a plate with two sides, surface 6.
fn parted_cube(reflectance: f64) -> SceneSpec {
    let plate = surface(quad(DVec3::Z * 0.5, DVec3::X, DVec3::Y, [2, 2]), reflectance);
    let walls = box_walls(DVec3::ONE, [2, 2]).into_iter().map(|wall| surface(wall, reflectance));
    SceneSpec::new(walls.chain([SurfaceSpec { sides: Sides::Both, ..plate }]).collect())
}

/// Where the cells lie is nothing to a continuous walk: cutting walls that do not emit moves no ray. A discrete
/// walk leaves from a fresh point of the cell, and so sees them.
#[test]
fn continuous_walks_do_not_see_the_cells_and_discrete_ones_do() {
    let hits = |space, cells| {
        let mut spec = box_scene(DVec3::new(1.0, 2.0, 0.5), cells);
        spec.surfaces[0] = SurfaceSpec { emittance: 1.0.into(), ..square(DVec3::ZERO, 0.3) };
        hits_by_surface(&shoot(&spec, IndexChoice::Flat, space, 10_000))
    };
    assert_eq!(hits(Space::Continuous, [1, 1]), hits(Space::Continuous, [5, 3]));
    assert_ne!(hits(Space::Discrete, [1, 1]), hits(Space::Discrete, [5, 3]));
}

/// In a closed scene every ray arrives, and every arrival scores: the last of a walk too, but not its birth. A
/// black wall cannot meet its own light.
#[test]
fn every_ray_scores_where_it_ends() {
    let mut black = cube54();
    black.surfaces.iter_mut().for_each(|surface| surface.reflectance = Spectrum::BLACK);
    for space in BOTH_SPACES {
        let bright = shoot(&cube54(), IndexChoice::Auto, space, 10_000);
        let black = shoot(&black, IndexChoice::Auto, space, 10_000);
        assert_eq!(hits_by_surface(&bright).iter().sum::<u128>(), bright.1.counts.rays.into());
        assert!(bright.1.counts.rays > 15_000, "walks of several rays");
        assert_eq!(hits_by_surface(&black).iter().sum::<u128>(), 10_000);
        assert_eq!((hits_by_surface(&black)[0], black.1.counts.rays), (0, 10_000));
    }
}

/// Light passes a plate with two sides neither way: it goes back to where it came from.
#[test]
fn beyond_a_plate_it_is_dark() {
    for (lit, dark) in [(0, 1), (1, 0)] {
        let mut spec = parted_cube(0.9);
        spec.surfaces[lit].emittance = 1.0.into();
        for (index, space) in
            BOTH_INDEXES.into_iter().flat_map(|index| BOTH_SPACES.map(|space| (index, space)))
        {
            let run = shoot(&spec, index, space, 20_000);
            let hits = hits_by_surface(&run);
            assert_eq!(hits[dark], 0, "{index:?}, {space:?}");
            assert!(hits[lit] > 20_000 && hits[6] > 20_000, "light goes to and fro: {hits:?}");
            assert_eq!(run.1.counts.absorbed, 20_000);
        }
    }
}

/// A closed scene of one E and R glows evenly, H = B = E/(1 − R), and a plate with two sides does as the walls:
/// it emits and gathers on both. 28 patches to 1 %, with standard errors ≤ 0.24 %: false-alarm rate 6·10⁻⁴, once
/// and for all with this seed.
#[test]
fn a_plate_glows_on_both_sides_like_the_walls_of_its_furnace() {
    let mut spec = parted_cube(0.5);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 2.0.into());
    let (experiment, tally) = shoot(&spec, IndexChoice::Auto, Space::Discrete, 3_000_000);
    assert_eq!(experiment.scene().total_power(0), 2.0 * (6.0 + 2.0));
    let solution = Solution::new(&experiment, &tally, 0.95);
    for (patch, estimate) in solution.estimates.iter().flatten().enumerate() {
        assert!((estimate.radiosity / 4.0 - 1.0).abs() < 0.01, "patch {patch}: {estimate:?}");
        assert!((estimate.irradiance.unwrap() / 4.0 - 1.0).abs() < 0.01, "patch {patch}: {estimate:?}");
    }
}

/// The back of a one-sided plate takes what meets it and gives nothing back: not a score, not a ray. Of the light
/// of a unit square at distance 1 that is the part 0.199825 (Howell C-11). |z| < 4: false-alarm rate 6·10⁻⁵, once
/// and for all with this seed.
#[test]
fn the_back_of_a_plate_absorbs_without_a_score() {
    const WALKS: u64 = 100_000;
    const PART: f64 = 0.199825;
    let emitter = SurfaceSpec { emittance: 1.0.into(), ..square(DVec3::ZERO, 0.9) };
    let spec = SceneSpec::new(vec![emitter, square(DVec3::Z, 0.9)]);
    for index in BOTH_INDEXES {
        let (_, tally) = shoot(&spec, index, Space::Discrete, WALKS);
        let counts = tally.counts;
        assert_eq!((counts.rays, counts.absorbed), (WALKS, 0));
        assert_eq!(counts.absorbed_back + counts.escaped, WALKS);
        assert!(tally.sums().iter().all(|&sum| sum == 0));
        let z =
            (counts.absorbed_back as f64 - PART * WALKS as f64) / (PART * (1.0 - PART) * WALKS as f64).sqrt();
        assert!(z.abs() < 4.0, "{} met the back, {z:.1} σ off", counts.absorbed_back);
    }
}

/// Two black boxes far apart, of 3 W/m² on 1 m² and 0.25 W/m² on 4 m²: three walks in four begin in the first.
/// |z| < 4: false-alarm rate 6·10⁻⁵, once and for all with this seed.
#[test]
fn walks_begin_in_proportion_to_power() {
    const WALKS: u64 = 100_000;
    let mut spec = SceneSpec::new(vec![]);
    for (x, size, emittance) in [(0.0, 1.0, 3.0), (50.0, 2.0, 0.25)] {
        let walls = box_walls(DVec3::splat(size), [1, 1]).into_iter().map(|wall| surface(wall, 0.0));
        let mut closed = map_corners(&SceneSpec::new(walls.collect()), |p| p + DVec3::X * x);
        closed.surfaces[0].emittance = emittance.into();
        spec.surfaces.append(&mut closed.surfaces);
    }
    let run = shoot(&spec, IndexChoice::Auto, Space::Discrete, WALKS);
    assert_eq!(run.0.scene().total_power(0), 4.0);
    let first = hits_by_surface(&run)[..6].iter().sum::<u128>() as f64;
    let z = (first - 0.75 * WALKS as f64) / (0.75 * 0.25 * WALKS as f64).sqrt();
    assert!(z.abs() < 4.0, "{first} walks began in the first box, {z:.1} σ off");
}

/// A ray meets the first of surfaces that lie upon each other, in whatever order a tree has them.
#[test]
fn of_coincident_surfaces_the_lowest_number_is_met() {
    let mut spec = SceneSpec::new(vec![SurfaceSpec { emittance: 1.0.into(), ..square(DVec3::ZERO, 0.5) }]);
    let facing = surface(quad(DVec3::Z, DVec3::Y, DVec3::X, [1, 1]), 0.5);
    spec.surfaces.extend(vec![facing; 30]);
    for index in BOTH_INDEXES {
        let hits = hits_by_surface(&shoot(&spec, index, Space::Discrete, 1000));
        assert!(hits[1] > 0 && hits[2..].iter().all(|&hits| hits == 0), "{index:?}: {hits:?}");
    }
}

/// The slack of [`edges_in_the_middle`]: 2⁻⁴⁶ of its extent, 2 m.
const SLACK: f64 = 2.0 / (1_u64 << 46) as f64;

/// Two squares whose edges end at x = 0, the middle of the scene, where no rounding of a box's bounds makes up
/// for a margin that is missing: one at z = 0 to the left, one at z = 1 to the right, above a floor.
fn edges_in_the_middle(index: IndexChoice) -> Scene {
    let left = quad(DVec3::new(-1.0, -1.0, 0.0), DVec3::X, DVec3::Y * 2.0, [1, 1]);
    let right = quad(DVec3::new(0.0, -1.0, 1.0), DVec3::X, DVec3::Y * 2.0, [1, 1]);
    let floor = quad(DVec3::new(-1.0, -1.0, -1.0), DVec3::X * 2.0, DVec3::Y * 2.0, [1, 1]);
    let mut spec = SceneSpec::new([left, right, floor].map(|shape| surface(shape, 0.5)).to_vec());
    spec.surfaces[2].emittance = 1.0.into();
    let scene = Scene::build(&spec, index).unwrap();
    assert_eq!(scene.origin(), DVec3::ZERO);
    scene
}

/// A surface is met a slack beyond its edge, so that no ray falls through where two meet, and the boxes of a
/// tree hold all of that.
#[test]
fn surfaces_are_met_a_slack_beyond_their_edges_with_and_without_a_tree() {
    let [flat, tree] = BOTH_INDEXES.map(edges_in_the_middle);
    for step in -40..=40 {
        let x = 0.1 * f64::from(step);
        let ray = Ray { origin: DVec3::new(x * SLACK, 0.3, 2.0), direction: -DVec3::Z, from: Ray::FREE };
        let hit = flat.closest_hit(&ray).unwrap();
        assert_eq!(tree.closest_hit(&ray), Some(hit), "{x:.1} slacks");
        // The right one is nearer, as far as it reaches.
        if (x + 1.0).abs() > 0.05 {
            assert_eq!(hit.surface, u32::from(x > -1.0), "{x:.1} slacks");
        }
    }
}

/// A ray that starts a rounding error behind the front of a surface meets it at once; one that starts farther
/// behind does not, nor does one that comes out of its back.
#[test]
fn a_start_within_the_slack_of_a_plane_counts_as_on_it() {
    for index in BOTH_INDEXES {
        let scene = edges_in_the_middle(index);
        for (height, direction, met) in [
            (0.5, -DVec3::Z, Some((0, Side::Front))),
            (-0.5, -DVec3::Z, Some((0, Side::Front))),
            (-2.0, -DVec3::Z, Some((2, Side::Front))),
            (0.5, DVec3::Z, None),
            (-0.5, DVec3::Z, None),
            (-2.0, DVec3::Z, Some((0, Side::Back))),
        ] {
            let origin = DVec3::new(-0.4, 0.3, height * SLACK);
            let hit = scene.closest_hit(&Ray { origin, direction, from: Ray::FREE });
            assert_eq!(hit.map(|hit| (hit.surface, hit.side)), met, "{height} slacks, {direction}");
            assert!(hit.is_none_or(|hit| hit.t >= 0.0), "{hit:?}");
        }
    }
}

/// A planar surface cannot meet itself: not even from a point that rounding put before or behind it.
#[test]
fn a_ray_never_meets_the_surface_it_leaves() {
    let scene = edges_in_the_middle(IndexChoice::Flat);
    for height in [-1e-3, -0.5 * SLACK, 0.0, 0.5 * SLACK, 1e-3] {
        for direction in [DVec3::Z, -DVec3::Z] {
            let ray = Ray { origin: DVec3::new(-0.4, 0.3, height), direction, from: 0 };
            assert!(scene.closest_hit(&ray).is_none_or(|hit| hit.surface != 0), "{height}, {direction}");
        }
    }
}

/// Rays meet only the half of a parallelogram that a triangle is, and a slack (2⁻⁴⁶ of its extent, 1 m) beyond the
/// third edge.
#[test]
fn a_triangle_is_met_a_slack_beyond_its_third_edge_and_no_farther() {
    let shape = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows: 1 };
    let spec = SceneSpec::new(vec![SurfaceSpec { emittance: 1.0.into(), ..surface(shape, 0.5) }]);
    for scene in BOTH_INDEXES.map(|index| Scene::build(&spec, index).unwrap()) {
        let edge = DVec3::new(0.6, 0.4, 1.0) - scene.origin();
        for (slacks, met) in [(-1e12, true), (-1.5, true), (0.5, true), (1.5, false), (1e12, false)] {
            let beyond = DVec3::new(1.0, 1.0, 0.0).normalize() * (slacks * 0.5 * SLACK);
            let hit =
                scene.closest_hit(&Ray { origin: edge + beyond, direction: -DVec3::Z, from: Ray::FREE });
            assert_eq!(hit.is_some(), met, "{slacks} slacks beyond");
        }
    }
}

/// Coordinates are relative to the middle of a scene: 10⁹ edges away the walls are hit where they are at home.
#[test]
fn far_away_a_scene_is_traced_as_exactly_as_at_home() {
    let offset = DVec3::new(1.0, -0.5, 0.25) * 2f64.powi(30);
    let home = Scene::build(&cube54(), IndexChoice::Flat).unwrap();
    let away = Scene::build(&map_corners(&cube54(), |p| p + offset), IndexChoice::Flat).unwrap();
    assert_eq!(away.origin(), home.origin() + offset);
    let ray =
        Ray { origin: DVec3::new(0.1, 0.2, 0.3), direction: DVec3::new(0.3, -0.4, -1.0), from: Ray::FREE };
    let [home, away] = [home, away].map(|scene| scene.closest_hit(&ray).unwrap());
    assert_eq!((away.t, away.surface, away.side), (home.t, home.surface, home.side));
}

/// Walks of which none ends in any time are given up in their middle, with every method.
#[test]
fn walks_that_hardly_end_are_given_up() {
    let scene = Scene::build(&SceneSpec::furnace(1, 1.0 - 1e-14), IndexChoice::Auto).unwrap();
    let kinds = [EstimatorKind::Collision, EstimatorKind::Infinite];
    let walks = kinds.map(|kind| [Method::shooting(kind), Method::gathering(Birth::Area, kind)]);
    let batches = Method::batches(64, Sampler::Sobol);
    for method in walks.into_iter().flatten().chain([batches]) {
        let experiment = Experiment::new(scene.clone(), method).unwrap();
        let asked = AtomicU32::new(0);
        let go_on = || asked.fetch_add(1, Ordering::Relaxed) < 3;
        experiment.walk_while(&Sequence::new(1), 0..64, &mut experiment.board(), &go_on);
        assert!(asked.into_inner() > 3, "{:?}", experiment.method());
    }
}

/// Walks of more visits than are kept until they end: Σx² of one walk is the square of its Σx, and walks side by side, which change places as
/// others end, score what they score one by one.
#[test]
fn long_walks_score_whole_however_often_they_return() {
    for (kind, reflectance) in [(EstimatorKind::Collision, 0.99995), (EstimatorKind::Infinite, 0.9998)] {
        let grey = SceneSpec::furnace(1, reflectance);
        let mut colour = grey.clone();
        colour.surfaces[0].reflectance = Spectrum::rgb([reflectance, 0.999, 0.5]);
        let [plain, linear] = [Score::Of(kind.into()), Score::Linear(kind.into())];
        for (spec, score) in [(&grey, plain), (&colour, plain), (&grey, linear)] {
            let experiment = experiment(spec, IndexChoice::Auto, Method::shooting(score));
            let (mut apart, mut longest) = (experiment.tally(), 0);
            for number in 0..2 {
                let one = walk(&experiment, 3, number..number + 1);
                longest = longest.max(one.counts.rays);
                for (face, channel) in (0..6).flat_map(|face| (0..spec.channels()).map(move |c| (face, c))) {
                    let sums = one.patch(face, channel);
                    assert_eq!(sums[1], sums[0] * sums[0], "{score:?}, walk {number}, face {face}");
                }
                apart.merge(&one).unwrap();
            }
            assert!(longest > 20_000, "{score:?}: {longest} rays");
            assert_eq!(walk(&experiment, 3, 0..2), apart, "{score:?}");
        }
    }
}
