//! Lamps without area: births by the distribution, direct light at points, and both by closed forms.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Estimate, Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Sides, Solution,
    SurfaceSpec, Unfit, WalkRng,
    lamps::{Emission, LampSpec, LampsSpec},
    rays::Ray,
    sensors::{Readings, SensorShape, SensorSpec},
};
use stats::mean_squared_z;

/// A table without symmetry: intensities differ between all planes.
fn table() -> &'static Distribution {
    static TABLE: LazyLock<Distribution> = LazyLock::new(read_table);
    &TABLE
}

fn read_table() -> Distribution {
    let file = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 5 5 1 2 0 0 0\n1 1 10\n0 40 90 130 180\n0 90 180 270 360\n\
                100 80 20 5 0\n100 300 40 5 0\n100 10 5 2 0\n100 120 90 30 0\n100 80 20 5 0\n";
    Luminaire::read(file.as_bytes()).unwrap().distribution
}

/// A cube of 1 m whose sides have 2 × 2 cells, of one reflectance.
fn cube(reflectance: f64) -> SceneSpec {
    let mut spec = SceneSpec::furnace(2, reflectance);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    spec
}

fn with_lamps(spec: SceneSpec, list: Vec<LampSpec>) -> SceneSpec {
    SceneSpec { lamps: LampsSpec { tables: vec![table().clone()], list, ..LampsSpec::default() }, ..spec }
}

fn uniform(rng: &mut WalkRng) -> f64 {
    rng.pair()[0]
}

fn direction(rng: &mut WalkRng) -> DVec3 {
    let z = 2.0 * uniform(rng) - 1.0;
    let (sin, cos) = (2.0 * PI * uniform(rng)).sin_cos();
    DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
}

/// A lamp of some kind within the cube.
fn some_lamp(rng: &mut WalkRng, kind: usize) -> LampSpec {
    let position = DVec3::from_array(std::array::from_fn(|_| 0.15 + 0.7 * uniform(rng)));
    let emission = match kind % 3 {
        0 => Emission::Uniform,
        1 => Emission::Spot { inner: 0.9, outer: 0.9 - 1.5 * uniform(rng) },
        _ => Emission::Table(0),
    };
    LampSpec::new(position, emission, 0.1 + uniform(rng)).aimed(direction(rng), 360.0 * uniform(rng))
}

/// E at a point by the formula: I cos θ / d², or the light of a distant lamp times the cosine.
fn by_formula(lamp: &LampSpec, point: DVec3, normal: DVec3) -> f64 {
    let away = point - lamp.position;
    let strength = lamp.strength.max();
    let [x, y, z] = lamp.axes;
    let intensity = match lamp.emission {
        Emission::Uniform => 1.0,
        Emission::Spot { inner, outer } => {
            ((-z.dot(away.normalize()) - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2)
        }
        Emission::Table(_) => table().intensity(DVec3::new(x.dot(away), y.dot(away), z.dot(away))),
        Emission::Distant { .. } => unreachable!("none is far away"),
    };
    strength * intensity * (-away.normalize().dot(normal)).max(0.0) / away.length_squared()
}

/// A lamp in the plane of a wall, wherever and however turned the wall is, shines to the side that it is aimed at, and there unweakened: at points a
/// millimetre to 100 m away, as walks find it. A corner of two walls takes nothing from one that hangs in it.
#[test]
fn lamps_in_walls_shine_to_one_side() {
    let mut rng = Sequence::new(21).walk(0);
    for number in 0..300 {
        let normal = direction(&mut rng);
        let (u, v) = normal.any_orthonormal_pair();
        let place = 10.0 * direction(&mut rng);
        let wall =
            |u: DVec3, v: DVec3| Shape::parallelogram(place - 3.0 * u - 4.0 * v, 8.0 * u, 7.0 * v, [1, 1]);
        let mut surfaces = vec![SurfaceSpec::new(wall(u, v), 0.5)];
        // Each third one has a second wall through the lamp, across the first and seen from its edge.
        if number % 3 == 0 {
            let edge = Shape::parallelogram(place - 3.0 * u, 8.0 * u, 5.0 * normal, [1, 1]);
            surfaces.push(SurfaceSpec::new(edge, 0.5));
        }
        surfaces
            .iter_mut()
            .for_each(|surface| surface.sides = if number % 2 == 0 { Sides::Both } else { Sides::Front });
        let lamp = LampSpec::new(place, Emission::Uniform, 5.0).aimed(normal, 0.0);
        let spec = with_lamps(SceneSpec::new(surfaces), vec![lamp.clone()]);
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let mut towards = direction(&mut rng);
        towards += normal * (0.3 - towards.dot(normal)).max(0.0);
        if number % 3 == 0 {
            towards += v * (0.1 - towards.dot(v)).max(0.0);
        }
        let away = 10_f64.powf(5.0 * uniform(&mut rng) - 3.0) * towards.normalize();
        let light =
            |point: DVec3| scene.lamps_at(point - scene.origin(), (place - point).normalize(), Ray::FREE)[0];
        let expected = by_formula(&lamp, place + away, -away.normalize());
        let found = light(place + away);
        // The lamp hangs some 10⁻¹² m in front of its place.
        let limit = 1e-9 + 1e-11 / away.length();
        assert!((found / expected - 1.0).abs() < limit, "{number}: {found} for {expected}");
        let behind = place + away - 2.0 * away.dot(normal) * normal;
        assert_eq!(light(behind), 0.0, "{number}: {}", away.length());
    }
}

/// The inverse square law and the cosine law on 200 random lamps of all kinds: H of 24 black patches by births, against 40 × 40
/// midpoints of each. Mean squares of z are within 4 of their standard errors of 1 (a false alarm in 16,000), and no z exceeds 5.5.
#[test]
fn births_light_patches_by_the_inverse_square_law() {
    const POINTS: u32 = 40;
    let mut rng = Sequence::new(3).walk(0);
    let mut z = Vec::new();
    for number in 0..200 {
        let lamp = some_lamp(&mut rng, number);
        let spec = cube(0.0);
        let scene = Scene::build(&with_lamps(spec, vec![lamp.clone()]), IndexChoice::Auto).unwrap();
        let power = scene.total_power(0);
        let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
        let solution = experiment.run(number as u64, 20_000).unwrap();
        let scene = experiment.scene();
        for (face, estimate) in solution.estimates.iter().enumerate() {
            let corners = scene.faces().piece_corners(face as u32);
            let (a, u, v) = (corners[0], corners[1] - corners[0], corners[3] - corners[0]);
            let normal = u.cross(v).normalize();
            let places = (0..POINTS * POINTS)
                .map(|i| [i / POINTS, i % POINTS].map(|i| (f64::from(i) + 0.5) / f64::from(POINTS)));
            let light: f64 = places.map(|[s, t]| by_formula(&lamp, a + u * s + v * t, normal)).sum();
            let light = light / f64::from(POINTS * POINTS);
            // Whole hits: a binomial number.
            let part = light * scene.faces().get(face).area / power;
            let error = (power / scene.faces().get(face).area) * (part * (1.0 - part) / 20_000.0).sqrt();
            if part.min(1.0 - part) * 20_000.0 > 20.0 {
                z.push((estimate.as_ref().unwrap().irradiance.unwrap_or(0.0) - light) / error);
            }
        }
    }
    assert!(z.len() > 2000, "{} patches", z.len());
    assert!(z.iter().all(|z| z.abs() < 5.5), "{:?}", z.iter().map(|z| z.abs()).fold(0.0, f64::max));
    let squares = mean_squared_z(z).unwrap();
    assert!(squares.z(1.0).abs() < 4.0, "{squares:?}");
}

/// The points of a plane within the cube, which look at random.
fn points(rng: &mut WalkRng, count: usize) -> SensorSpec {
    let mut point = || {
        let place = DVec3::from_array(std::array::from_fn(|_| 0.1 + 0.8 * uniform(rng)));
        [place, direction(rng)]
    };
    let points = (0..count).map(|_| point()).collect();
    SensorSpec { name: "points".into(), shape: SensorShape::Points { points, grid: [count as u32, 1] } }
}

/// H at twelve points, with its standard error.
fn at_points(spec: &SceneSpec) -> Vec<[f64; 2]> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    let sensor = points(&mut Sequence::new(5).walk(0), 12);
    let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
    let experiment = experiment.with_sensors(&[sensor]).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(2), 0..65_536, &mut board);
    let tally = board.take().unwrap();
    let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
    let known = |cell: usize| readings.cell(cell)[0];
    (0..12).map(|cell| [known(cell).irradiance.unwrap(), known(cell).std_error.unwrap_or(0.0)]).collect()
}

/// In black surroundings nothing is left to chance at points: I cos θ / d², to rounding, whatever the number of walks.
#[test]
fn light_at_points_is_exact() {
    let mut rng = Sequence::new(4).walk(0);
    for number in 0..60 {
        let lamp = some_lamp(&mut rng, number);
        let sensor = points(&mut rng, 20);
        let SensorShape::Points { points, .. } = &sensor.shape else { unreachable!() };
        let scene = Scene::build(&with_lamps(cube(0.0), vec![lamp.clone()]), IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
        let experiment = experiment.with_sensors(std::slice::from_ref(&sensor)).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(1), 0..2048, &mut board);
        let tally = board.take().unwrap();
        let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
        let mut mean = 0.0;
        for (cell, [point, normal]) in points.iter().enumerate() {
            let (light, reading) = (by_formula(&lamp, *point, *normal), readings.cell(cell)[0]);
            let found = reading.irradiance.unwrap();
            assert!((found - light).abs() <= 1e-9 * light.max(1e-3), "{number}: {found} for {light}");
            assert_eq!((reading.ci_low, reading.ci_high), (found, found));
            mean += light / points.len() as f64;
        }
        let figures = readings.plane(0, 0);
        assert!((figures.mean.value.unwrap() - mean).abs() < 1e-9 * mean.max(1e-3));
        assert_eq!(figures.minimum.low, figures.minimum.high);
    }
}

/// CIE 171:2006, 5.8: a lamp in a closed room of one reflectance. What is reflected is Φρ/(S(1 − ρ)) in the mean over all walls, each of which
/// takes in what the lamp sends and this: Φ/(S(1 − ρ)) in all. 1 × 1 × 1 m, 4π lm; a false alarm in 16,000 for each.
#[test]
fn a_point_lamp_in_a_closed_room_has_the_closed_form() {
    for (rho, seed) in [(0.2, 1), (0.5, 2), (0.9, 3)] {
        let lamp = LampSpec::new(DVec3::splat(0.5), Emission::Uniform, 1.0);
        let scene = Scene::build(&with_lamps(cube(rho), vec![lamp]), IndexChoice::Auto).unwrap();
        let flux = scene.total_power(0);
        assert!((flux - 4.0 * PI).abs() < 1e-12);
        let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
        let means: Vec<f64> = (0..40)
            .map(|run| {
                let solution = experiment.run(100 * seed + run, 5_000).unwrap();
                let faces = experiment.scene().faces().iter().zip(&solution.estimates);
                faces
                    .map(|(face, estimate)| face.area * estimate.as_ref().unwrap().irradiance.unwrap())
                    .sum::<f64>()
                    / 6.0
            })
            .collect();
        let expected = flux / 6.0 / (1.0 - rho);
        let measured = stats::Measured::of(&means);
        assert!(measured.z(expected).abs() < 4.0, "{rho}: {measured:?} for {expected}");
    }
}

/// Light from far away, from a point of the sky and from a disc: a plate gets E cos θ, by births, at points and on a quad of sensors.
#[test]
fn light_from_far_away_falls_by_the_cosine() {
    for rim in [1.0, 0.995] {
        let plate = Shape::parallelogram(DVec3::ZERO, DVec3::X, 2.0 * DVec3::Y, [2, 2]);
        let spec = SceneSpec::new(vec![SurfaceSpec::new(plate, 0.0)]);
        let aim = DVec3::new(0.4, -0.3, -1.0);
        let cosine = -aim.normalize().z;
        let lamp = LampSpec::new(DVec3::ZERO, Emission::Distant { rim }, 50.0).aimed(aim, 0.0);
        let scene = Scene::build(&with_lamps(spec, vec![lamp]), IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
        // The mean cosine over a cap of the sky is that of its middle times (1 + cos of its radius)/2.
        let expected = 50.0 * cosine * 0.5 * (1.0 + rim);
        for estimate in &experiment.run(5, 200_000).unwrap().estimates {
            let estimate = estimate.as_ref().unwrap();
            let [irradiance, error] = [estimate.irradiance.unwrap(), estimate.irradiance_error.unwrap()];
            assert!((irradiance - expected).abs() < 4.5 * error, "{irradiance} ± {error} for {expected}");
        }
        let quad = SensorShape::Quad {
            corner: DVec3::Z,
            corner_u: DVec3::X + DVec3::Z,
            corner_v: DVec3::Y + DVec3::Z,
            cells: [2, 1],
        };
        let sensors =
            [SensorSpec { name: "quad".into(), shape: quad }, points(&mut Sequence::new(9).walk(0), 3)];
        let experiment = experiment.with_sensors(&sensors).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(1), 0..65_536, &mut board);
        let tally = board.take().unwrap();
        let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
        for cell in 0..2 {
            let reading = readings.cell(cell)[0];
            let found = reading.irradiance.unwrap();
            let error = reading.std_error.unwrap_or(0.0) + 1e-9 * expected;
            assert!((found - expected).abs() < 5.0 * error, "{found} ± {error} for {expected}");
        }
    }
}

/// The sky is a box around the scene, and a distant lamp is farther away: a plate, and what it shades, get the light of both, by walks, by
/// chains and at points. z of Student's t: a false alarm in 1,000.
#[test]
fn light_from_far_away_comes_through_the_sky() {
    use radiosity::{Chains, methods::Solve};
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let sky = |emittance: f64| {
        let (low, high) = (at(-0.1, -0.1, -0.1), at(2.1, 2.1, 1.1));
        let sides = (0..3).flat_map(|axis| {
            let [u, v] = [1, 2].map(|next| DVec3::AXES[(axis + next) % 3] * (high - low)[(axis + next) % 3]);
            [[low, low + u, low + v], [high, high - v, high - u]]
        });
        let side = move |[corner, u, v]: [DVec3; 3]| SurfaceSpec {
            name: Some(radiosity::surfaces::SKY.into()),
            emittance: emittance.into(),
            ..SurfaceSpec::new(Shape::parallelogram(corner, u, v, [1, 1]), 0.0)
        };
        sides.map(side).collect::<Vec<_>>()
    };
    let spec = |emittance: f64, lamps: f64| {
        let ground = Shape::parallelogram(at(0.0, 0.0, 0.0), at(2.0, 0.0, 0.0), at(0.0, 2.0, 0.0), [2, 2]);
        let roof = Shape::parallelogram(at(0.0, 0.0, 1.0), at(1.0, 0.0, 1.0), at(0.0, 1.0, 1.0), [1, 1]);
        let roof = SurfaceSpec { sides: radiosity::Sides::Both, ..SurfaceSpec::new(roof, 0.5) };
        let mut surfaces = vec![SurfaceSpec::new(ground, 0.5), roof];
        surfaces.extend(if emittance > 0.0 { sky(emittance) } else { Vec::new() });
        let sun =
            |rim: f64, aim| LampSpec::new(DVec3::ZERO, Emission::Distant { rim }, lamps).aimed(aim, 0.0);
        let list = vec![sun(1.0, at(0.2, 0.3, -1.0)), sun(0.99, at(-0.5, 0.2, -0.6))];
        with_lamps(SceneSpec::new(surfaces), if lamps > 0.0 { list } else { Vec::new() })
    };
    let all = [(40.0, 30.0), (40.0, 0.0), (0.0, 30.0)].map(|(sky, lamps)| spec(sky, lamps));
    let chains = Chains { rays: 20_000, solve: Solve::Links, linear: false, final_gather: Vec::new() };
    let by_walks =
        all.each_ref().map(|spec| irradiances(spec, Method::shooting(Estimator::Collision), 400_000));
    let by_chains = all.each_ref().map(|spec| irradiances(spec, chains.clone(), 32));
    let at_points = all.each_ref().map(at_points);
    for [both, sky, lamps] in [by_walks, by_chains, at_points] {
        // The fronts of the ground and of the roof, or points.
        let count = if lamps.len() == 12 { 12 } else { 5 };
        for ((both, sky), lamps) in both.iter().zip(&sky).zip(&lamps).take(count) {
            let error = both[1].hypot(sky[1]).hypot(lamps[1]) + 1e-9;
            assert!((both[0] - sky[0] - lamps[0]).abs() < 5.0 * error, "{both:?} {sky:?} {lamps:?}");
        }
        assert!([lamps, sky].iter().all(|known| known.iter().any(|[h, _]| *h > 10.0)));
    }
}

/// Rooms with lamps of all kinds: closed; open, with a plate that shades; and in colour, with a wall that emits.
fn rooms() -> [SceneSpec; 3] {
    let mut rng = Sequence::new(11).walk(0);
    let lamps = |rng: &mut WalkRng| (0..3).map(|kind| some_lamp(rng, kind)).collect::<Vec<_>>();
    let mut open = cube(0.4);
    open.surfaces.remove(3);
    let corner = DVec3::new(0.2, 0.3, 0.4);
    let plate = Shape::parallelogram(corner, corner + 0.5 * DVec3::X, corner + 0.4 * DVec3::Y, [1, 1]);
    open.surfaces.push(SurfaceSpec { sides: radiosity::Sides::Both, ..SurfaceSpec::new(plate, 0.6) });
    let sun = LampSpec::new(DVec3::ZERO, Emission::Distant { rim: 0.99 }, 2.0);
    let mut coloured = cube(0.5);
    coloured.surfaces[1].reflectance = radiosity::Spectrum::rgb([0.2, 0.5, 0.8]);
    coloured.surfaces[2].cell_emittance.push((1, 3.0.into()));
    coloured.surfaces[4].reflectance = 0.0.into();
    let mut of_open = lamps(&mut rng);
    of_open.push(sun.aimed(DVec3::new(-1.0, 0.1, -0.2), 0.0));
    let of_closed = lamps(&mut rng);
    let of_coloured = lamps(&mut rng);
    [(cube(0.7), of_closed), (open, of_open), (coloured, of_coloured)]
        .map(|(spec, list)| with_lamps(spec, list))
}

/// H of every face in every channel with its standard error.
fn irradiances(spec: &SceneSpec, method: impl Into<Method>, samples: u64) -> Vec<[f64; 2]> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    let experiment = Experiment::new(scene, method).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(17), 0..samples, &mut board);
    let tally = board.take().unwrap();
    let estimates = Solution::new(&experiment, &tally, 0.95).estimates;
    let known = |estimate: &Option<Estimate>| {
        let estimate = estimate.unwrap();
        [estimate.irradiance.unwrap(), estimate.irradiance_error.unwrap_or(0.0)]
    };
    estimates.iter().map(known).collect()
}

/// Chains of links and of iterations, and batches that end in a gather, find what walks find, face by face. z of 32 samples are those of
/// Student's t: none above 6 of 300 (a false alarm in 2,000).
#[test]
fn chains_and_gathers_find_the_light_of_lamps() {
    use radiosity::{
        Chains,
        methods::{BatchScore, Batches, Iterations, Sampler, Solve},
    };
    let chains = |solve| Chains { rays: 20_000, solve, linear: false, final_gather: Vec::new() };
    for (number, spec) in rooms().iter().enumerate() {
        let walks = irradiances(spec, Method::shooting(Estimator::Collision), 600_000);
        let links = irradiances(spec, chains(Solve::Links), 32);
        let iterations = irradiances(spec, chains(Solve::Iterations(Iterations::default())), 32);
        let patches = Scene::build(spec, IndexChoice::Auto).unwrap().faces().patch_count() as u32;
        let gather = Batches {
            walks: 4096,
            sampler: Sampler::Sobol,
            score: BatchScore::FinalGather((0..patches).collect()),
        };
        let gather = irradiances(spec, gather, 32);
        for (method, found) in [("links", links), ("iterations", iterations), ("gather", gather)] {
            let z: Vec<f64> =
                walks.iter().zip(&found).map(|([a, s], [b, t])| (a - b) / s.hypot(*t)).collect();
            let worst = z.iter().map(|z| z.abs()).fold(0.0, f64::max);
            let squares = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
            assert!(worst < 6.0 && (0.4..2.0).contains(&squares), "{number}, {method}: {worst} {squares}");
        }
    }
}

/// Walls that reflect next to nothing receive what black ones do, and as exactly: links are solved to the noise of B, in which their
/// own b has no part. What they reflect changes H by less than a part in a thousand.
#[test]
fn chains_know_what_comes_to_nearly_black_faces() {
    use radiosity::{Chains, methods::Solve};
    let at = |reflectance: f64| {
        let mut spec = SceneSpec::furnace(1, reflectance);
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        spec.surfaces[..2].iter_mut().for_each(|surface| surface.reflectance = 0.9.into());
        let lamp = LampSpec::new(DVec3::new(0.3, 0.3, 0.75), Emission::Uniform, 1000.0);
        let chains = Chains { rays: 2000, solve: Solve::Links, linear: false, final_gather: Vec::new() };
        irradiances(&with_lamps(spec, vec![lamp]), chains, 8)
    };
    let black = at(0.0);
    for reflectance in [1e-30, 1e-12, 1e-8, 1e-5] {
        for (black, [found, error]) in black.iter().zip(at(reflectance)) {
            assert!(
                (found / black[0] - 1.0).abs() < 1e-3,
                "{reflectance}: {found} ± {error}, black {black:?}"
            );
            assert!(error < 1.1 * black[1], "{reflectance}: {found} ± {error}, black {black:?}");
        }
    }
}

/// Shadow rays of sensors go to faces that emit as if there were no lamps: the light of both is the sum of each. A false alarm in 10,000.
#[test]
fn sensors_add_the_light_of_faces_and_of_lamps() {
    let lamp = LampSpec::new(DVec3::splat(0.5), Emission::Uniform, 1.0);
    let at = |list: Vec<LampSpec>, emittance: f64| {
        let mut spec = cube(0.0);
        spec.surfaces[2].cell_emittance.push((1, emittance.into()));
        at_points(&with_lamps(spec, list))
    };
    let [both, lamps, faces]: [Vec<[f64; 2]>; 3] =
        [at(vec![lamp.clone()], 2.0), at(vec![lamp], 0.0), at(Vec::new(), 2.0)];
    for ((both, lamp), face) in both.iter().zip(&lamps).zip(&faces) {
        let error = both[1].hypot(face[1]) + 1e-9;
        assert!((both[0] - lamp[0] - face[0]).abs() < 5.0 * error, "{both:?} {lamp:?} {face:?}");
    }
}

#[test]
fn a_point_at_a_lamp_is_refused() {
    let lamp = LampSpec::new(DVec3::new(0.3, 0.2, 0.8), Emission::Uniform, 1.0);
    let scene = Scene::build(&with_lamps(cube(0.5), vec![lamp]), IndexChoice::Auto).unwrap();
    let with_point = |x: f64| {
        let points = vec![[DVec3::new(0.7, 0.2, 0.8), DVec3::Z], [DVec3::new(x, 0.2, 0.8), DVec3::Z]];
        let desk = SensorSpec { name: "desk".into(), shape: SensorShape::Points { points, grid: [1, 2] } };
        let experiment = Experiment::new(scene.clone(), Method::shooting(Estimator::Collision)).unwrap();
        experiment.with_sensors(&[desk]).map(|_| ()).map_err(|unfit| unfit.to_string())
    };
    assert!(with_point(0.3).unwrap_err().contains("a lamp is at its point 0.3, 0.2, 0.8"));
    assert_eq!(with_point(0.31), Ok(()));
}

/// Sensors change nothing of faces, by walks and by chains, even where a lamp is in the plane of one; and that one reads, from beyond the edge of
/// its cell, what another reads that stands a millimetre from it. Readings 6 standard errors apart raise a false alarm in 10⁸.
#[test]
fn a_lamp_in_the_plane_of_a_sensor_spoils_nothing() {
    let lamp = LampSpec::new(DVec3::new(0.3, 0.2, 0.8), Emission::Uniform, 1.0);
    let scene = Scene::build(&with_lamps(cube(0.5), vec![lamp]), IndexChoice::Auto).unwrap();
    let chains = radiosity::Chains {
        rays: 20_000,
        solve: radiosity::methods::Solve::Links,
        linear: false,
        final_gather: Vec::new(),
    };
    for (method, paths) in [(Method::shooting(Estimator::Collision), 65_536), (chains.into(), 16)] {
        let at = |x: Option<f64>| {
            let sensor = |x: f64| SensorSpec {
                name: "board".into(),
                shape: SensorShape::Quad {
                    corner: DVec3::new(x, 0.5, 0.3),
                    corner_u: DVec3::new(x, 0.9, 0.3),
                    corner_v: DVec3::new(x, 0.5, 0.6),
                    cells: [1, 1],
                },
            };
            let sensors: Vec<SensorSpec> = x.map(sensor).into_iter().collect();
            let experiment =
                Experiment::new(scene.clone(), method.clone()).unwrap().with_sensors(&sensors).unwrap();
            let mut board = experiment.board();
            experiment.walk(&Sequence::new(3), 0..paths, &mut board);
            let tally = board.take().unwrap();
            let face = |face: usize| tally.patch(face, 0).to_vec();
            let faces: Vec<Vec<u128>> = (0..scene.faces().len()).map(face).collect();
            let reading = x.map(|_| {
                let reading = Readings::new(&experiment, &tally, 0.95).unwrap().cell(0)[0];
                [reading.irradiance.unwrap(), reading.std_error.unwrap()]
            });
            (faces, reading)
        };
        let [(alone, _), (level, in_plane), (beside, moved)] = [None, Some(0.3), Some(0.301)].map(at);
        assert!(alone == level && alone == beside, "sensors change what is found of faces");
        let ([a, s], [b, t]) = (in_plane.unwrap(), moved.unwrap());
        assert!(a > 0.0 && (a - b).abs() < 6.0 * s.hypot(t) + 0.01 * b, "{a} ± {s}, {b} ± {t}");
    }
}

#[test]
fn methods_that_would_miss_lamps_are_refused() {
    use radiosity::{Birth, Direction, Space, Walks, methods::Score};
    let lamp = LampSpec::new(DVec3::splat(0.5), Emission::Uniform, 1.0);
    let scene = || Scene::build(&with_lamps(cube(0.5), vec![lamp.clone()]), IndexChoice::Auto).unwrap();
    let gathering = Walks {
        direction: Direction::Gathering(Birth::Area),
        space: Space::Discrete,
        score: Score::Of(Estimator::Collision),
    };
    assert_eq!(Experiment::new(scene(), gathering).unwrap_err(), Unfit::GatheredLamps);
}
