//! Sh91 §4: the variance at a given number of rays per zone does not depend on the number of zones.

use exact::Exact;
use radiosity::{Direction, Estimates, EstimatorKind};
use report::{Axis, Chart, Picture, Series, Style};
use stats::Measured;

use crate::arithmetic::{counted, quotient};
use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{experiment, method};
use crate::series::point;
use crate::walking::TallyReader;

/// The chapter of Sh91 §4.
pub(crate) const CHAPTER: Chapter =
    Chapter { name: "sh91", title: "Sh91 §4: variance in the closed cube, and the image grid", run };

/// The result of `experiment`s in a cube.
struct CubeResult {
    zones: u64,
    per_zone: u64,
    runs: usize,
    /// The variance times the walks per zone.
    variance: Measured,
}

fn run(lab: &Lab) -> Findings {
    let edges: &[u32] = lab.pick(&[8, 16, 32], &[16, 32, 64, 128, 256, 512]);
    let per_zone: &[u64] = lab.pick(&[4, 16], &[4, 16, 64, 256]);
    // The zones over all runs: at twice its standard error, their scatter hides 1.6 % (quick) or 1 % of the variance.
    let pool = lab.pick(1 << 15, 60 * 1536);
    let cells: Vec<CubeResult> = edges
        .iter()
        .flat_map(|&n| per_zone.iter().map(move |&r| (n, r)))
        .map(|(n, r)| measure(lab, n, r, pool))
        .collect();
    let zone_returns = returns_to_zones();
    let mut rows: Vec<Claim> = cells.iter().map(|cell| row(cell, zone_returns)).collect();
    rows.push(constancy(&cells));
    let (noise, picture) = rooms(lab);
    rows.extend(noise);
    Findings {
        published: "A cube with L_e = 0.5, R = 0.5 (so L = 1), N = 1,536 … 1,572,864 zones: \"the computational variance \
                    of the estimate remained within 2 % of constant\" for r = 4N, 16N, 64N, 256N. Rooms of 256, 1,024 and \
                    4,096 zones with 4, 16, 64 and 256 rays per zone: each column looks alike."
            .into(),
        experiment: format!(
            "r walks from the emitters (discrete, collision; each takes 2 rays on average), enough runs that {pool} zones \
             at least are seen (a single run of 1,536 scatters by 3.6 %). Variance: the mean of \
             (L − 1)² over all zones and runs, here times r/N. Theory: (1 + 2Rξ)/8 − N⁻¹/4, ξ in proportion to 1/N, from the exact \
             solution of 384 zones."
        ),
        rows,
        remarks: vec![
            "His claim holds, more sharply than he could see: the variance is that of the closed form for any number \
             of zones. In the rooms rays per zone decide how noisy a picture is, zones only how finely it is cut."
                .into(),
        ],
        figures: vec![figure(&cells), picture],
    }
}

/// ξ·N: the power that a zone gets back of one unit that it sends out, on average, times the number of zones.
fn returns_to_zones() -> f64 {
    let exact = Exact::of_scene(&scenes::furnace(8, 0.5)).expect("a closed box");
    exact.xi().iter().sum()
}

/// The variance of one walk over the zones, E = R = ½: b[RΦ_T/A·(1 + 2Rξ) − b].
fn theory(zones: f64, zone_returns: f64) -> f64 {
    let xi = zone_returns / zones;
    0.5 * (0.25 * zones * (1.0 + xi) - 0.5) / zones
}

fn measure(lab: &Lab, n: u32, per_zone: u64, pool: usize) -> CubeResult {
    let zones = 6 * u64::from(n) * u64::from(n);
    let experiment =
        experiment(&scenes::furnace(n, 0.5), method(Direction::Shooting, EstimatorKind::Collision));
    let reader = TallyReader::new(&experiment);
    let walks = per_zone * zones;
    let runs = pool.div_ceil(zones as usize);
    let mean_square = |tally: &radiosity::Tally| {
        let squares = reader.reflected(tally).into_iter().map(|b| (b - 0.5).powi(2));
        per_zone as f64 * squares.sum::<f64>() / zones as f64
    };
    let seed = 500 + per_zone;
    // One large run is split among threads; many small ones are dealt out.
    let found = match runs {
        1 => vec![mean_square(&lab.tally(&experiment, seed, walks))],
        _ => lab.runs(&experiment, seed, runs, walks, mean_square),
    };
    let value = found.iter().sum::<f64>() / runs as f64;
    // A zone is hit 2·per_zone times on average, nearly with a Poisson distribution: a squared error scatters by
    // √(2 + 1/hits).
    let relative = ((2.0 + 0.5 / per_zone as f64) / (runs as f64 * zones as f64)).sqrt();
    CubeResult { zones, per_zone, runs, variance: Measured { value, standard_error: relative * value } }
}

fn row(cell: &CubeResult, zone_returns: f64) -> Claim {
    let runs = if cell.runs == 1 { "1 run".into() } else { format!("{} runs", cell.runs) };
    let label = format!("cube, N = {}, r = {}N: variance × r/N ({runs})", cell.zones, cell.per_zone);
    Claim::of(label, cell.variance, ClaimBound::Is(theory(cell.zones as f64, zone_returns)))
}

/// The claim of constancy within 2 %, as in the paper.
fn constancy(cells: &[CubeResult]) -> Claim {
    let values = || cells.iter().map(|cell| cell.variance);
    let largest = values().max_by(|a, b| a.value.total_cmp(&b.value)).expect("some cells");
    let smallest = values().min_by(|a, b| a.value.total_cmp(&b.value)).expect("some cells");
    let spread = quotient(largest, smallest);
    let label = format!("cube: largest over smallest of these {}", cells.len());
    Claim::of(label, spread, ClaimBound::AtMost(1.02)).published(1.02)
}

fn figure(cells: &[CubeResult]) -> Drawing {
    let mut ratios: Vec<u64> = cells.iter().map(|cell| cell.per_zone).collect();
    ratios.sort_unstable();
    ratios.dedup();
    let of = |ratio: &u64| {
        // Marks are placed side by side, or they would hide each other.
        let shift = 1.0 + 0.04 * (ratio.ilog2() as f64 - 5.0);
        let mine = cells.iter().filter(|cell| cell.per_zone == *ratio);
        Series {
            name: format!("r = {ratio}N"),
            style: Style::Marks,
            points: mine.map(|cell| point(cell.zones as f64 * shift, cell.variance)).collect(),
        }
    };
    let ends = [cells[0].zones as f64 / 1.2, cells[cells.len() - 1].zones as f64 * 1.2];
    let level = |name: &str, y: f64| Series {
        name: name.into(),
        style: Style::Line,
        points: ends.map(|x| point(x, counted(y))).into(),
    };
    let levels = [level("theory: 1/8", 0.125), level("2 % more", 0.1275), level("2 % less", 0.1225)];
    let chart = Chart {
        title: "Sh91: variance × rays per zone in the closed cube".into(),
        x: Axis::log("zones N"),
        y: Axis::linear("variance × r/N"),
        series: levels.into_iter().chain(ratios.iter().map(of)).collect(),
    };
    Drawing::chart("sh91-cube.svg", "Sh91 §4: the variance is constant", &chart)
}

/// The pictures of Sh91 fig 1: rows of zones, columns of rays per zone; and the noise of each picture.
fn rooms(lab: &Lab) -> (Vec<Claim>, Drawing) {
    let (rows, columns) = ([4_u32, 8, 16], [4_u64, 16, 64, 256]);
    let mut noise = Vec::new();
    let mut pictures = Vec::new();
    for cells in rows {
        let spec = scenes::room(cells);
        let experiment = experiment(&spec, method(Direction::Shooting, EstimatorKind::Collision));
        let zones = experiment.scene().faces().len() as u64;
        let sample = lab.tally(&experiment, 598, 20_000).counts;
        for per_zone in columns {
            let rays = per_zone * zones;
            let walks = (rays as f64 * sample.walks as f64 / sample.rays as f64).round() as u64;
            let tally = lab.tally(&experiment, 599, walks);
            let estimates = Estimates::new(&experiment, &tally, 0.95);
            let patches: Vec<_> = estimates.known().map(|(_, patch, b)| (patch, b[0])).collect();
            let area: f64 = patches.iter().map(|(patch, _)| patch.area).sum();
            let variance = patches.iter().map(|(patch, b)| patch.area * b.std_error.unwrap_or(0.0).powi(2));
            noise.push((zones, per_zone, variance.sum::<f64>() / area));
            let shown: Vec<f64> = patches.iter().map(|(_, b)| b.radiosity).collect();
            pictures.push(Picture::render(experiment.scene(), &shown));
        }
    }
    let coarse = |per_zone: u64| noise.iter().find(|(_, r, _)| *r == per_zone).map_or(f64::NAN, |n| n.2);
    let compared =
        noise.iter().filter(|(zones, ..)| *zones > noise[0].0).map(|&(zones, per_zone, variance)| {
            let label = format!(
                "rooms, {per_zone} rays a zone: variance with {zones} zones over that with {}",
                noise[0].0
            );
            Claim::of(label, counted(variance / coarse(per_zone)), ClaimBound::About(1.0))
        });
    let rows_of_table = compared.collect();
    let figure = Drawing {
        file: "sh91-rooms.png".into(),
        caption: "Sh91 fig 1: 256, 1,024, 4,096 zones downwards; 4, 16, 64, 256 rays a zone to the right"
            .into(),
        content: tiled(&pictures, columns.len()),
    };
    (rows_of_table, figure)
}

/// A grid of pictures, each at half its width and height.
fn tiled(pictures: &[Picture], columns: usize) -> Vec<u8> {
    let (width, height) = (pictures[0].width as usize / 2, pictures[0].height as usize / 2);
    let rows = pictures.len() / columns;
    let shade = |x: usize, y: usize| {
        let picture = &pictures[y / height * columns + x / width];
        let (i, j, stride) = (2 * (x % width), 2 * (y % height), picture.width as usize);
        let sum =
            [0, 1, stride, stride + 1].into_iter().map(|k| u32::from(picture.pixels[j * stride + i + k]));
        (sum.sum::<u32>() / 4) as u8
    };
    let pixels = (0..rows * height).flat_map(|y| (0..columns * width).map(move |x| (x, y)));
    let whole = Picture {
        width: (columns * width) as u32,
        height: (rows * height) as u32,
        channels: 1,
        pixels: pixels.map(|(x, y)| shade(x, y)).collect(),
    };
    let mut png = Vec::new();
    whole.write_png(&mut png).expect("memory takes all");
    png
}

#[cfg(test)]
mod tests {

    use super::*;

    /// The closed form in full, zone by zone.
    #[test]
    fn theory_is_that_of_the_exact_solution() {
        let exact = Exact::of_scene(&scenes::furnace(8, 0.5)).unwrap();
        let variances = exact.shooting_variances(EstimatorKind::Collision);
        let mean = variances.iter().sum::<f64>() / 384.0 / 384.0;
        assert!((theory(384.0, returns_to_zones()) / mean - 1.0).abs() < 1e-9);
    }
}
