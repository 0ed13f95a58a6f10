//! What chosen patches save: walks and processor time to the same total error, against the best uniform grid of constants.
//!
//! `cargo run --release -p results --example patches -- [millions of walks of a reference] [scene]`
//!
//! The truth is a much finer solution of linear fits, from two references of independent walks: the product of the differences
//! from both has no bias. Uniform grids have square cells of one size; the best of them is found by search. Of each grid one run
//! tells noise and discretisation, so that its error is known for any number of walks.

use std::error::Error;
use std::fs;

use glam::DVec3;
use job::{Cut, Forecast, Partition};
use judge::MOMENTS;
use radiosity::{
    Direction, Estimator, EstimatorKind, Experiment, Fit, IndexChoice, Scene, SceneSpec, Score, Sequence,
    Shape, Side, Sides, Space, SurfaceSpec, Tally, Walks,
};
use results::choose;
use rustix::time::{ClockId, clock_gettime};

type Failure = Box<dyn Error>;

/// Cells of a reference, about.
const FINE: f64 = 60_000.0;

/// Walks by which uniform grids are measured.
const MEASURED: u64 = 1 << 21;

/// Seeds over which the error of chosen patches is taken.
const SEEDS: u64 = 4;

fn main() -> Result<(), Failure> {
    let mut args = std::env::args().skip(1);
    let millions: u64 = args.next().map_or(Ok(20), |text| text.parse())?;
    let only = args.next();
    println!("| scene | paths | chosen | error | foretold | constants: paths | time | linear: paths |");
    println!("|---|---|---|---|---|---|---|---|");
    for (name, spec, fine) in rooms() {
        if only.as_ref().is_none_or(|only| only == name) {
            Room::new(spec, fine, millions * 1_000_000)?.compare(name)?;
        }
    }
    Ok(())
}

/// A scene with its truth.
struct Room {
    spec: SceneSpec,
    fine: Vec<Cut>,
    /// The fits of two references, by surface, side and cell.
    truth: [Vec<Fit>; 2],
    /// ∫b² over all faces.
    energy: f64,
}

/// The errors of a run: of means and of linear fits, their whole energy, and the part of it that is noise.
#[derive(Clone, Copy)]
struct Errors {
    whole: [f64; 2],
    noise: [f64; 2],
}

impl Room {
    fn new(spec: SceneSpec, cells: f64, walks: u64) -> Result<Self, Failure> {
        let fine = cut_all(&spec, cells);
        let experiment = experiment(&spec, &fine, true)?;
        let mut truth = [Vec::new(), Vec::new()];
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..2_u64)
                .map(|seed| {
                    let experiment = &experiment;
                    scope.spawn(move || fits(experiment, &walk(experiment, (1 << 40) | seed, walks)))
                })
                .collect();
            for (truth, thread) in truth.iter_mut().zip(threads) {
                *truth = thread.join().expect("walks do not panic");
            }
        });
        let mut room = Room { spec, fine, truth, energy: 0.0 };
        let mut energy = 0.0;
        room.each_cell(&mut |area, _, index| {
            energy += area * room.truth[0][index].mean * room.truth[1][index].mean;
        });
        room.energy = energy;
        Ok(room)
    }

    /// Calls with the area of every cell of the reference, its surface and side with its centre there, and its number.
    fn each_cell(&self, visit: &mut dyn FnMut(f64, (usize, Side, [f64; 2]), usize)) {
        let mut index = 0;
        for (number, surface) in self.spec.surfaces.iter().enumerate() {
            let [nu, nv] = grid(self.fine[number]);
            let area = surface.shape.area() / f64::from(nu * nv);
            let both = [Side::Front, Side::Back];
            let sides = if surface.sides == Sides::Both { &both[..] } else { &both[..1] };
            for &side in sides {
                for cell in 0..nu * nv {
                    let middle = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
                    visit(area, (number, side, [middle(cell / nv, nu), middle(cell % nv, nv)]), index);
                    index += 1;
                }
            }
        }
    }

    /// The errors of a run on a grid.
    fn errors(&self, cuts: &[Cut], experiment: &Experiment, tally: &Tally) -> Errors {
        let faces = experiment.scene().faces();
        let mut errors = Errors { whole: [0.0; 2], noise: [0.0; 2] };
        let fits: Vec<Fit> = (0..faces.len())
            .map(|face| experiment.fit(tally, face, 0).expect("walks that are shot"))
            .collect();
        for (face, fit) in fits.iter().enumerate() {
            let area = faces.get(face).area;
            errors.noise[0] += area * fit.mean_variance;
            errors.noise[1] += area * (fit.mean_variance + fit.slope_variance);
        }
        self.each_cell(&mut |area, (surface, side, [u, v]), index| {
            let [nu, nv] = grid(cuts[surface]);
            let [x, y] = [u * f64::from(nu), v * f64::from(nv)];
            let first = faces.first_piece_on(surface as u32, side).expect("an active side");
            let fit = &fits[(first + x as u32 * nv + y as u32) as usize];
            let slope = fit.gradient[0] * (x.fract() - 0.5) + fit.gradient[1] * (y.fract() - 0.5);
            for (whole, value) in errors.whole.iter_mut().zip([fit.mean, fit.mean + slope]) {
                let [a, b] = [0, 1].map(|seed: usize| value - self.truth[seed][index].mean);
                *whole += area * a * b;
            }
        });
        errors
    }

    fn compare(&self, name: &str) -> Result<(), Failure> {
        let grids = self.uniform()?;
        for paths in [100_000, 1_000_000, 10_000_000] {
            let chosen = self.chosen(paths)?;
            let reach = |basis: usize| {
                let walks = grids.iter().filter_map(|grid| grid.reach(basis, chosen.error));
                walks.min_by(|a, b| a.1.total_cmp(&b.1))
            };
            let told = |reached: Option<(f64, f64, usize)>| match reached {
                Some((walks, seconds, patches)) => [
                    format!("{:.1} ({patches})", walks / paths as f64),
                    format!("{:.1}", seconds / chosen.seconds),
                ],
                None => ["out of reach".into(), "out of reach".into()],
            };
            let ([constants, time], [linear, _]) = (told(reach(0)), told(reach(1)));
            let percent = |energy: f64| 100.0 * (energy / self.energy).sqrt();
            println!(
                "| {name} | {paths} | {} {} | {:.2} % | {:.2} % | {constants} | {time} | {linear} |",
                chosen.patches,
                if chosen.forecast.linear { "linear" } else { "constant" },
                percent(chosen.error),
                100.0 * chosen.forecast.total(),
            );
        }
        Ok(())
    }

    /// The uniform grids, from the coarsest on.
    fn uniform(&self) -> Result<Vec<Grid>, Failure> {
        let mut grids: Vec<Grid> = Vec::new();
        let mut cells = self.spec.surfaces.len() as f64 / 2.0;
        while cells < FINE / 3.0 {
            let cuts = cut_all(&self.spec, cells);
            cells *= 1.7;
            if grids.last().is_some_and(|grid| grid.cuts == cuts) {
                continue;
            }
            let linear = experiment(&self.spec, &cuts, true)?;
            let began = seconds();
            let tally = walk(&linear, 7, MEASURED);
            let of_linear = (seconds() - began) / MEASURED as f64;
            let constant = experiment(&self.spec, &cuts, false)?;
            let began = seconds();
            walk(&constant, 7, MEASURED / 4);
            let of_constant = (seconds() - began) / (MEASURED / 4) as f64;
            let errors = self.errors(&cuts, &linear, &tally);
            let patches = linear.scene().faces().len();
            grids.push(Grid { cuts, patches, errors, seconds: [of_constant, of_linear] });
        }
        Ok(grids)
    }

    /// The mean error of what is chosen.
    fn chosen(&self, paths: u64) -> Result<Chosen, Failure> {
        let folder = tempfile::tempdir()?;
        fs::write(folder.path().join("scene.toml"), scenes::to_toml(&self.spec))?;
        let text = format!("[scene]\nfile = \"scene.toml\"\npatches = \"auto\"\n[budget]\npaths = {paths}\n");
        let path = folder.path().join("job.toml");
        fs::write(&path, text)?;
        let mut told = None;
        for seed in 0..SEEDS {
            let job = job::load(&path, &[format!("seed={seed}")])?;
            let began = seconds();
            let Partition { cuts, forecast, .. } = choose(&job, 1)?.ok_or("nothing is open")?;
            let forecast = forecast.ok_or("a pilot foretells")?;
            let pilot = seconds() - began;
            let scored = experiment(&self.spec, &cuts, forecast.linear)?;
            let began = seconds();
            let tally = walk(&scored, seed, paths);
            let run = seconds() - began;
            // The means of a job of constants are those of a linear one, to the last bit.
            let (scored, tally) = match forecast.linear {
                true => (scored, tally),
                false => {
                    let linear = experiment(&self.spec, &cuts, true)?;
                    let tally = walk(&linear, seed, paths);
                    (linear, tally)
                }
            };
            let error = self.errors(&cuts, &scored, &tally).whole[usize::from(forecast.linear)];
            let patches = scored.scene().faces().len();
            if std::env::var_os("CUTS").is_some() {
                eprintln!("{paths} {patches} {cuts:?} pilot {pilot:.3} s, run {run:.3} s");
            }
            let chosen = told.get_or_insert(Chosen { error: 0.0, seconds: 0.0, patches, forecast });
            chosen.error += error / SEEDS as f64;
            chosen.seconds += (pilot + run) / SEEDS as f64;
        }
        told.ok_or_else(|| "no seed".into())
    }
}

/// What was chosen for a number of walks.
struct Chosen {
    error: f64,
    seconds: f64,
    patches: usize,
    forecast: Forecast,
}

/// A uniform grid and what its runs come to.
struct Grid {
    cuts: Vec<Cut>,
    patches: usize,
    errors: Errors,
    /// Processor time of a walk, of constants and of linear fits [s].
    seconds: [f64; 2],
}

impl Grid {
    /// Walks, processor time and patches by which its error falls to this; `None` where discretisation alone is above it.
    fn reach(&self, basis: usize, error: f64) -> Option<(f64, f64, usize)> {
        let Errors { whole, noise } = self.errors;
        let lost = (whole[basis] - noise[basis]).max(0.0);
        let walks = noise[basis] * MEASURED as f64 / (error - lost);
        (lost < error).then_some((walks, walks * self.seconds[basis], self.patches))
    }
}

fn grid(cut: Cut) -> [u32; 2] {
    match cut {
        Cut::Grid(cells) => cells,
        Cut::Rows(_) => unreachable!("rooms are of quads"),
    }
}

/// Square cells of one size, about this many.
fn cut_all(spec: &SceneSpec, cells: f64) -> Vec<Cut> {
    let area: f64 = spec.surfaces.iter().map(|surface| surface.shape.area()).sum();
    let size = (area / cells).sqrt();
    let along = |edge: DVec3| (edge.length() / size).round().max(1.0) as u32;
    let cut = |surface: &SurfaceSpec| {
        let (_, u, v) = surface.shape.edges();
        Cut::Grid([along(u), along(v)])
    };
    spec.surfaces.iter().map(cut).collect()
}

fn experiment(spec: &SceneSpec, cuts: &[Cut], linear: bool) -> Result<Experiment, Failure> {
    let mut spec = spec.clone();
    let fits = spec.surfaces.iter_mut().zip(cuts).all(|(surface, cut)| cut.apply(surface));
    assert!(fits, "rooms are of quads that emit as a whole");
    let estimator: Estimator = EstimatorKind::Collision.into();
    let score = if linear { Score::Linear(estimator) } else { Score::Of(estimator) };
    let walks = Walks { direction: Direction::Shooting, space: Space::Continuous, score };
    Ok(Experiment::new(Scene::build(&spec, IndexChoice::Auto)?, walks)?)
}

fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board::<MOMENTS>());
    let mut tally = experiment.tally::<MOMENTS>();
    let mut next = 0;
    while next < walks {
        let end = walks.min(next + (1 << 20));
        experiment.walk(&sequence, next..end, &mut board);
        board.add_to(&mut tally).expect("few walks");
        next = end;
    }
    tally
}

/// The fits of all faces, the back of a surface behind its front.
fn fits(experiment: &Experiment, tally: &Tally) -> Vec<Fit> {
    let scene = experiment.scene();
    let mut fits = Vec::new();
    for (number, surface) in scene.surfaces().iter().enumerate() {
        for side in [Side::Front, Side::Back] {
            let Some(first) = scene.faces().first_piece_on(number as u32, side) else { continue };
            let of = |face: u32| experiment.fit(tally, face as usize, 0).expect("walks that are shot");
            fits.extend((first..first + surface.cell_count()).map(of));
        }
    }
    fits
}

/// Processor time of this thread [s].
fn seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Grey rooms whose lamps are surfaces of their own, and the cells of their references: light that is even needs few.
fn rooms() -> Vec<(&'static str, SceneSpec, f64)> {
    let lamp = |corner: [f64; 3], u: DVec3, v: DVec3| {
        let shape = Shape::parallelogram(corner.into(), u, v, [1, 1]);
        SurfaceSpec::new(shape, 0.0).emitting(1.0)
    };
    let lit_by = |mut spec: SceneSpec, lamp: SurfaceSpec| {
        for surface in &mut spec.surfaces {
            surface.cell_emittance.clear();
        }
        spec.surfaces.push(lamp);
        spec
    };
    let in_the_box = lamp([0.35, 0.4, 0.01], DVec3::X * 0.3, DVec3::Y * 0.2);
    let in_the_first = lamp([0.3, 0.3, 0.98], DVec3::Y * 0.3, DVec3::X * 0.3);
    let in_the_office = lamp([1.7, 2.48, 0.9], DVec3::X * 0.3, DVec3::Z * 1.2);
    vec![
        ("cornell", scenes::cornell(), FINE),
        ("box", lit_by(scenes::corridor(6), in_the_box), FINE),
        ("two-rooms", lit_by(scenes::two_rooms(0.3, 0.6), in_the_first), FINE),
        ("office", lit_by(scenes::room(4), in_the_office), FINE),
        ("even-cube", scenes::furnace(3, 0.6), 6.0),
    ]
}
