//! The jobs that come with the project: each loads, builds, and is the scene it says it is.

use std::path::{Path, PathBuf};

use glam::{DVec3, dvec3};
use job::{Job, load};
use radiosity::{Counts, Experiment, Scene, Sequence, Shape, Solution, SurfaceSpec};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs")
}

fn loaded(name: &str) -> (Job, Scene) {
    let job = load(&folder().join(name).with_extension("toml"), &[]).unwrap();
    let scene = job.build_scene().unwrap();
    (job, scene)
}

/// How walks ended, and the radiosity of each patch that they give [W/m²].
fn shot(job: &Job, scene: &Scene, walks: u64) -> (Counts, Vec<f64>) {
    let experiment = Experiment::new(scene.clone(), job.method.walks()).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(job.seed), 0..walks, &mut board);
    let tally = board.take().unwrap();
    let solution = Solution::new(&experiment, &tally, job.confidence);
    (tally.counts, solution.estimates.iter().flatten().map(|estimate| estimate.radiosity).collect())
}

/// A·n of a whole surface [m²].
fn area_vector(surface: &SurfaceSpec) -> DVec3 {
    let (_, e_u, e_v) = surface.shape.edges();
    e_u.cross(e_v).normalize() * surface.shape.area()
}

fn centroid(surface: &SurfaceSpec) -> DVec3 {
    let corners = surface.shape.corners();
    corners.iter().sum::<DVec3>() / corners.len() as f64
}

/// The total area of the surfaces whose name starts so [m²].
fn area_of(job: &Job, prefix: &str) -> f64 {
    let named = |surface: &&SurfaceSpec| surface.name.as_deref().is_some_and(|name| name.starts_with(prefix));
    job.scene.spec().surfaces.iter().filter(named).map(|surface| surface.shape.area()).sum()
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
}

/// Convex and closed: normals inwards, area vectors and the volume add up, and no walk leaves.
fn assert_closed(job: &Job, scene: &Scene, area: f64, volume: f64) {
    let surfaces = &job.scene.spec().surfaces;
    let middle = surfaces.iter().map(centroid).sum::<DVec3>() / surfaces.len() as f64;
    for surface in surfaces {
        assert!(
            (middle - centroid(surface)).dot(area_vector(surface)) > 0.0,
            "{:?} faces outwards",
            surface.name
        );
    }
    assert!(surfaces.iter().map(area_vector).sum::<DVec3>().length() < 1e-12);
    assert_near(surfaces.iter().map(|surface| surface.shape.area()).sum(), area);
    let cones = surfaces.iter().map(|surface| (middle - centroid(surface)).dot(area_vector(surface)) / 3.0);
    assert_near(cones.sum(), volume);
    let (counts, _) = shot(job, scene, 200_000);
    assert_eq!((counts.escaped, counts.absorbed_back), (0, 0));
}

#[test]
fn every_file_is_tested_here() {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".toml"))
        .collect();
    names.sort();
    let known = [
        "cornell.toml",
        "cube54.toml",
        "cube6-r90.toml",
        "daylit.toml",
        "furnace.toml",
        "lamps.toml",
        "oven.toml",
        "room.toml",
        "two-rooms.toml",
    ];
    assert_eq!(names, known);
}

/// A furnished room of 5 m × 4 m × 2.6 m with a niche for its window: no light leaves it, and none ends on the back of a body.
#[test]
fn room() {
    let (job, scene) = loaded("room");
    let surfaces = &job.scene.spec().surfaces;
    let lit = surfaces.iter().filter(|surface| surface.emittance.channels().iter().any(|&power| power > 0.0));
    assert!(lit.clone().count() >= 3 && surfaces.len() > 500);
    let (counts, _) = shot(&job, &scene, 300_000);
    assert_eq!((counts.escaped, counts.absorbed_back), (0, 0));
}

/// A room of 4 m × 6 m × 3 m with an opening of 3 m × 1.8 m in its south wall, and the black sky around it, which no walk leaves.
#[test]
fn daylit() {
    let (job, scene) = loaded("daylit");
    assert_near(area_of(&job, "south-"), 4.0 * 3.0 - 3.0 * 1.8);
    assert_near(area_of(&job, "floor") + area_of(&job, "ceiling"), 2.0 * 4.0 * 6.0);
    let (counts, _) = shot(&job, &scene, 100_000);
    assert!(counts.escaped == 0 && counts.absorbed_back > 0, "{counts:?}");
}

/// A box with two lamps inside, whose sides all live; its groups are those of its emitters.
#[test]
fn lamps() {
    let (job, scene) = loaded("lamps");
    let (counts, _) = shot(&job, &scene, 100_000);
    assert_eq!((counts.escaped, counts.absorbed_back), (0, 0));
    let members = |groups: &[radiosity::groups::PatchGroup]| {
        let of = |group: &radiosity::groups::PatchGroup| (group.name.clone(), group.patches.clone());
        groups.iter().map(of).collect::<Vec<_>>()
    };
    let sources = [("left".into(), vec![(16, 16)]), ("right".into(), vec![(17, 17)])];
    assert_eq!(members(&job.sources), sources);
    let materials = [
        ("wood".into(), vec![(0, 7)]),
        ("white".into(), vec![(8, 15), (18, 27)]),
        ("lamp".into(), vec![(16, 17)]),
    ];
    assert_eq!(members(&job.sensitivity), materials);
}

/// A unit cube with two grey plates; its heater emits as a body of 900 K does.
#[test]
fn oven() {
    let (job, scene) = loaded("oven");
    assert_closed(&job, &scene, 6.0, 1.0);
    let heater = &job.scene.spec().surfaces[1];
    let emitted = (1.0 - heater.reflectance.channels()[0]) * 5.670_374_419e-8 * 900.0_f64.powi(4);
    assert!((heater.emittance.channels()[0] / emitted - 1.0).abs() < 1e-3, "{emitted} W/m²");
}

/// Two boxes of 0.99 m × 1 m × 1 m and a passage of 2 cm × 0.1 m × 0.1 m: its sides in place of its ends.
#[test]
fn two_rooms() {
    let (job, scene) = loaded("two-rooms");
    let surfaces = &job.scene.spec().surfaces;
    assert!(surfaces.iter().all(|surface| surface.reflectance == 0.95.into()));
    assert!(surfaces.iter().map(area_vector).sum::<DVec3>().length() < 1e-12);
    let area = surfaces.iter().map(|surface| surface.shape.area()).sum();
    assert_near(area, 2.0 * (2.0 + 4.0 * 0.99) - 2.0 * 0.1 * 0.1 + 4.0 * 0.02 * 0.1);
    let (counts, _) = shot(&job, &scene, 100_000);
    assert_eq!((counts.escaped, counts.absorbed_back), (0, 0));
}

#[test]
fn cube6_r90() {
    let (job, scene) = loaded("cube6-r90");
    assert_eq!(scene.faces().len(), 6);
    assert!(
        scene.faces().iter().all(|patch| patch.reflectance == 0.9.into() && patch.emittance == 0.1.into())
    );
    assert_closed(&job, &scene, 6.0, 1.0);
}

#[test]
fn cube54() {
    let (job, scene) = loaded("cube54");
    assert_eq!(scene.faces().len(), 54);
    for (number, patch) in scene.faces().iter().enumerate() {
        assert_near(patch.reflectance[0], 0.3 + 0.1 * (number / 9) as f64);
        assert_near(patch.area, 1.0 / 9.0);
        assert_eq!(patch.emittance[0], if number == 4 { 1.0 } else { 0.0 });
    }
    assert_closed(&job, &scene, 6.0, 1.0);
}

#[test]
fn furnace() {
    let (job, scene) = loaded("furnace");
    let slope = 1.5_f64.hypot(1.0);
    assert_closed(&job, &scene, 12.0 + 2.0 * (8.0 + 6.0 + 1.5) + 2.0 * 4.0 * slope, 4.0 * (6.0 + 1.5));
    let (_, radiosities) = shot(&job, &scene, 1_000_000);
    for radiosity in radiosities {
        assert!((radiosity - 8.0).abs() < 0.5, "{radiosity} W/m² in a furnace of 8");
    }
}

/// The area of a polygon, its corners in order [m²].
fn shoelace(corners: [[f64; 2]; 4]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|([x, z], [x2, z2])| x * z2 - x2 * z).sum::<f64>().abs()
}

#[test]
fn cornell_areas() {
    let (job, scene) = loaded("cornell");
    let (height, depth) = (0.5488, 0.5592);
    assert_near(area_of(&job, "lamp"), 0.130 * 0.105);
    assert_near(area_of(&job, "ceiling"), 0.556 * depth - 0.130 * 0.105);
    assert_near(area_of(&job, "back"), 0.5 * (0.5496 + 0.556) * height);
    assert_near(area_of(&job, "green"), height * depth);
    let short = shoelace([[0.130, 0.065], [0.082, 0.225], [0.240, 0.272], [0.290, 0.114]]);
    let tall = shoelace([[0.423, 0.247], [0.265, 0.296], [0.314, 0.456], [0.472, 0.406]]);
    assert_near(area_of(&job, "short-top"), short);
    assert_near(area_of(&job, "tall-top"), tall);
    assert_near(area_of(&job, "floor"), 0.5 * (0.5496 + 0.5528) * depth - short - tall);
    assert_eq!(scene.faces().len(), 2692);
    assert_near((0..3).map(|c| scene.total_power(c)).sum(), 100.0 * 0.130 * 0.105);
}

#[test]
fn cornell_faces_the_room() {
    let (job, _) = loaded("cornell");
    let blocks = [("short", dvec3(0.1855, 0.0, 0.169)), ("tall", dvec3(0.3685, 0.0, 0.35125))];
    for surface in &job.scene.spec().surfaces {
        let name = surface.name.as_deref().unwrap();
        let centre = centroid(surface);
        // Blocks are seen from outside, the room from inside.
        let outwards = match blocks.iter().find(|(block, _)| name.starts_with(block)) {
            Some((_, block)) => centre - *block,
            None => dvec3(0.278, 0.2744, 0.2796) - centre,
        };
        assert!(outwards.dot(area_vector(surface)) > 0.0, "{name} faces the wrong way");
    }
}

/// Area vectors of a closed surface add up to none: what is missing is the front.
#[test]
fn cornell_is_open_in_front_only() {
    let (job, scene) = loaded("cornell");
    let surfaces = &job.scene.spec().surfaces;
    let open = surfaces.iter().map(area_vector).sum::<DVec3>();
    let front = 0.5 * (0.5528 + 0.556) * 0.5488;
    assert!((open - dvec3(0.0, 0.0, -front)).length() < 1e-12, "{open}");
    let (counts, radiosities) = shot(&job, &scene, 500_000);
    assert!(counts.escaped > 0);
    assert_eq!(counts.absorbed_back, 0);
    assert!(radiosities.iter().all(|&radiosity| radiosity > 0.0), "a patch that no walk reaches");
}

#[test]
fn cornell_patches_are_of_a_size() {
    let (job, scene) = loaded("cornell");
    for patch in scene.faces() {
        let surface = &job.scene.spec().surfaces[patch.surface as usize];
        assert!(patch.area > 3e-4 && patch.area < 1.3e-3, "{:?}: {} m²", surface.name, patch.area);
        if let Shape::Parallelogram { cells, .. } = surface.shape {
            let (_, e_u, e_v) = surface.shape.edges();
            let aspect = e_u.length() / f64::from(cells[0]) / (e_v.length() / f64::from(cells[1]));
            assert!((0.8..1.25).contains(&aspect), "{:?}: {aspect}", surface.name);
        }
    }
}
