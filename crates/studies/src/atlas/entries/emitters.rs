//! Emitters that walks hardly find, or that hardly send any.

use exact::Exact;
use radiosity::{Birth, EstimatorKind, Method, SceneSpec, birth_probabilities};
use report::{Axis, Chart};
use stats::Measured;

use crate::arithmetic::{ratio, root};
use crate::atlas::entry::{Entry, Finding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::numbers::{measured, number};
use crate::series::{seen, theory};
use crate::told::run;
use crate::walking::{Failure, experiment, squared_error, variance_over, walk};

pub const BLACK: Entry = Entry {
    name: "black-emitters",
    title: "Emitters that do not reflect, under gathering by survival",
    study: black,
};

pub const TINY: Entry = Entry {
    name: "tiny-emitter",
    title: "A tiny emitter: walks that gather hardly ever find it",
    study: tiny,
};

pub const FAR: Entry =
    Entry { name: "far-lamp", title: "A far lamp: walks that are shot pass the scene by", study: far };

pub const UNEQUAL: Entry = Entry {
    name: "unequal-emitters",
    title: "Many emitters of unequal power: walks go where the power is",
    study: unequal,
};

/// The patch that is looked at: in the middle of the last face of the 54-patch cube.
const PATCH: usize = 49;

fn black(lab: &Lab) -> Result<Finding, Failure> {
    let scene = |reflectance: f64| {
        let mut spec = scenes::cube(3);
        spec.surfaces[0].reflectance = reflectance.into();
        spec
    };
    let birth = Birth::Patches(vec![PATCH as u32]);
    let sweep = lab.pick(vec![0.3, 0.03], vec![0.3, 0.1, 0.03, 0.01, 0.003]);
    let walks = lab.pick(200_000, 5_000_000);
    let kinds = [EstimatorKind::Survival, EstimatorKind::Collision];
    let (mut lines, mut marks) = ([const { Vec::new() }; 2], [const { Vec::new() }; 2]);
    let mut claims = Vec::new();
    for &reflectance in &sweep {
        let spec = scene(reflectance);
        let exact = Exact::of_scene(&spec)?;
        for (k, kind) in kinds.into_iter().enumerate() {
            let experiment = experiment(&spec, Method::gathering(birth.clone(), kind))?;
            let born = birth_probabilities(experiment.scene(), &birth);
            let variance =
                exact.gathering_variances(kind, &born)[PATCH].ok_or("walks are born on the patch")?;
            let over = variance_over(&experiment, &walk::<4>(&experiment, 5, walks), PATCH, variance);
            claims.push(Claim::equal(
                format!("R = {reflectance}: variance of {} over theory", kind.word()),
                over,
                1.0,
            ));
            let scale = variance / exact.solution().reflected[PATCH].powi(2);
            lines[k].push((reflectance, scale));
            let found = Measured { value: over.value * scale, standard_error: over.standard_error * scale };
            marks[k].push((reflectance, found));
        }
    }
    let refused = experiment(&scene(0.0), Method::gathering(Birth::Area, EstimatorKind::Survival));
    let mut told: Vec<String> = refused.err().map(|why| format!("at R = 0: {why}")).into_iter().collect();
    claims.push(Claim::told(&told, "its light would be lost"));
    let dim = experiment(&scene(0.01), Method::gathering(Birth::Area, EstimatorKind::Survival))?;
    told.extend(run(&dim, 1, 20_000, None).told().into_iter().filter(|line| line.contains("`fit`")));
    claims.push(Claim::told(&told, "collision has up to 100 times less variance"));
    let at_zero = experiment(&scene(0.0), Method::gathering(birth, EstimatorKind::Collision))?;
    let truth = Exact::of_scene(&scene(0.0))?.solution().radiosity.clone();
    let (runs, few) = lab.pick((40, 20_000), (100, 100_000));
    let remedy = squared_error(lab, runs, &at_zero, few, &[PATCH], &truth);
    let last = lines[0].len() - 1;
    let expected = lines[1][last].1 / few as f64;
    claims.push(
        Claim::equal(
            "R = 0: squared error of collision over that at the end of the sweep",
            ratio(remedy, expected),
            1.0,
        )
        .instead(),
    );
    let series = (0..2).flat_map(|k| {
        let name = kinds[k].word();
        [
            theory(&format!("{name}, S97 table 3"), lines[k].iter().copied()),
            seen(&format!("{name}, seen"), marks[k].iter().copied()),
        ]
    });
    let chart = Chart {
        title: "Variance of gathering, for one walk".into(),
        x: Axis::log("reflectance of the emitter"),
        y: Axis::log("variance of b for one walk, over b²"),
        series: series.collect(),
    };
    Ok(Finding {
        predicted: "Gathering by survival scores E_s/R_s where a walk survives on a source: variance \
                    (R_i/p_i)Σ_s(E_s + 2b_s)b_is/R_s − b_i² (S97 table 3), which grows as 1/R_s. At R_s = 0 no walk \
                    survives there and the light is lost: the estimate would be 0 with an error of 0."
            .into(),
        seen: format!(
            "At R_s = {} the variance over b² is {} by survival and {} by collision.",
            sweep[last],
            measured(marks[0][last].1),
            measured(marks[1][last].1)
        ),
        told,
        instead: format!(
            "Write estimator = \"collision\": at R_s = 0 its rms relative error after {few} \
             walks is {}, where theory has {}.",
            measured(root(remedy)),
            number(expected.sqrt())
        ),
        claims,
        chart,
    })
}

fn tiny(lab: &Lab) -> Result<Finding, Failure> {
    // As much power from whatever area.
    let scene = |part: f64| {
        let mut spec = scenes::cube_with_tile((6.0 * part).sqrt(), 0.5);
        spec.surfaces[0].emittance = (1.0 / (6.0 * part)).into();
        spec
    };
    // The ceiling.
    const CEILING: usize = 3;
    let sweep = lab.pick(vec![1e-2, 1e-4, 1e-8], vec![1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]);
    let (runs, walks) = lab.pick((200, 20_000), (400, 50_000));
    let (mut line, mut gathered, mut shot) = (Vec::new(), Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &part in &sweep {
        let spec = scene(part);
        let exact = Exact::of_scene(&spec)?;
        let truth = &exact.solution().radiosity;
        let gathers = experiment(&spec, Method::gathering(Birth::Area, EstimatorKind::Collision))?;
        let born = birth_probabilities(gathers.scene(), &Birth::Area);
        let variance = exact.gathering_variances(EstimatorKind::Collision, &born)[CEILING];
        let predicted =
            variance.ok_or("walks are born on the ceiling")? / (walks as f64 * truth[CEILING].powi(2));
        let by_gathering = squared_error(lab, runs, &gathers, walks, &[CEILING], truth);
        let shoots = experiment(&spec, Method::shooting(EstimatorKind::Collision))?;
        line.push((part, predicted.sqrt()));
        gathered.push((part, root(by_gathering)));
        shot.push((part, root(squared_error(lab, runs, &shoots, walks, &[CEILING], truth))));
        if predicted < 0.05 {
            let over = ratio(by_gathering, predicted);
            claims.push(Claim::equal(format!("{part:e} of the area: squared error over theory"), over, 1.0));
        }
    }
    let told = run(
        &experiment(&scene(1e-8), Method::gathering(Birth::Area, EstimatorKind::Collision))?,
        1,
        walks,
        None,
    )
    .told();
    claims.push(Claim::told(&told, "about as rarely met"));
    claims.push(Claim::told(&told, "`unhit`"));
    let [first, last] = [shot[0].1, shot[shot.len() - 1].1];
    claims.push(
        Claim::below("error of shooting at the tiniest, twice that at the largest", last, 2.0 * first.value)
            .instead(),
    );
    Ok(Finding {
        predicted: "A gathering walk meets an emitter in proportion to its area, and scores its exitance, which for \
                    given power is the larger: variance (R_i/p_i)Σ_s(E_s + 2b_s)b_is − b_i² (S97 table 3) ∝ 1/A_s. \
                    Shooting starts at the emitter: its variance does not know how large that is."
            .into(),
        seen: format!(
            "The rms relative error of the ceiling after {walks} walks, of which a sixth are born there, grows from {} \
             at 10⁻² of the area to {}, nothing being found, at 10⁻⁸.",
            measured(gathered[0].1),
            measured(gathered[gathered.len() - 1].1)
        ),
        told,
        instead: format!("Shoot: walk = \"shooting\" errs by {} at 10⁻² and by {} at 10⁻⁸.", measured(first), measured(last)),
        claims,
        chart: Chart {
            title: format!("Errors of {walks} walks from and to an emitter of 1 W"),
            x: Axis::log("area of the emitter over that of the scene"),
            y: Axis::log("rms relative error of B of the ceiling"),
            series: vec![
                theory("gathering, S97 table 3", line),
                seen("gathering, seen", gathered),
                seen("shooting, seen", shot),
            ],
        },
    })
}

fn far(lab: &Lab) -> Result<Finding, Failure> {
    // In the middle of the floor.
    const MIDDLE: usize = 4;
    let sweep = lab.pick(vec![1.0, 10.0, 1000.0], vec![1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]);
    let (runs, walks) = lab.pick((100, 50_000), (100, 500_000));
    let shoots = |distance: f64, scale: f64| -> Result<(Exact, radiosity::Experiment), Failure> {
        let spec: SceneSpec = scenes::far_lamp(distance, scale);
        Ok((Exact::of_scene(&spec)?, experiment(&spec, Method::shooting(EstimatorKind::Collision))?))
    };
    let (mut line, mut errors) = (Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &distance in &sweep {
        let (exact, experiment) = shoots(distance, 1.0)?;
        let truth = &exact.solution().radiosity;
        let variance = exact.shooting_variances(EstimatorKind::Collision)[MIDDLE];
        let predicted = variance / (walks as f64 * truth[MIDDLE].powi(2));
        let squared = squared_error(lab, runs, &experiment, walks, &[MIDDLE], truth);
        line.push((distance, predicted.sqrt()));
        errors.push((distance, root(squared)));
        if predicted < 0.1 {
            let what = format!("{distance} m: squared error over theory");
            claims.push(Claim::equal(&what, ratio(squared, predicted), 1.0));
        }
    }
    let (exact, experiment) = shoots(1000.0, 1.0)?;
    let told = run(&experiment, 1, walks, None).told();
    claims.push(Claim::told(&told, "a lamp that is smaller and nearer"));
    let truth = &exact.solution().radiosity;
    // As large in the sky, at 10 m.
    let (near, near_experiment) = shoots(1000.0, 0.01)?;
    let near_truth = &near.solution().radiosity;
    let off = near_truth[MIDDLE] / truth[MIDDLE] - 1.0;
    let remedy = root(squared_error(lab, runs, &near_experiment, walks, &[MIDDLE], near_truth));
    let far_error = errors[errors.len() - 1].1;
    claims.push(
        Claim::sure(
            format!("the near lamp lights the floor as the far one does, to {}", number(off.abs())),
            off.abs() < 0.01,
        )
        .instead(),
    );
    claims.push(Claim::below("its error, half of the far one's", remedy, 0.5 * far_error.value).instead());
    Ok(Finding {
        predicted: "Of the walks of a lamp at the distance d a part F ∝ 1/d² arrives; the rest leaves the scene. The \
                    relative error is 1/√(N·F_i), ∝ d. Gathering fares no better, since F is as small seen from the \
                    floor, times its area over that of the lamp."
            .into(),
        seen: format!(
            "After {walks} walks the rms relative error of the floor's middle is {} at {} m and {} at {} m.",
            measured(errors[0].1),
            sweep[0],
            measured(far_error),
            sweep[sweep.len() - 1]
        ),
        told,
        instead: format!(
            "Write a `quad` for the lamp that has the same exitance and looks as large from nearer by, which gives the \
             same light: at 10 m instead of 1000 m, and a hundredth as wide, the floor's middle differs by {} (exactly solved), and the error of as \
             many walks is {}.",
            number(off.abs()),
            measured(remedy)
        ),
        claims,
        chart: Chart {
            title: format!("A lamp of 0.1 m above a floor of 1 m: {walks} walks"),
            x: Axis::log("height of the lamp [m]"),
            y: Axis::log("rms relative error of the floor's middle"),
            series: vec![
                theory("S97 table 3", line),
                seen("seen", errors),
                seen("remedy: as large in the sky, at 10 m", [(1000.0, remedy)]),
            ],
        },
    })
}

fn unequal(lab: &Lab) -> Result<Finding, Failure> {
    // The ceiling of the dim room.
    const DIM: usize = 7;
    let sweep = lab.pick(vec![1.0, 1e-2, 1e-12], vec![1.0, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-12]);
    let (runs, walks) = lab.pick((100, 20_000), (200, 100_000));
    let (mut line, mut shot, mut gathered) = (Vec::new(), Vec::new(), Vec::new());
    let mut claims = Vec::new();
    for &dim in &sweep {
        let spec = scenes::unequal_rooms(dim);
        let exact = Exact::of_scene(&spec)?;
        let truth = &exact.solution().radiosity;
        let variance = exact.shooting_variances(EstimatorKind::Collision)[DIM];
        let predicted = variance / (walks as f64 * truth[DIM].powi(2));
        let of = |method| -> Result<Measured, Failure> {
            Ok(squared_error(lab, runs, &experiment(&spec, method)?, walks, &[DIM], truth))
        };
        let by_shooting = of(Method::shooting(EstimatorKind::Collision))?;
        line.push((dim, predicted.sqrt()));
        shot.push((dim, root(by_shooting)));
        gathered.push((dim, root(of(Method::gathering(Birth::Area, EstimatorKind::Collision))?)));
        if predicted < 0.05 {
            let what = format!("{dim:e} of the power: squared error over theory");
            claims.push(Claim::equal(&what, ratio(by_shooting, predicted), 1.0));
        }
    }
    let dimmest = scenes::unequal_rooms(1e-12);
    let told = run(&experiment(&dimmest, Method::shooting(EstimatorKind::Collision))?, 1, walks, None).told();
    claims.push(Claim::told(&told, "`unhit`"));
    let [first, last] = [gathered[0].1, gathered[gathered.len() - 1].1];
    claims.push(
        Claim::below("error of gathering at the dimmest, twice that of equals", last, 2.0 * first.value)
            .instead(),
    );
    Ok(Finding {
        predicted: "Shooting chooses emitters by power: of two rooms whose lamps have the powers 1 and ε, the dim one \
                    gets εN of N walks, and errs by 1/√(εN) (b[(R_iΦ_T/A_i)(1 + 2R_iξ_i) − b], S97 table 3, with \
                    the power Φ_T of both)."
            .into(),
        seen: format!(
            "After {walks} walks the ceiling of the dim room errs by {} for ε = 1 and by {} for ε = {:e}, where no \
             walk was born in it.",
            measured(shot[0].1),
            measured(shot[shot.len() - 1].1),
            sweep[sweep.len() - 1]
        ),
        told,
        instead: format!(
            "Gather: walk = \"gathering\". Walks are born in both rooms alike, and the light of the dim lamp is rounded at random, so that \
             none is lost: the error is {} for ε = 1 and {} for ε = {:e}.",
            measured(first),
            measured(last),
            sweep[sweep.len() - 1]
        ),
        claims,
        chart: Chart {
            title: format!("Two rooms apart: the dimmer after {walks} walks"),
            x: Axis::log("power of the dim lamp over that of the other"),
            y: Axis::log("rms relative error of its ceiling"),
            series: vec![
                theory("shooting, S97 table 3", line),
                seen("shooting, seen", shot),
                seen("gathering, seen", gathered),
            ],
        },
    })
}
