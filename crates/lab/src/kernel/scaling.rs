//! Time per ray against patches and against surfaces: `radwalk-lab scaling docs/results`
//! writes scaling.csv and scaling.svg into the folder named. One core, whole walks; some minutes. With `draw` behind the folder it draws
//! the table that is there.

use std::fmt::Write;
use std::path::Path;

use super::{Failure, TimedWalks, collision_shooting, median};
use radiosity::{IndexChoice, Scene, SceneSpec};
use report::{Axis, Chart, ChartPoint, Style};
use scenes::{cube, cube_of_surfaces, interior};

/// The number of timings of each scene; their median counts.
const ROUNDS: usize = 5;

/// The number of rays in one timing.
const RAYS: u64 = 1_000_000;

/// The time per ray, as one number of a family of scenes grows.
struct ScalingSeries {
    name: String,
    /// The points: (that number, time per ray [ns]).
    points: Vec<(f64, f64)>,
}

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let (folder, what) = words.split_first().ok_or("usage: scaling FOLDER [draw]")?;
    let folder = Path::new(folder);
    let table = folder.join("scaling.csv");
    let series = match what.first().map(String::as_str) {
        Some("draw") => read(&std::fs::read_to_string(table)?)?,
        _ => {
            let series = measured()?;
            std::fs::write(table, csv(&series))?;
            series
        }
    };
    std::fs::write(folder.join("scaling.svg"), chart(&series).svg())?;
    Ok(())
}

fn measured() -> Result<Vec<ScalingSeries>, Failure> {
    Ok(vec![
        measure("6 surfaces, patches", &[3, 8, 32, 128, 256, 512], cube)?,
        measure("cube, surfaces of one patch", &[1, 2, 4, 16, 64, 256, 408], cube_of_surfaces)?,
        measure("interior, surfaces of one patch", &[50_000, 200_000, 500_000, 1_000_000], |n| {
            interior(n as usize)
        })?,
    ])
}

/// Times walks in a family of scenes, against the number of patches of each.
fn measure(
    name: &'static str,
    sizes: &[u32],
    family: impl Fn(u32) -> SceneSpec,
) -> Result<ScalingSeries, Failure> {
    let mut points = Vec::new();
    for &size in sizes {
        let scene = Scene::build(&family(size), IndexChoice::Auto)?;
        let patches = scene.faces().len();
        let mut walks = TimedWalks::new(collision_shooting(scene)?);
        let rates = (0..ROUNDS).map(|_| walks.rate(RAYS)).collect::<Result<Vec<f64>, Failure>>()?;
        points.push((patches as f64, 1e9 / median(&rates)));
        println!("{name}: {patches} patches, {:.1} ns per ray", 1e9 / median(&rates));
    }
    Ok(ScalingSeries { name: name.into(), points })
}

fn csv(series: &[ScalingSeries]) -> String {
    let mut text = String::from("series,patches,ns_per_ray\n");
    for one in series {
        for (patches, time) in &one.points {
            writeln!(text, "\"{}\",{patches},{time:.2}", one.name).expect("strings take all");
        }
    }
    text
}

/// The series of a table that [`csv`] has written.
fn read(table: &str) -> Result<Vec<ScalingSeries>, Failure> {
    let mut series: Vec<ScalingSeries> = Vec::new();
    for line in table.lines().skip(1) {
        let (name, numbers) = line.trim_start_matches('"').split_once("\",").ok_or("a row without a name")?;
        let (patches, time) = numbers.split_once(',').ok_or("a row without a time")?;
        if series.last().is_none_or(|last| last.name != name) {
            series.push(ScalingSeries { name: name.into(), points: Vec::new() });
        }
        series.last_mut().expect("one was pushed").points.push((patches.parse()?, time.parse()?));
    }
    Ok(series)
}

/// The chart of times, a curve for each family of scenes.
fn chart(series: &[ScalingSeries]) -> Chart {
    let curve = |one: &ScalingSeries| report::Series {
        name: one.name.clone(),
        style: Style::Joined,
        points: one.points.iter().map(|&(x, y)| ChartPoint { x, y, error: 0.0 }).collect(),
    };
    Chart {
        title: "Time per ray, whole walks, one core".into(),
        x: Axis::log("patches (6 surfaces) or surfaces"),
        y: Axis::log("ns per ray"),
        series: series.iter().map(curve).collect(),
    }
}
