//! BS §5: continuous walks, discrete walks and stochastic Jacobi iterations at equal rays, and the effect of recurrent
//! potential on them.

use exact::{Exact, jacobi_variances};
use radiosity::{
    Direction, EstimatorKind, IndexChoice, Scene, SceneSpec, Sequence, Space, Walks,
    instruments::stochastic_iteration, methods::RayBirths,
};
use report::{Axis, Chart, Series, Style};
use stats::Measured;

use crate::arithmetic::{counted, quotient};
use crate::claim::{Claim, ClaimBound};
use crate::lab::Lab;
use crate::papers::Chapter;
use crate::papers::findings::{Drawing, Findings};
use crate::papers::walkers::{coarsened, experiment, mean_by_area, method, refined};
use crate::series::point;
use crate::walking::TallyReader;

/// The chapter of BS §5.
pub(crate) const CHAPTER: Chapter = Chapter {
    name: "bs-comparison",
    title: "BS §5: continuous walks, discrete walks and stochastic Jacobi at equal rays",
    run,
};

/// The rays of a run.
const RAYS: u64 = 10_000;

/// The reflectances of the six-patch cube, those of BS table 1.
const REFLECTANCES: [f64; 6] = [0.1, 1.0 / 3.0, 0.5, 2.0 / 3.0, 0.9, 0.95];

/// The variances of B per ray, as means over patches by area [W²/m⁴].
struct Variances {
    continuous: Measured,
    discrete: Measured,
    iteration: Measured,
    /// The variances of discrete walks and of iterations, by their closed forms.
    theory: [f64; 2],
}

fn run(lab: &Lab) -> Findings {
    let runs = lab.pick(200, 2_000);
    let scenes = [
        ("54-patch cube", scenes::cube(3)),
        ("corridor 1 × 1 × 4", scenes::corridor(4)),
        ("six-patch cube, R = 1/2", scenes::furnace(1, 0.5)),
        ("six-patch cube, R = 9/10", scenes::furnace(1, 0.9)),
    ];
    let mut rows = Vec::new();
    for (name, spec) in &scenes {
        let exact = Exact::of_scene(spec).expect("a closed box");
        let found = compare(lab, spec, &exact, runs);
        let [discrete, iteration] = found.theory;
        rows.push(Claim::of(
            format!("{name}: discrete walks over iterations"),
            quotient(found.discrete, found.iteration),
            ClaimBound::Is(discrete / iteration),
        ));
        rows.push(Claim::of(
            format!("{name}: continuous over discrete walks"),
            quotient(found.continuous, found.discrete),
            ClaimBound::About(1.0),
        ));
        rows.push(Claim::of(
            format!("{name}: largest recurrent potential ζ = Rξ"),
            counted(zeta(&exact).into_iter().fold(0.0, f64::max)),
            ClaimBound::Nothing,
        ));
    }
    let cubes = REFLECTANCES.map(|r| UniformCube::new(lab, r, runs));
    rows.extend(cubes.iter().map(UniformCube::row));
    rows.extend(scenes[..2].iter().flat_map(|(name, spec)| discretisation(name, spec)));
    Findings {
        published: "Variances of the three are nearly the same at equal rays; discrete walks err (1 + 2ζ) times as much as \
                    iterations but for a square that both have; continuous walks solve another problem, with a \
                    difference that is rarely noticeable. Stated without numbers, but for table 1."
            .into(),
        experiment: format!(
            "{runs} runs of 10,000 rays of each: collision shooting, and single iterations with multinomial births whose \
             input is the solution. Variances per ray, means by area; those of continuous walks about their own mean. \
             ζ of continuous walks in the uniform cube: of faces of 4² and 8² cells, extrapolated to none."
        ),
        rows,
        remarks: vec![REMARK.into()],
        figures: vec![figure(&cubes)],
    }
}

const REMARK: &str = "Recurrent potential is what tells walks from iterations: where a patch sends little of its light \
    back to itself (ζ of a few percent) all three agree within as much; where it sends back more than it first sent \
    (ζ > 1: few patches, R near 1) walks need 2 to 4 times the rays, discrete and continuous alike, since walks decide \
    on survival one by one and iterations for all rays together. This holds of a single iteration, its input known; \
    what a chain of them or links achieve is in the chapter on efficiency.";

/// The power that discrete walks of a scene return to each patch: R_iξ_i.
fn zeta(exact: &Exact) -> Vec<f64> {
    exact.reflectance().iter().zip(exact.xi()).map(|(r, xi)| r * xi).collect()
}

fn compare(lab: &Lab, spec: &SceneSpec, exact: &Exact, runs: usize) -> Variances {
    let powers: f64 = exact.areas().iter().zip(&exact.solution().radiosity).map(|(a, b)| a * b).sum();
    // A walk takes P_T/Φ_T rays (BS §5).
    let rays_per_walk = powers / exact.total_power();
    let by_area = |variances: Vec<f64>| mean_by_area(exact, variances);
    Variances {
        continuous: of_walks(lab, spec, exact, Space::Continuous, rays_per_walk, runs),
        discrete: of_walks(lab, spec, exact, Space::Discrete, rays_per_walk, runs),
        iteration: of_iterations(lab, spec, exact, runs),
        theory: [
            rays_per_walk * by_area(exact.shooting_variances(EstimatorKind::Collision)),
            by_area(jacobi_variances(exact)),
        ],
    }
}

/// The variance per ray of walks about the mean of their runs.
fn of_walks(
    lab: &Lab,
    spec: &SceneSpec,
    exact: &Exact,
    space: Space,
    rays_per_walk: f64,
    runs: usize,
) -> Measured {
    let method = Walks { space, ..method(Direction::Shooting, EstimatorKind::Collision) };
    let experiment = experiment(spec, method);
    let reader = TallyReader::new(&experiment);
    let walks = (RAYS as f64 / rays_per_walk).round();
    let seed = if space == Space::Discrete { 401 } else { 402 };
    let found = lab.runs(&experiment, seed, runs, walks as u64, |tally| reader.reflected(tally));
    let mean = |i: usize| found.iter().map(|run| run[i]).sum::<f64>() / runs as f64;
    let means: Vec<f64> = (0..exact.face_count()).map(mean).collect();
    // The mean is that of the runs themselves, which takes one degree of freedom.
    let scale = walks * rays_per_walk * runs as f64 / (runs - 1) as f64;
    let squares = found
        .iter()
        .map(|run| scale * mean_by_area(exact, run.iter().zip(&means).map(|(b, mean)| (b - mean).powi(2))));
    Measured::of(&squares.collect::<Vec<_>>())
}

/// The variance per ray of iterations that begin at the solution.
fn of_iterations(lab: &Lab, spec: &SceneSpec, exact: &Exact, runs: usize) -> Measured {
    let scene = Scene::build(spec, IndexChoice::Auto).expect("scenes made by rule are valid");
    let (sequence, solution) = (Sequence::new(403), exact.solution());
    let squares = lab.each(
        runs,
        || (),
        |(), run| {
            let rng = sequence.walk(run as u64);
            let irradiance =
                stochastic_iteration(&scene, RayBirths::Multinomial, rng, &solution.radiosity, RAYS);
            let reflected = irradiance.iter().zip(exact.reflectance()).map(|(h, r)| r * h);
            let squares = reflected.zip(&solution.reflected).map(|(b, truth)| (b - truth).powi(2));
            RAYS as f64 * mean_by_area(exact, squares)
        },
    );
    Measured::of(&squares)
}

/// The uniform cube with one patch a face.
struct UniformCube {
    reflectance: f64,
    /// The recurrent potential ζ of discrete and of continuous walks.
    zeta: [f64; 2],
    /// The variances per ray of both over that of an iteration, 5R².
    measured: [Measured; 2],
    theory: [f64; 2],
}

impl UniformCube {
    fn new(lab: &Lab, reflectance: f64, runs: usize) -> Self {
        let spec = scenes::furnace(1, reflectance);
        let exact = Exact::of_scene(&spec).expect("a closed box");
        let iteration = jacobi_variances(&exact)[0];
        let rays_per_walk = 1.0 / (1.0 - reflectance);
        let measured = [Space::Discrete, Space::Continuous].map(|space| {
            let found = of_walks(lab, &spec, &exact, space, rays_per_walk, runs);
            Measured { value: found.value / iteration, standard_error: found.standard_error / iteration }
        });
        let [coarse, fine] = [4, 8].map(|cells| returns(reflectance, cells));
        // The error of cells falls as their size squared.
        let zeta = [zeta(&exact)[0], (4.0 * fine - coarse) / 3.0];
        let of_zeta = |zeta: f64| {
            let r2 = reflectance * reflectance;
            (6.0 * r2 * (1.0 + 2.0 * zeta) - r2 * rays_per_walk) / iteration
        };
        UniformCube { reflectance, zeta, measured, theory: zeta.map(of_zeta) }
    }

    /// BS eq. (18) is exact where b is the same everywhere.
    fn row(&self) -> Claim {
        let label = format!("six-patch cube, R = {:.3}: continuous walks over iterations", self.reflectance);
        Claim::of(label, self.measured[1], ClaimBound::Is(self.theory[1]))
    }
}

/// R times the power that returns to a face of n × n cells, of one unit of power that it sends out evenly.
fn returns(reflectance: f64, n: u32) -> f64 {
    let mut spec = scenes::furnace(n, reflectance);
    // A face has an area of 1 m².
    spec.surfaces
        .iter_mut()
        .enumerate()
        .for_each(|(i, s)| s.emittance = if i == 0 { 1.0 } else { 0.0 }.into());
    let exact = Exact::of_scene(&spec).expect("a closed box");
    reflectance * exact.solution().incoming[..(n * n) as usize].iter().sum::<f64>()
}

/// The difference between the solutions of continuous and of discrete walks.
fn discretisation(name: &str, spec: &SceneSpec) -> [Claim; 2] {
    let coarse = Exact::of_scene(spec).expect("a closed box");
    let fine = Exact::of_scene(&refined(spec, 2)).expect("a closed box");
    let found = coarsened(&fine.solution().reflected, spec, 2);
    let differences: Vec<f64> =
        found.iter().zip(&coarse.solution().reflected).map(|(c, d)| (c / d - 1.0).abs()).collect();
    let rms = mean_by_area(&coarse, differences.iter().map(|d| d * d)).sqrt();
    let largest = differences.iter().copied().fold(0.0, f64::max);
    [("rms", rms), ("largest", largest)].map(|(which, value)| {
        let label = format!("{name}: {which} relative difference of b, patches as they are and cut in four");
        Claim::of(label, counted(value), ClaimBound::Nothing)
    })
}

/// The chart of walks over iterations, against ζ.
fn figure(cubes: &[UniformCube; 6]) -> Drawing {
    let line = |which: usize| cubes.iter().map(move |c| point(c.zeta[which], counted(c.theory[which])));
    let marks = |which: usize| cubes.iter().map(move |c| point(c.zeta[which], c.measured[which]));
    let series = |name: &str, style: Style, points| Series { name: name.into(), style, points };
    let chart = Chart {
        title: "What recurrent potential costs walks: the six-patch cube, R = 0.1 … 0.95".into(),
        x: Axis::log("recurrent potential ζ"),
        y: Axis::log("variance per ray, walks over iterations"),
        series: vec![
            series("theory, discrete (BS eq. 19)", Style::Line, line(0).collect()),
            series("theory, continuous (BS eq. 18)", Style::Line, line(1).collect()),
            series("measured, discrete", Style::Marks, marks(0).collect()),
            series("measured, continuous", Style::Marks, marks(1).collect()),
        ],
    };
    Drawing::chart("bs-comparison.svg", "Walks over iterations against recurrent potential", &chart)
}
