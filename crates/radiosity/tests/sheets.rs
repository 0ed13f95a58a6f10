//! Sheets that transmit diffusely, against closed forms.

use glam::DVec3;
use radiosity::{
    Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Spectrum, SurfaceSpec,
    Unfit,
    daylight::{Coefficients, SkyPatches, SkyTally},
    sensors::{SensorShape, SensorSpec},
};

/// A sheet so wide that no walk of these tests passes its edge, but for one in 10¹².
fn sheet(z: f64, reflectance: f64, transmittance: f64) -> SurfaceSpec {
    let side = 1e7;
    let corner = DVec3::new(-side, -side, z);
    let shape = Shape::parallelogram(corner, 2.0 * side * DVec3::X, 2.0 * side * DVec3::Y, [1, 1]);
    SurfaceSpec::new(shape, reflectance).emitting(1.0).transmitting(transmittance)
}

/// What becomes of a million walks of a sensor that faces up, below sheets.
fn walked(sheets: Vec<SurfaceSpec>) -> (SkyTally, SkyPatches) {
    let scene = Scene::build(&SceneSpec::new(sheets), IndexChoice::Auto).unwrap();
    let shape = SensorShape::Point { point: DVec3::ZERO, normal: DVec3::Z };
    let sky = SkyPatches::new(145).unwrap();
    let sensors = [SensorSpec { name: "s".into(), shape }];
    let coefficients = Coefficients::new(scene, &sensors, sky.clone()).unwrap();
    let mut tally = SkyTally::new(145);
    coefficients.walk(&Sequence::new(3), 0, 0..WALKS, &mut tally);
    (tally, sky)
}

const WALKS: u64 = 1_000_000;

/// How far a count is from what is expected, in standard errors.
fn deviation(count: u64, probability: f64) -> f64 {
    let expected = WALKS as f64 * probability;
    (count as f64 - expected) / (expected * (1.0 - probability)).sqrt()
}

/// Of the walks below a sheet T go on to the sky, by the horizontal factors of its patches whatever way they came, and R go back below the horizon. False
/// alarms: one in 5,000.
#[test]
fn a_sheet_passes_its_part_on_diffusely() {
    let (tally, sky) = walked(vec![sheet(1.0, 0.25, 0.4)]);
    assert_eq!((tally.straight.iter().sum::<u64>(), tally.backs), (0, 0));
    let to_sky: u64 = tally.reflected[1..].iter().sum();
    let z = [deviation(to_sky, 0.4), deviation(tally.reflected[0], 0.25)];
    assert!(z.iter().all(|z| z.abs() < 4.0), "{z:?}");
    let chi: f64 = tally.reflected[1..]
        .iter()
        .zip(sky.horizontal_factors())
        .map(|(&n, factor)| (n as f64 - to_sky as f64 * factor).powi(2) / (to_sky as f64 * factor))
        .sum();
    assert!(((chi - 144.0) / 288.0_f64.sqrt()).abs() < 4.0, "{chi}");
}

/// Between two sheets light goes to and fro: T₁T₂/(1 − R₁R₂) of the walks come through both, R₁ + T₁²R₂/(1 − R₁R₂) come back (G. G. Stokes's
/// pile of plates, 1862). With R + T near 1, half of the walks have many reflections. False alarms: one in 4,000.
#[test]
fn two_sheets_are_a_pile_of_plates() {
    for [r1, t1, r2, t2] in
        [[0.3, 0.5, 0.6, 0.2], [0.5, 0.49, 0.5, 0.49], [0.0, 0.9, 0.0, 0.9], [0.0, 0.0, 0.5, 0.4]]
    {
        let (tally, _) = walked(vec![sheet(1.0, r1, t1), sheet(2.0, r2, t2)]);
        let between = 1.0 / (1.0 - r1 * r2);
        let [through, back] = [t1 * t2 * between, r1 + t1 * t1 * r2 * between];
        let counts = [tally.reflected[1..].iter().sum(), tally.reflected[0]];
        for (count, part) in counts.into_iter().zip([through, back]) {
            let z = if part > 0.0 { deviation(count, part) } else { count as f64 };
            assert!(z.abs() < 4.0, "{r1} {t1} {r2} {t2}: {count} of {part}");
        }
    }
}

/// A sensor does not see the sun through a sheet: what comes from there comes diffusely.
#[test]
fn a_sheet_has_no_straight_light() {
    let scene = Scene::build(&SceneSpec::new(vec![sheet(1.0, 0.1, 0.8)]), IndexChoice::Auto).unwrap();
    let shape = SensorShape::Point { point: DVec3::ZERO, normal: DVec3::Z };
    let sensors = [SensorSpec { name: "s".into(), shape }];
    let coefficients = Coefficients::new(scene, &sensors, SkyPatches::new(145).unwrap()).unwrap();
    assert_eq!(coefficients.receives(0, DVec3::new(0.6, 0.0, 0.8).to_array()), 0.0);
}

/// Methods that would lose light refuse it, and so does a scene of impossible sheets, in words.
#[test]
fn what_sheets_cannot_be_is_refused() {
    let scene = Scene::build(&SceneSpec::new(vec![sheet(1.0, 0.1, 0.8)]), IndexChoice::Auto).unwrap();
    assert!(scene.transmits());
    let refused = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap_err();
    assert_eq!(refused, Unfit::Transmission);
    let refused = |surfaces: Vec<SurfaceSpec>, said: &str| {
        let error = Scene::build(&SceneSpec::new(surfaces), IndexChoice::Auto).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    };
    refused(vec![sheet(1.0, 0.5, 0.5)], "add up to 1");
    refused(vec![sheet(1.0, 0.5, -0.1)], "outside [0, 1)");
    refused(vec![SurfaceSpec { sides: radiosity::Sides::Front, ..sheet(1.0, 0.5, 0.1) }], "sides = 2");
    refused(vec![sheet(1.0, 0.5, 0.1), sheet(1.0, 0.5, 0.0)], "overlaps with another");
    let hash = |transmittance: f64| {
        let spec = SceneSpec::new(vec![sheet(1.0, 0.2, transmittance)]);
        Scene::build(&spec, IndexChoice::Auto).unwrap().hash()
    };
    assert_ne!(hash(0.1), hash(0.2));
    let coloured = sheet(1.0, 0.2, 0.0).transmitting(Spectrum::rgb([0.1, 0.2, 0.3]));
    let spec = SceneSpec::new(vec![coloured]);
    assert_eq!((spec.channels(), spec.channel(1).channels()), (3, 1));
    assert_eq!(spec.channel(1).surfaces[0].transmittance, 0.2.into());
}
