//! `radwalk diff`: two results of one scene, patch by patch.

use report::words::counted;
use results::{Comparison, Difference, FALSE_ALARM, FEWEST_HITS, TOLD};
use serde_json::{Value, json};
use voice::{Phase, say};

use crate::args::DiffArgs;
use crate::fault::{Fault, Outcome};

/// Compares two results, and fails where they differ.
pub(crate) fn diff(args: &DiffArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the results");
    let comparison = results::compare(&args.first, &args.second)?;
    drop(phase);
    if args.json {
        say(&json(&comparison).to_string());
    } else {
        describe(&comparison);
    }
    match comparison.beyond {
        0 => Ok(Outcome::Done),
        beyond => Err(Fault::Differ(format!(
            "{beyond} of {} by more than {:.2} standard errors, which chance alone does once in {:.0} comparisons",
            counted(comparison.compared as u64, "radiosity"),
            comparison.limit,
            1.0 / FALSE_ALARM
        ))),
    }
}

fn json(comparison: &Comparison) -> Value {
    let largest = comparison.largest.iter().map(|Difference { place, channel, z, values: [first, second] }| {
        json!({"place": place, "column": channel, "z": z, "first": first, "second": second})
    });
    json!({
        "same_tally": comparison.same_tally,
        "compared": comparison.compared,
        "skipped": comparison.skipped,
        "limit": comparison.limit,
        "false_alarm": FALSE_ALARM,
        "beyond": comparison.beyond,
        "mean_squared_z": comparison.mean_squared,
        "agree": comparison.beyond == 0,
        "largest": largest.collect::<Vec<_>>(),
    })
}

fn describe(comparison: &Comparison) {
    let &Comparison { same_tally, compared, skipped, limit, mean_squared, beyond, ref largest } = comparison;
    if same_tally {
        say("the tallies are the same, to the last bit");
    }
    let skipped = match skipped {
        0 => String::new(),
        skipped => format!("; {skipped} have fewer than {FEWEST_HITS} scores and are not"),
    };
    say(&format!("{} compared{skipped}", counted(compared as u64, "radiosity")));
    say(&format!("mean squared z: {mean_squared:.3} (1 is expected of runs with other seeds)"));
    for Difference { place, channel, z, values } in largest.iter().take(beyond.max(1)) {
        let [first, second] = values.map(|(value, error)| format!("{value:.6e} ± {error:.1e}"));
        say(&format!(
            "{} patch {}, {channel}: {first} and {second}, z = {z:.2}",
            if beyond == 0 { "largest |z|:" } else { "beyond the limit:" },
            place.join(" ")
        ));
    }
    if beyond > TOLD {
        say(&format!("and {} more", beyond - TOLD));
    }
    let verdict = if beyond == 0 { "the results agree" } else { "the results differ" };
    say(&format!(
        "{verdict}: {beyond} beyond |z| = {limit:.2}, where chance alone brings any in 1 of {:.0} comparisons at most",
        1.0 / FALSE_ALARM
    ));
}
