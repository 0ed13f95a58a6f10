//! Time per ray against patches and against surfaces: `cargo run --release -p scenes --example scaling -- docs/results`
//! writes scaling.csv and scaling.svg into the folder named. One core, whole walks; some minutes.

mod common;

use std::fmt::Write;
use std::path::Path;

use common::{Failure, Walks, collision_shooting, median};
use plotters::prelude::*;
use radiosity::{IndexChoice, Scene, SceneSpec};
use scenes::{cube, cube_of_surfaces, interior};

/// The number of timings of each scene; their median counts.
const ROUNDS: usize = 5;

/// The number of rays in one timing.
const RAYS: u64 = 1_000_000;

/// The time per ray, as one number of a family of scenes grows.
struct Series {
    name: &'static str,
    /// The points: (that number, time per ray [ns]).
    points: Vec<(f64, f64)>,
}

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: scaling FOLDER")?;
    let folder = Path::new(&folder);
    let series = [
        measure("6 surfaces, patches", &[3, 8, 32, 128, 256, 512], cube)?,
        measure("cube, surfaces of one patch", &[1, 2, 4, 16, 64, 256, 408], cube_of_surfaces)?,
        measure("interior, surfaces of one patch", &[50_000, 200_000, 500_000, 1_000_000], |n| {
            interior(n as usize)
        })?,
    ];
    std::fs::write(folder.join("scaling.csv"), csv(&series))?;
    draw(&folder.join("scaling.svg"), &series)?;
    Ok(())
}

/// Times walks in a family of scenes, against the number of patches of each.
fn measure(name: &'static str, sizes: &[u32], family: impl Fn(u32) -> SceneSpec) -> Result<Series, Failure> {
    let mut points = Vec::new();
    for &size in sizes {
        let scene = Scene::build(&family(size), IndexChoice::Auto)?;
        let patches = scene.faces().len();
        let mut walks = Walks::new(collision_shooting(scene)?);
        let rates = (0..ROUNDS).map(|_| walks.rate(RAYS)).collect::<Result<Vec<f64>, Failure>>()?;
        points.push((patches as f64, 1e9 / median(&rates)));
        println!("{name}: {patches} patches, {:.1} ns per ray", 1e9 / median(&rates));
    }
    Ok(Series { name, points })
}

fn csv(series: &[Series]) -> String {
    let mut text = String::from("series,patches,ns_per_ray\n");
    for one in series {
        for (patches, time) in &one.points {
            writeln!(text, "\"{}\",{patches},{time:.2}", one.name).expect("strings take all");
        }
    }
    text
}

fn draw(path: &Path, series: &[Series]) -> Result<(), Failure> {
    let area = SVGBackend::new(path, (800, 500)).into_drawing_area();
    area.fill(&WHITE)?;
    let most = series.iter().flat_map(|one| &one.points).fold(0.0, |most: f64, point| most.max(point.1));
    let mut chart = ChartBuilder::on(&area)
        .caption("Time per ray, whole walks, one core", ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d((5.0..3e6).log_scale(), (5.0..3.0 * most).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("patches (6 surfaces) or surfaces")
        .y_desc("ns per ray")
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.0}"))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for (one, colour) in series.iter().zip([BLUE, RED, GREEN]) {
        chart
            .draw_series(LineSeries::new(one.points.clone(), colour.stroke_width(2)).point_size(3))?
            .label(one.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE)
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
