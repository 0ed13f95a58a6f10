//! What the program tells of a result is no better than the result: targets, headlines, distances, over scenes that make them hard.

use std::fs;

use exact::Exact;
use glam::DVec3;
use job::{Target, Unhit};
use judge::target::{Observer, judge, looks};
use radiosity::{
    Birth, Chains, Estimates, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec,
    Sequence, Sides, Space, Spectrum, SurfaceSpec, Tally, Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Sampler, Score, Solve},
    precision::Quantity,
};
use serde_json::Value;
use tempfile::tempdir;

use crate::common::{box_walls, quad, surface};
use crate::support::{path, run, summary};

/// A run of a job, which must end with a code.
fn ends(job: &str, args: &[&str], expected: i32) -> (Value, String) {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let (code, text, stderr) = run(&[&["run", job, "--out", out.to_str().unwrap()], args].concat());
    assert_eq!(code, expected, "{text}{stderr}");
    (summary(&out), text)
}

/// Where all surfaces emit, a target of 0.01 % is not reached by 4,096 walks, and errors are those of irradiance.
#[test]
fn rooms_of_emitters_are_judged_by_irradiance() {
    for job in ["configs/furnace.toml", "configs/cube6-r90.toml"] {
        let (summary, text) = ends(job, &["--paths", "20000", "--set", "target.relative_error=0.0001"], 1);
        assert_eq!(summary["paths"], 20000);
        assert!(text.contains("target not reached") && text.contains("irradiance"), "{text}");
        for figure in ["rms_relative_error", "max_relative_error"] {
            assert!(summary[figure].as_f64().unwrap() > 1e-3, "{summary}");
        }
        let (planned, text, _) = run(&["plan", job, "--set", "target.relative_error=0.0001"]);
        assert!(planned == 0 && text.contains("ends the run before (target not reached)"), "{text}");
    }
}

/// Two black walls of 16 patches each, a meter apart, beside a lamp.
const BLACK: &str = r#"
[material.black]
reflectance = 0.0
[material.lamp]
reflectance = 0.0
emittance = 10.0
[[surface]]
material = "black"
quad = [[0,0,0], [1,0,0], [0,1,0]]
patches = [4, 4]
[[surface]]
material = "black"
quad = [[0,0,0], [0,1,0], [0,0,1]]
patches = [4, 4]
[[surface]]
material = "lamp"
quad = [[0,0,1], [0,1,1], [1,0,1]]
"#;

/// A target of 5 % on black walls holds their irradiance to 5 %; their radiosity is nothing to judge.
#[test]
fn black_walls_are_judged_by_irradiance_and_have_no_radiosity_to_judge() {
    let folder = tempdir().unwrap();
    fs::write(path(&folder, "scene.toml"), BLACK).unwrap();
    let job = path(&folder, "job.toml");
    let text = "scene = \"scene.toml\"\n[budget]\npaths = 1000000\n[method]\nwalk = \"shooting\"\nestimator = \"collision\"\n\
                space = \"continuous\"\n[target]\nrelative_error = 0.05\nfraction = 1.0\nunhit = \"ignore\"\n";
    fs::write(&job, text).unwrap();
    let out = path(&folder, "out");
    let of = |more: &[&str]| {
        run(&[&["run", job.to_str().unwrap(), "--force", "--out", out.to_str().unwrap()], more].concat())
    };
    let (code, text, stderr) = of(&[]);
    assert_eq!(code, 0, "{text}{stderr}");
    let table = crate::support::columns(&out.join("patches.csv"));
    let of_walls =
        |name: &str| -> Vec<f64> { table[name][..32].iter().map(|cell| cell.parse().unwrap()).collect() };
    let [h, error, low, high, b, b_error] =
        ["irradiance", "irradiance_error", "irradiance_low", "irradiance_high", "radiosity", "std_error"]
            .map(of_walls);
    for i in 0..32 {
        assert!(
            error[i] / h[i] < 0.05 && (high[i] - low[i]) / 2.0 / h[i] <= 0.05,
            "patch {i}: {} ± {}",
            h[i],
            error[i]
        );
        assert_eq!((b[i], b_error[i]), (0.0, 0.0));
    }
    let (code, text, _) = of(&["--set", "target.quantity=radiosity", "--paths", "4000"]);
    assert!(code == 1 && text.contains("target not reached: nothing to judge"), "{text}");
    assert_eq!(summary(&out)["target"]["achieved"], Value::Null);
    let (code, _, _) = of(&["--set", "target.quantity=net", "--paths", "4000"]);
    assert_eq!(code, 1);
}

/// A box as five large walls, open to the front, with a lamp close below its ceiling, which shines on a small part of that.
fn five_walls() -> SceneSpec {
    let walls = box_walls(DVec3::ONE, [1, 1]).into_iter().enumerate().filter(|(wall, _)| *wall != 2);
    let mut surfaces: Vec<SurfaceSpec> = walls.map(|(_, wall)| surface(wall, 0.75)).collect();
    let lamp = quad(DVec3::new(0.4, 0.4, 0.98), DVec3::Y * 0.2, DVec3::X * 0.2, [1, 1]);
    surfaces.push(SurfaceSpec { emittance: 10.0.into(), sides: Sides::Both, ..surface(lamp, 0.0) });
    SceneSpec::new(surfaces)
}

/// Discrete walks between whole walls solve another problem, and the headline says how far it is from the truth; in an evenly lit
/// furnace the two are one. The lower end of its interval is above 0 by chance in 1 of 40 seeds; this one was not chosen.
#[test]
fn the_discretised_system_is_reported_with_its_distance_from_the_truth() {
    let folder = tempdir().unwrap();
    let of = |name: &str, spec: &SceneSpec, space: &str| {
        let scene = path(&folder, &format!("{name}.toml"));
        fs::write(&scene, job::to_toml(spec)).unwrap();
        let space = format!("method.space={space}");
        let sets = ["method.walk=shooting", "scene.patches=given", &space];
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        ends(scene.to_str().unwrap(), &[&["--paths", "400000", "--seed", "1"], &sets[..]].concat(), 0)
    };
    let (walls, text) = of("walls", &five_walls(), "discrete");
    assert!(text.contains("by area, of the discretised system: median"), "{text}");
    let low = walls["discretised"]["low"].as_f64().unwrap();
    assert!(low > 0.3, "{}", walls["discretised"]);
    let (even, text) = of("furnace", &scenes::furnace(2, 0.5), "discrete");
    assert!(
        even["discretised"]["low"] == 0.0 && even["discretised"]["high"].as_f64().unwrap() < 0.05,
        "{text}"
    );
    let (continuous, text) = of("walls", &five_walls(), "continuous");
    assert!(continuous.get("discretised").is_none() && !text.contains("discretised"), "{text}");
}

/// Two rooms of which the second has a thousandth of the light: the errors that 3,000 walks report are not below their true errors.
#[test]
fn unhit_rooms_are_in_the_headline() {
    let spec = scenes::two_rooms(0.05, 0.5);
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision)).unwrap();
    let truth = Exact::of_scene(&spec).unwrap().solution().irradiance.clone();
    for seed in 0..4 {
        let tally = walked(&experiment, seed, 3000);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let headline = estimates.precision(Quantity::Irradiance, &radiosity::parallel::in_turn).headline;
        assert_eq!(headline.sealed_area, 0.0, "the hole is found");
        let mut errors: Vec<(f64, f64)> = estimates
            .known()
            .map(|(i, face, known)| {
                let off = (known[0].irradiance.unwrap_or(0.0) - truth[i]).abs();
                (off / truth[i].max(headline.floor[0]), face.area)
            })
            .collect();
        errors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = errors.iter().map(|(_, area)| area).sum();
        for (part, reported) in [(0.5, headline.quantiles[0]), (0.9, headline.quantiles[1])] {
            let mut below = 0.0;
            let real = errors.iter().find(|(_, area)| {
                below += area;
                below >= part * all
            });
            assert!(
                reported >= real.unwrap().0,
                "seed {seed}, {part} of the area: told {reported}, real {}",
                real.unwrap().0
            );
        }
    }
}

fn walked(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut tally = experiment.tally();
    walk_on(experiment, seed, walks, &mut tally);
    tally
}

/// Goes on from the walks of a tally to some number of them.
fn walk_on(experiment: &Experiment, seed: u64, walks: u64, tally: &mut Tally) {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), tally.counts.walks..walks, &mut board);
    board.add_to(tally).unwrap();
}

/// A scene in a box of random size, by its number: all emits, all is black but one lamp, one patch is lit, all light leaves at once,
/// reflectances of 0.999, or half of it is a sealed box.
fn hard_scene(number: u64) -> SceneSpec {
    let mut rng = Sequence::new(41).walk(number);
    let mut uniform = || rng.pair()[0];
    let size = DVec3::new(0.5 + uniform(), 0.5 + uniform(), 0.5 + uniform());
    let mut surfaces: Vec<SurfaceSpec> =
        box_walls(size, [2, 2]).into_iter().map(|wall| surface(wall, 0.8 * uniform())).collect();
    let lamp = (uniform() * 6.0) as usize;
    match number % 6 {
        0 => surfaces.iter_mut().for_each(|wall| wall.emittance = (0.1 + uniform()).into()),
        1 => {
            surfaces.iter_mut().for_each(|wall| wall.reflectance = 0.0.into());
            surfaces[lamp].emittance = 1.0.into();
        }
        2 => surfaces[lamp].cell_emittance = vec![(0, 1.0.into())],
        3 => {
            let above = quad(DVec3::new(0.0, 0.0, 2.0 * size.z), DVec3::X, DVec3::Y, [1, 1]);
            surfaces.push(SurfaceSpec { emittance: 1.0.into(), ..surface(above, 0.5) });
        }
        4 => {
            surfaces.iter_mut().for_each(|wall| wall.reflectance = 0.999.into());
            surfaces[lamp].cell_emittance = vec![(3, 1.0.into())];
        }
        _ => {
            surfaces[lamp].emittance = 1.0.into();
            surfaces[(lamp + 1) % 6].sides = Sides::Both;
            surfaces[(lamp + 2) % 6].sides = Sides::Both;
        }
    }
    SceneSpec::new(surfaces)
}

/// Where a target is called reached, what the truth misses it by is what intervals of 95 % may miss, and no more: over all runs 5 % of the
/// judged area in the mean, with a standard error of some 1.5 % as faces of one run err together; 10 % are allowed, a false alarm in
/// some 2,000 suites. No single run may miss on half of its area beyond what the target leaves out.
#[test]
fn no_target_is_reached_that_the_truth_misses() {
    let (mut runs, mut missed, mut reached_of) = (0, 0.0, [0; 6]);
    for number in 0..72 {
        let spec = hard_scene(number);
        let quantity = [Quantity::Irradiance, Quantity::Radiosity, Quantity::Net][(number / 6 % 3) as usize];
        let unhit = if number / 18 % 2 == 0 { Unhit::Infinite } else { Unhit::Ignore };
        let target = Target {
            relative_error: 0.15,
            fraction: 0.9,
            min_paths: 1024,
            min_hits: 10,
            unhit,
            patches: None,
            quantity,
        };
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision)).unwrap();
        let mut observer = Observer::new(experiment.clone(), 0.95, Some(target.clone()));
        let most = if number % 6 == 4 { 16_384 } else { 131_072 };
        let mut seen = Vec::new();
        let mut tally = experiment.tally();
        for walks in looks(&experiment, most) {
            walk_on(&experiment, number, walks, &mut tally);
            seen.push(observer.look(&tally, &seen));
            if seen.last().unwrap().reached {
                break;
            }
        }
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let judged = judge(&target, &estimates, tally.counts.walks);
        if number % 6 == 3 || (number % 6 == 1 && quantity == Quantity::Radiosity) {
            assert!(
                !judged.reached && !seen.last().unwrap().reached,
                "scene {number}: there is nothing to judge"
            );
        }
        if !judged.reached {
            continue;
        }
        let solution = Exact::of_scene(&spec).unwrap().solution().clone();
        let (mut off, mut all) = (0.0, 0.0);
        for (i, face, known) in estimates.known() {
            let Some(estimate) = quantity.of(&face, 0, &known[0]) else { continue };
            if unhit == Unhit::Ignore && estimate.value.is_none() {
                continue;
            }
            let truth = match quantity {
                Quantity::Irradiance => solution.irradiance[i],
                Quantity::Radiosity => solution.radiosity[i],
                Quantity::Net => face.emittance[0] - (1.0 - face.reflectance[0]) * solution.irradiance[i],
            };
            all += face.area;
            let value = estimate.value.unwrap_or(0.0);
            off += if (value - truth).abs() > 0.15 * value.abs() { face.area } else { 0.0 };
        }
        runs += 1;
        reached_of[(number % 6) as usize] += 1;
        missed += (off / all - 0.1).max(0.0);
        assert!(off / all < 0.6, "scene {number}, {quantity:?}: reached, and {off} of {all} m² miss it");
    }
    assert!(runs >= 24, "{reached_of:?}");
    assert!(missed / f64::from(runs) < 0.1, "{missed} of {runs} runs: {reached_of:?}");
}

/// All kinds of methods, each for the samples of a target's looks; chains and batches are few and long.
fn all_methods(faces: u64) -> Vec<(&'static str, Method, u64)> {
    let [first, roulette] =
        [Estimator::Collision, Estimator::Infinite(InfiniteEnd::Roulette { threshold: 0.01 })];
    let cutoff = Estimator::Infinite(InfiniteEnd::Cutoff { threshold: 0.01 });
    let score = BatchScore::Of(first, Space::Discrete);
    vec![
        ("absorption", Method::shooting(Estimator::Absorption), 1 << 16),
        ("survival", Method::shooting(Estimator::Survival), 1 << 16),
        ("collision", Method::shooting(first), 1 << 16),
        ("roulette", Method::shooting(roulette), 1 << 14),
        ("cut off", Method::shooting(cutoff), 1 << 14),
        ("gathering", Method::gathering(Birth::Area, first), 1 << 17),
        ("sobol", Batches { walks: 512, sampler: Sampler::Sobol, score }.into(), 64),
        ("linear", Walks::shooting(Score::Linear(first)).into(), 1 << 16),
        (
            "chains",
            Chains { rays: 64 * faces, solve: Solve::Links, linear: false, final_gather: vec![] }.into(),
            16,
        ),
    ]
}

/// Gives a scene three channels, which differ from patch to patch.
fn in_colour(mut spec: SceneSpec) -> SceneSpec {
    let tints = [[1.0, 0.7, 0.3], [0.4, 1.0, 0.8], [0.9, 0.2, 1.0]];
    let tinted = |of: &Spectrum, tint: [f64; 3]| Spectrum::rgb([0, 1, 2].map(|c| of[c] * tint[c]));
    for (i, surface) in spec.surfaces.iter_mut().enumerate() {
        surface.reflectance = tinted(&surface.reflectance, tints[i % 3]);
        surface.emittance = tinted(&surface.emittance, [1.0, 0.6, 0.4]);
        surface
            .cell_emittance
            .iter_mut()
            .for_each(|(_, emittance)| *emittance = tinted(emittance, [1.0, 0.6, 0.4]));
    }
    spec
}

/// The part of the area that a target is about whose quantity misses it in some channel.
fn part_missing(spec: &SceneSpec, target: &Target, estimates: &Estimates) -> f64 {
    let exact = Exact::of_channels(spec, &|_| ()).unwrap();
    let (mut off, mut all) = (0.0, 0.0);
    for (i, face, known) in estimates.known() {
        let of_channel = |(c, exact): (usize, &Exact)| {
            let estimate = target.quantity.of(&face, c, &known[c])?;
            let solution = exact.solution();
            let truth = match target.quantity {
                Quantity::Irradiance => solution.irradiance[i],
                Quantity::Radiosity => solution.radiosity[i],
                Quantity::Net => face.emittance[c] - (1.0 - face.reflectance[c]) * solution.irradiance[i],
            };
            let value = estimate.value.unwrap_or(0.0);
            Some((value - truth).abs() > target.relative_error * value.abs() + 1e-12)
        };
        let misses: Vec<bool> = exact.iter().enumerate().filter_map(of_channel).collect();
        if misses.is_empty()
            || (estimates.scene().sealed().group_of(i as u32).is_some() && known[0].is_unsampled())
        {
            continue;
        }
        all += face.area;
        off += if misses.contains(&true) { face.area } else { 0.0 };
    }
    if all > 0.0 { off / all } else { 1.0 }
}

/// By every method, in grey and in colour, what the truth misses a target by that is called reached is no more than intervals of 95 % may
/// miss. Over the runs of a method the mean is below 5 %, as targets ask for nine tenths and the rest may miss; with the faces of one
/// run in step, its standard error is some 2 % at 12 runs. 12 % are allowed: for one method in 2,000 suites a false alarm.
#[test]
fn no_method_reaches_a_target_that_the_truth_misses() {
    for kind in 0..all_methods(0).len() {
        let (mut runs, mut missed) = (0, 0.0);
        for number in 0..12 {
            let number = 72 + number;
            let grey = hard_scene(number);
            let spec = if number / 6 % 2 == 0 { grey } else { in_colour(grey) };
            let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
            let (name, method, most) = all_methods(scene.faces().len() as u64).swap_remove(kind);
            // Walks between reflectances of 0.999 have a thousand rays.
            let most = if number % 6 == 4 && most > 1000 { 1 << 12 } else { most };
            let target = loose_target();
            let experiment = Experiment::new(scene, method).unwrap();
            let mut observer = Observer::new(experiment.clone(), 0.95, Some(target.clone()));
            let (mut seen, mut tally) = (Vec::new(), experiment.tally());
            for samples in looks(&experiment, most) {
                walk_on(&experiment, number, samples, &mut tally);
                seen.push(observer.look(&tally, &seen));
                if seen.last().unwrap().reached {
                    break;
                }
            }
            let estimates = Estimates::new(&experiment, &tally, 0.95);
            let judged = judge(&target, &estimates, tally.counts.walks * experiment.unit().paths());
            assert!(
                !(judged.reached && number % 6 == 3),
                "{name}, scene {number}: there is nothing to judge"
            );
            if judged.reached {
                let off = part_missing(&spec, &target, &estimates);
                assert!(off < 0.6, "{name}, scene {number}: reached, and {off} of the area miss it");
                runs += 1;
                missed += (off - 0.1).max(0.0);
            }
        }
        let name = all_methods(0)[kind].0;
        assert!(runs >= 3, "{name}: only {runs} runs reach the target");
        assert!(missed / f64::from(runs) < 0.12, "{name}: {missed} of {runs} runs");
    }
}

/// A sealed half counts neither for nor against a target, and the sides of a sky are no part of the room.
#[test]
fn targets_are_about_the_area_of_the_headline() {
    let target = Target {
        relative_error: 0.1,
        fraction: 1.0,
        min_paths: 0,
        min_hits: 10,
        unhit: Unhit::Infinite,
        patches: None,
        quantity: Quantity::Irradiance,
    };
    let of = |spec: &SceneSpec| {
        let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision)).unwrap();
        let tally = walked(&experiment, 5, 100_000);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        (
            judge(&target, &estimates, 100_000),
            estimates.precision(Quantity::Irradiance, &radiosity::parallel::in_turn).headline,
        )
    };
    let halves = scenes::unequal_rooms(0.0);
    let all: f64 = halves.surfaces.iter().map(|surface| surface.shape.area() * surface.sides.count()).sum();
    let (judged, headline) = of(&halves);
    assert!(judged.reached && judged.achieved == 1.0, "{}", judged.achieved);
    assert!(headline.sealed_area > 0.0 && (headline.area + headline.sealed_area - all).abs() < 1e-9 * all);
    let plate = SurfaceSpec {
        sides: Sides::Front,
        ..surface(quad(DVec3::splat(0.1), DVec3::X * 0.8, DVec3::Y * 0.8, [2, 2]), 0.5)
    };
    let sky = box_walls(DVec3::ONE, [1, 1]).into_iter().map(|wall| SurfaceSpec {
        name: Some(radiosity::surfaces::SKY.into()),
        emittance: 1.0.into(),
        ..surface(wall, 0.0)
    });
    let (judged, headline) = of(&SceneSpec::new(std::iter::once(plate).chain(sky).collect()));
    assert!((headline.area - 0.64).abs() < 1e-12, "{}", headline.area);
    assert!(judged.reached && judged.worst.is_empty());
}

/// The terminal, the page and the summary tell one headline: in the same words, of the same numbers.
#[test]
fn terminal_page_and_summary_tell_one_headline() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let args = ["run", "tests/data/cube54.toml", "--paths", "20000", "--out", out.to_str().unwrap()];
    let (code, text, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    let line = text.lines().find(|line| line.starts_with("relative half-width by area")).unwrap();
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains(&line["relative".len()..].replace('\'', "&#x27;")), "{line}");
    let facts = page.split_once("id=\"facts\">").unwrap().1.split_once("</script>").unwrap().0;
    let facts: Value = serde_json::from_str(facts).unwrap();
    let headline = &summary(&out)["headline"];
    assert_eq!(&facts["summary"]["headline"], headline);
    for (words, key) in
        [("median", "median"), ("90th percentile", "p90"), ("99th", "p99"), ("worst", "worst")]
    {
        let figure = line.split_once(&format!("{words} ")).unwrap().1.split_once(" %").unwrap().0;
        let figure: f64 = figure.parse().unwrap();
        let number = 100.0 * headline[key].as_f64().unwrap();
        // Three digits are printed.
        assert!((figure / number - 1.0).abs() < 5.1e-3, "{words}: {figure} for {number}");
    }
}

/// The irradiance of nine tenths of the area within a fifth.
fn loose_target() -> Target {
    Target {
        relative_error: 0.2,
        fraction: 0.9,
        min_paths: 1024,
        min_hits: 10,
        unhit: Unhit::Infinite,
        patches: None,
        quantity: Quantity::Irradiance,
    }
}

/// A scene whose patches a pilot chooses for some paths, to be walked by the method that it chooses, too.
fn chosen(spec: &SceneSpec, paths: u64, seed: u64) -> Experiment {
    let folder = tempdir().unwrap();
    let [scene, file] = ["scene.toml", "job.toml"].map(|name| path(&folder, name));
    fs::write(&scene, job::to_toml(spec)).unwrap();
    fs::write(&file, format!("scene = \"scene.toml\"\nseed = {seed}\n[budget]\npaths = {paths}\n")).unwrap();
    let auto = ["scene.patches=auto".to_owned()];
    let open = job::load(&file, &auto).unwrap();
    let partition = results::choose(&open, 1.try_into().unwrap()).unwrap().unwrap().partition;
    let cut = open.cut(&auto, &partition).unwrap();
    Experiment::new(cut.build_scene().unwrap(), cut.method.walks()).unwrap()
}

/// On patches that a pilot has chosen, too, what the truth misses a target by that is called reached is no more than intervals of 95 % may miss.
/// The truth is that of 64 times the walks; a patch misses where it does so by more than four of the truth's own standard errors. Limits are those
/// of [`no_method_reaches_a_target_that_the_truth_misses`]. Where nothing is lit there is nothing to choose by, and walks of reflectances of
/// 0.999 take too long.
#[test]
fn no_target_is_reached_on_chosen_patches_that_the_truth_misses() {
    let (mut runs, mut missed) = (0, 0.0);
    for number in (0..24).filter(|number| ![3, 4].contains(&(number % 6))) {
        let spec = if number < 12 { hard_scene(number) } else { in_colour(hard_scene(number)) };
        let experiment = chosen(&spec, 1 << 14, number);
        let target = loose_target();
        let mut observer = Observer::new(experiment.clone(), 0.95, Some(target.clone()));
        let (mut seen, mut tally) = (Vec::new(), experiment.tally());
        for walks in looks(&experiment, 1 << 16) {
            walk_on(&experiment, number, walks, &mut tally);
            seen.push(observer.look(&tally, &seen));
            if seen.last().unwrap().reached {
                break;
            }
        }
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        if !judge(&target, &estimates, tally.counts.walks).reached {
            continue;
        }
        let longer = walked(&experiment, 1000 + number, 64 * tally.counts.walks);
        let truth = Estimates::new(&experiment, &longer, 0.95);
        let (mut off, mut all) = (0.0, 0.0);
        for (i, face, known) in estimates.known() {
            let truth = truth.face(i).unwrap();
            if truth[0].is_unsampled() {
                continue;
            }
            let misses = |(c, known): (usize, &radiosity::Estimate)| {
                let value = known.irradiance.unwrap_or(0.0);
                let [mean, error] = [truth[c].irradiance, truth[c].irradiance_error].map(Option::unwrap);
                (value - mean).abs() > target.relative_error * value + 4.0 * error
            };
            all += face.area;
            off += if known.iter().enumerate().any(misses) { face.area } else { 0.0 };
        }
        assert!(off < 0.6 * all, "scene {number}: reached, and {off} of {all} m² miss it");
        runs += 1;
        missed += (off / all - 0.1).max(0.0);
    }
    assert!(runs >= 8, "only {runs} runs reach the target");
    assert!(missed / f64::from(runs) < 0.12, "{missed} of {runs} runs");
}
