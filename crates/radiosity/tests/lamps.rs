//! Lamps without area: births by the distribution, direct light at points, and both by closed forms.

use std::f64::consts::PI;

use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Emission, Estimator, Experiment, IndexChoice, LampSpec, LampsSpec, Method, Scene, SceneSpec, Sequence,
    WalkRng,
};
use stats::mean_squared_z;

/// A table without symmetry: intensities differ between all planes.
fn table() -> Distribution {
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
    SceneSpec { lamps: LampsSpec { tables: vec![table()], list }, ..spec }
}

fn uniform(rng: &mut WalkRng) -> f64 {
    rng.pair()[0]
}

fn direction(rng: &mut WalkRng) -> DVec3 {
    let z = 2.0 * uniform(rng) - 1.0;
    let (sin, cos) = (2.0 * PI * uniform(rng)).sin_cos();
    DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
}

/// A lamp of some kind within the cube, or far away from it.
fn some_lamp(rng: &mut WalkRng, kind: usize) -> LampSpec {
    let position = DVec3::from_array(std::array::from_fn(|_| 0.15 + 0.7 * uniform(rng)));
    let emission = match kind % 4 {
        0 => Emission::Uniform,
        1 => Emission::Spot { inner: 0.9, outer: 0.9 - 1.5 * uniform(rng) },
        2 => Emission::Table(0),
        _ => Emission::Distant { rim: 1.0 },
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
        Emission::Distant { .. } => return (strength * normal.dot(z)).max(0.0),
    };
    strength * intensity * (-away.normalize().dot(normal)).max(0.0) / away.length_squared()
}

/// The inverse square law and the cosine law on 200 random lamps of all kinds: H of 24 black patches by births, against 24 × 24
/// midpoints of each. Mean squares of z are within 4 of their standard errors of 1 (a false alarm in 16,000), and no z exceeds 5.5.
#[test]
fn births_light_patches_by_the_inverse_square_law() {
    const POINTS: u32 = 24;
    let mut rng = Sequence::new(3).walk(0);
    let mut z = Vec::new();
    for number in 0..200 {
        let lamp = some_lamp(&mut rng, number);
        let is_distant = matches!(lamp.emission, Emission::Distant { .. });
        let mut spec = cube(0.0);
        if is_distant {
            // Light from outside comes in through the side that is left open.
            let open = (0..6).find(|&side| {
                let (_, u, v) = spec.surfaces[side].shape.edges();
                lamp.axes[2].dot(u.cross(v)) < -0.6
            });
            spec.surfaces.remove(open.unwrap_or(5));
        }
        let scene = Scene::build(&with_lamps(spec, vec![lamp.clone()]), IndexChoice::Auto).unwrap();
        let power = scene.total_power(0);
        let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
        let solution = experiment.run(number as u64, 20_000).unwrap();
        let scene = experiment.scene();
        for (face, estimate) in solution.estimates.iter().enumerate() {
            let corners = scene.faces().piece_corners(face as u32);
            let origin = scene.origin();
            let (a, u, v) = (corners[0] + origin, corners[1] - corners[0], corners[3] - corners[0]);
            let normal = u.cross(v).normalize();
            let places = (0..POINTS * POINTS)
                .map(|i| [i / POINTS, i % POINTS].map(|i| (f64::from(i) + 0.5) / f64::from(POINTS)));
            let light: f64 = places.map(|[s, t]| by_formula(&lamp, a + u * s + v * t, normal)).sum();
            let light = light / f64::from(POINTS * POINTS);
            if is_distant || light <= 0.0 {
                continue;
            }
            // Whole hits: a binomial number.
            let part = light * scene.faces().get(face).area / power;
            let error = (power / scene.faces().get(face).area) * (part * (1.0 - part) / 20_000.0).sqrt();
            if part * 20_000.0 > 20.0 {
                z.push((estimate.as_ref().unwrap().irradiance.unwrap() - light) / error);
            }
        }
    }
    assert!(z.len() > 2000, "{} patches", z.len());
    assert!(z.iter().all(|z| z.abs() < 5.5), "{:?}", z.iter().map(|z| z.abs()).fold(0.0, f64::max));
    let squares = mean_squared_z(z).unwrap();
    assert!(squares.z(1.0).abs() < 4.0, "{squares:?}");
}
