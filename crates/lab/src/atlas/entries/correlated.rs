//! Entry of the atlas: correlated sequences, a mistake made on purpose.

use radiosity::Sequence;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use report::{Axis, Chart, Series};
use stats::Measured;

use crate::atlas::entry::{Entry, StudyFinding};
use crate::claim::Claim;
use crate::lab::Lab;
use crate::walking::Failure;
use report::words::{measured, number};

pub(crate) const ENTRY: Entry =
    Entry { name: "correlated-sequences", title: "Sequences of walks that are not independent", study };

/// The number of sequences side by side.
const SEQUENCES: u64 = 1024;

/// The variance of the mean of `steps` uniform numbers, each from a sequence of its own, over that of independent
/// numbers; the mean over many steps of all sequences.
fn excess(steps: usize, mut draw: impl FnMut(usize) -> f64) -> Measured {
    let sequences = SEQUENCES as usize;
    let squares: Vec<f64> = (0..steps)
        .map(|_| {
            let sum: f64 = (0..sequences).map(|i| draw(i) - 0.5).sum();
            sum * sum * 12.0 / sequences as f64
        })
        .collect();
    Measured::of(&squares)
}

/// The excess of PCG64 whose sequences are 2^`power` draws apart.
fn placed(power: u32, steps: usize) -> Measured {
    let mut states: Vec<Pcg64> = Vec::new();
    let mut state = Pcg64::seed_from_u64(7);
    for _ in 0..SEQUENCES {
        states.push(state.clone());
        state.advance(1 << power);
    }
    excess(steps, |i| (states[i].next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
}

/// The excess of radwalk's own sequences.
fn placed_by_golden_ratio(steps: usize) -> Measured {
    let sequence = Sequence::new(7);
    let mut walks: Vec<_> = sequence.walks_from(0).take(SEQUENCES as usize).collect();
    excess(steps, |i| walks[i].pair()[0])
}

fn chart(marks: Vec<(f64, Measured)>, ours: Measured) -> Chart {
    let first = marks[0].0;
    Chart {
        title: format!("Means over {SEQUENCES} sequences that are placed 2^k draws apart"),
        x: Axis::linear("k"),
        y: Axis::log("variance over that of independent numbers"),
        series: vec![
            Series::theory("independent", marks.iter().map(|&(power, _)| (power, 1.0))),
            Series::measured("PCG64 (XSL-RR)", marks),
            Series::measured("PCG64-DXSM, walks placed by the golden ratio", [(first, ours)]),
        ],
    }
}

fn study(lab: &Lab) -> Result<StudyFinding, Failure> {
    let steps = lab.pick(2000, 20_000);
    let distances = lab.pick(vec![64, 100], vec![40, 52, 64, 76, 88, 100, 112, 120]);
    let marks: Vec<(f64, Measured)> =
        distances.iter().map(|&power| (f64::from(power), placed(power, steps))).collect();
    let ours = placed_by_golden_ratio(steps);
    let &worst = marks.iter().max_by(|a, b| a.1.value.total_cmp(&b.1.value)).expect("a sweep has points");
    let third = worst.1.value / 3.0;
    let narrow = marks.iter().any(|(power, found)| *power == 100.0 && found.value > 4.0);
    let claims = vec![
        Claim::equal("radwalk's walks: variance over that of independent numbers", ours, 1.0).instead(),
        Claim::below("independent ones have less than a third of the worst of the sweep", ours, third),
        Claim::sure("2^100 draws apart intervals are more than twice too narrow", narrow),
    ];
    Ok(StudyFinding {
        predicted: "The mean of m independent uniform numbers has the variance 1/(12m). Sequences of one linear \
                    congruential generator modulo 2¹²⁸ that are 2^k draws apart share the low bits of their \
                    states, all but 128 − k, and a weak output function (PCG64's XSL-RR) does not hide it: neighbours \
                    move together, and every interval is too narrow by as much."
            .into(),
        seen: format!(
            "Over {SEQUENCES} sequences of PCG64, 2^{} draws apart, the variance is {} times that of independent \
             numbers: intervals are {} times too narrow.",
            worst.0,
            measured(worst.1),
            number(worst.1.value.sqrt())
        ),
        messages: vec![
            "nothing: no option places walks; a job has one sequence, and walk n its place in it. `drift` compares \
             halves of a run, but walks that move together do so in both"
                .into(),
        ],
        instead: format!(
            "What radwalk does: PCG64-DXSM, walk n at n·G draws, G = 2¹²⁸ over the golden ratio: {}.",
            measured(ours)
        ),
        claims,
        chart: chart(marks, ours),
    })
}
