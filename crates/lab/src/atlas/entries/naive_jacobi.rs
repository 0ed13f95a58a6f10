//! Entry of the atlas: naive intervals of stochastic Jacobi iterations, a mistake made on purpose. The iterations are
//! those of BS §4 on the exact form factors, without any tracing; they begin at the solution, which no real chain can.

use exact::Exact;
use radiosity::Method;
use rand_pcg::Pcg64Dxsm;
use rand_pcg::rand_core::{Rng, SeedableRng};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::arithmetic::{proportion, ratio};
use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::judged_run::run;
use crate::lab::Lab;
use crate::series::SweepCurve;
use crate::walking::{Failure, coverage, experiment, receivers};
use report::words::{measured, number};

pub(crate) const ENTRY: Entry = Entry {
    name: "naive-jacobi",
    title: "Intervals from the spread between the iterations of one chain",
    study,
};

const REFLECTANCE: f64 = 0.95;

/// The rays of one iteration.
const RAYS: usize = 400;

/// The quantile of two-sided intervals of 95 %.
const Z: f64 = 1.96;

type IterationMatrix = Vec<Vec<f64>>;

/// The iterations P' = Φ + R·(the power of P that arrives), by their expectation and their noise (BS eqs. 20–22).
struct JacobiIteration {
    /// The transport matrix T_lj = R_l F_jl.
    transport: IterationMatrix,
    /// The covariance of one iteration that begins at the solution: rays land on l with the probability φ_l/P_T.
    noise: IterationMatrix,
    /// The powers P at the solution [W].
    power: Vec<f64>,
    emitted: Vec<f64>,
    reflectance: Vec<f64>,
    /// For each patch, the patches that its rays reach, with cumulative probabilities.
    reach: IterationMatrix,
}

impl JacobiIteration {
    fn new(exact: &Exact) -> Self {
        let n = exact.face_count();
        let form = |j: usize, l: usize| exact.exchange().form_factor(j, l);
        let reflectance = exact.reflectance().to_vec();
        let areas = exact.areas();
        let power: Vec<f64> = areas.iter().zip(&exact.solution().radiosity).map(|(a, b)| a * b).collect();
        let total: f64 = power.iter().sum();
        let landing: Vec<f64> = exact.solution().incoming.iter().map(|phi| phi / total).collect();
        let covariance = |l: usize, m: usize| {
            let own = if l == m { landing[l] } else { 0.0 };
            let scale = reflectance[l] * reflectance[m] * total * total / RAYS as f64;
            scale * (own - landing[l] * landing[m])
        };
        let reach = |j: usize| {
            let mut sum = 0.0;
            (0..n)
                .map(|l| {
                    sum += form(j, l);
                    sum
                })
                .collect()
        };
        JacobiIteration {
            transport: (0..n).map(|l| (0..n).map(|j| reflectance[l] * form(j, l)).collect()).collect(),
            noise: (0..n).map(|l| (0..n).map(|m| covariance(l, m)).collect()).collect(),
            emitted: areas.iter().zip(exact.emittance()).map(|(a, e)| a * e).collect(),
            reach: (0..n).map(reach).collect(),
            power,
            reflectance,
        }
    }

    /// The variances of the mean over some iterations, and the expectations of the variances that their spread claims.
    fn predicted(&self, iterations: usize) -> (Vec<f64>, Vec<f64>) {
        let n = self.power.len();
        let identity: IterationMatrix =
            (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        // After k iterations the error is Σ_m T^m ε, where ε is the noise of the iteration m steps before.
        let (mut carried, mut sum) = (identity, vec![vec![0.0; n]; n]);
        let (mut of_mean, mut of_one) = (vec![0.0; n], vec![0.0; n]);
        for m in 0..iterations {
            add(&mut sum, &carried);
            let spread = quadratic(&sum, &self.noise);
            of_mean.iter_mut().zip(spread).for_each(|(total, v)| *total += v);
            let alone = quadratic(&carried, &self.noise);
            // Noise that is m iterations old is in all but m of them.
            let share = (iterations - m) as f64 / iterations as f64;
            of_one.iter_mut().zip(alone).for_each(|(total, v)| *total += share * v);
            carried = product(&carried, &self.transport);
        }
        let k = iterations as f64;
        of_mean.iter_mut().for_each(|v| *v /= k * k);
        let naive = of_one.iter().zip(&of_mean).map(|(one, mean)| (one - mean) / (k - 1.0)).collect();
        (of_mean, naive)
    }

    /// The mean of some iterations, and its naive variance, for each patch.
    fn chain(&self, seed: u64, iterations: usize) -> (Vec<f64>, Vec<f64>) {
        let mut rng = Pcg64Dxsm::seed_from_u64(seed);
        let mut uniform = || (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let n = self.power.len();
        let mut power = self.power.clone();
        let (mut sum, mut squares) = (vec![0.0; n], vec![0.0; n]);
        for _ in 0..iterations {
            let mut upto = 0.0;
            let births: Vec<f64> = power
                .iter()
                .map(|p| {
                    upto += p;
                    upto
                })
                .collect();
            let mut next = self.emitted.clone();
            for _ in 0..RAYS {
                let birth = uniform() * upto;
                let from = births.partition_point(|&p| p < birth).min(n - 1);
                let u = uniform();
                let to = self.reach[from].partition_point(|&p| p < u);
                if to < n {
                    next[to] += self.reflectance[to] * upto / RAYS as f64;
                }
            }
            power = next;
            for i in 0..n {
                sum[i] += power[i];
                squares[i] += power[i] * power[i];
            }
        }
        let k = iterations as f64;
        let naive = sum.iter().zip(&squares).map(|(s, q)| (q - s * s / k) / (k * (k - 1.0))).collect();
        (sum.into_iter().map(|s| s / k).collect(), naive)
    }
}

fn add(sum: &mut IterationMatrix, term: &IterationMatrix) {
    for (row, other) in sum.iter_mut().zip(term) {
        row.iter_mut().zip(other).for_each(|(x, y)| *x += y);
    }
}

fn product(a: &IterationMatrix, b: &IterationMatrix) -> IterationMatrix {
    let row = |a: &Vec<f64>| {
        let mut sums = vec![0.0; b.len()];
        for (x, row) in a.iter().zip(b) {
            sums.iter_mut().zip(row).for_each(|(sum, y)| *sum += x * y);
        }
        sums
    };
    a.iter().map(row).collect()
}

/// The diagonal of M C Mᵀ.
fn quadratic(m: &IterationMatrix, c: &IterationMatrix) -> Vec<f64> {
    let mc = product(m, c);
    mc.iter().zip(m).map(|(row, m)| row.iter().zip(m).map(|(x, y)| x * y).sum()).collect()
}

/// The part of naive intervals that holds the truth, if the true variance is `ratio` times theirs.
fn coverage_of(ratio: f64) -> f64 {
    2.0 * stats::normal_cdf(Z / ratio.sqrt()) - 1.0
}

/// A patch far from the lamp.
const PATCH: usize = 20;

/// The sweep over iterations of one chain.
struct NaiveJacobiSweep {
    iterations: Vec<usize>,
    /// The coverage of the naive intervals.
    coverage: SweepCurve,
    /// The true variance over the one that the spread claims, at the end of the sweep.
    excess: f64,
    claims: Vec<Claim>,
}

impl NaiveJacobiSweep {
    fn drive(lab: &Lab, iteration: &JacobiIteration) -> Self {
        let all = lab.pick(vec![10, 40], vec![5, 10, 20, 40, 80, 160, 320]);
        let runs = lab.pick(200, 1000);
        let (mut coverage, mut claims, mut excess) = (SweepCurve::new(), Vec::new(), 0.0);
        for &iterations in &all {
            let (variance, naive) = iteration.predicted(iterations);
            let found = lab.each_seed(runs, |seed| {
                let (mean, naive) = iteration.chain(seed, iterations);
                let off = mean[PATCH] - iteration.power[PATCH];
                (off * off, naive[PATCH], f64::from(u8::from(off.abs() <= Z * naive[PATCH].sqrt())))
            });
            let of =
                |pick: fn(&(f64, f64, f64)) -> f64| Measured::of(&found.iter().map(pick).collect::<Vec<_>>());
            let what = format!("{iterations} iterations: variance over that predicted");
            claims.push(Claim::equal(what, ratio(of(|f| f.0), variance[PATCH]), 1.0));
            let what =
                format!("{iterations} iterations: what the spread says, over what it is expected to say");
            claims.push(Claim::equal(what, ratio(of(|f| f.1), naive[PATCH]), 1.0));
            let covers = proportion(&found.iter().map(|f| f.2).collect::<Vec<_>>());
            excess = variance[PATCH] / naive[PATCH];
            coverage.push(iterations as f64, coverage_of(excess), covers);
        }
        claims.push(Claim::below("coverage at the end of the sweep", coverage.last(), 0.9));
        NaiveJacobiSweep { iterations: all, coverage, excess, claims }
    }

    /// The first and the last number of iterations.
    fn ends(&self) -> [usize; 2] {
        [self.iterations[0], self.iterations[self.iterations.len() - 1]]
    }

    fn chart(self, honest: Measured) -> Chart {
        let ends = self.ends().map(|iterations| iterations as f64);
        let [line, marks] = self.coverage.series("predicted", "seen, one chain");
        Chart {
            title: "Two rooms, R = 0.95: naive intervals of one chain".into(),
            x: Axis::log("iterations of the chain"),
            y: Axis::linear("part of the 95 % intervals that hold the truth"),
            series: vec![
                line,
                marks,
                Series::measured("remedy: eight independent chains", ends.map(|end| (end, honest))),
                Series::theory("95 %", ends.map(|end| (end, 0.95))),
            ],
        }
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let spec = scenes::two_rooms(0.1, REFLECTANCE);
    let exact = Exact::of_scene(&spec)?;
    let sweep = NaiveJacobiSweep::drive(lab, &JacobiIteration::new(&exact));
    let mut claims = sweep.claims.clone();
    let eight = experiment(&spec, Method::chains(1 << 12))?;
    let patches = receivers(&eight);
    let honest = coverage(lab, lab.pick(40, 200), &eight, 8, &patches, &exact.solution().radiosity);
    claims.push(Claim::at_least("coverage of eight chains' intervals", honest, 0.94).instead());
    let checks = run(&eight, 1, 8, None).checks;
    let of_spread = checks.iter().filter(|check| check.name == "vov");
    let messages: Vec<String> =
        of_spread.map(|check| format!("check `vov`, passes: {}", check.message)).collect();
    claims.push(Claim::messages(&messages, "Student's"));
    let [first, last] = sweep.ends();
    Ok(StudyFinding {
        predicted: format!(
            "An iteration carries the error of the one before, times R: in two rooms that exchange 1 %, R = \
             {REFLECTANCE}, errors live for dozens of iterations, and the mean of n iterations varies by far more \
             than s²/n. From the exact form factors, with P' = Φ + TP + ε and the covariance of ε of BS §4: {} times \
             after {last} iterations. Intervals of ± {Z}s/√n then cover 2Φ({Z}/√ratio) − 1 of the truths.",
            number(sweep.excess)
        ),
        seen: format!(
            "Of the naive 95 % intervals of a patch in the second room {} cover after {first} iterations of {RAYS} rays, {} \
             after {last}.",
            measured(sweep.coverage.seen_at(0)),
            measured(sweep.coverage.last())
        ),
        messages,
        instead: format!(
            "radwalk never takes the iterations, or the rays, of a chain for a sample: walk = \"jacobi\" runs eight \
             independent chains at least, whose intervals (Student's t) cover {} here. A single chain has no \
             standard error at all.",
            measured(honest)
        ),
        claims,
        chart: sweep.chart(honest),
    })
}
