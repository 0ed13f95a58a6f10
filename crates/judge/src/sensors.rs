//! Warnings about badly placed sensors, in words.

use radiosity::{Experiment, sensors::SensorView};
use report::words::percent;

/// The number of rays that each sensor sends out to look round.
const RAYS: u32 = 1 << 10;

/// The part of backs among the surfaces that a sensor sees above which it lies behind or inside a wall.
const TOO_MANY: f64 = 0.5;

/// The warnings about an experiment's sensors: those behind walls or inside them, and those that face away from the
/// scene and its lamps.
pub fn sensor_warnings(experiment: &Experiment) -> Vec<String> {
    let specs = experiment.sensors().map_or(&[][..], |sensors| sensors.specs());
    let warning = |(number, name): (usize, &str)| {
        let SensorView { active, backs, nothing } = experiment.sensor_view(number, RAYS);
        let part = f64::from(backs) / f64::from((active + backs).max(1));
        if part > TOO_MANY {
            return Some(format!(
                "sensor {name:?}: {} of the surfaces that it faces are backs of one-sided ones, which reflect and emit nothing: it lies behind a wall or inside one, or faces into one; move it, turn it round, or write sides = 2 there",
                percent(part)
            ));
        }
        (active == 0 && nothing > 0 && !experiment.is_lit_by_lamps(number)).then(|| {
            format!("sensor {name:?}: it faces away from the scene and will read 0; turn it round or move it")
        })
    };
    specs.iter().enumerate().filter_map(|(number, spec)| warning((number, &spec.name))).collect()
}

#[cfg(test)]
mod tests {
    use radiosity::{
        EstimatorKind, IndexChoice, Method, Scene, SceneSpec,
        sensors::{SensorShape, SensorSpec},
    };

    use super::*;

    #[test]
    fn sensors_behind_walls_and_without_a_view_are_reported() {
        let mut open = SceneSpec::furnace(1, 0.5);
        open.surfaces.truncate(5);
        let scene = Scene::build(&open, IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision)).unwrap();
        let point = |name: &str, point: [f64; 3], normal: [f64; 3]| SensorSpec {
            name: name.into(),
            shape: SensorShape::Point { point: point.into(), normal: normal.into() },
        };
        let sensors = [
            point("inside", [0.5; 3], [0.0, 0.0, -1.0]),
            point("on a wall", [0.0, 0.5, 0.5], [1.0, 0.0, 0.0]),
            point("in a wall", [0.0, 0.5, 0.5], [-1.0, 0.0, 0.0]),
            point("below", [0.5, 0.5, -1.0], [0.0, 0.0, 1.0]),
        ];
        let found = sensor_warnings(&experiment.with_sensors(&sensors).unwrap());
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("sensor \"in a wall\": it faces away"), "{found:?}");
        assert!(
            found[1].starts_with("sensor \"below\": ") && found[1].contains("behind a wall"),
            "{found:?}"
        );
    }
}
