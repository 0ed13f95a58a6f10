//! The comparison of two results, for people and for programs.

use report::words::counted;
use serde_json::{Value, json};

use crate::diff::{Comparison, Difference, FALSE_ALARM, FEWEST_HITS, TOLD};

impl Comparison {
    /// The comparison in words, the verdict last.
    pub fn lines(&self) -> Vec<String> {
        let &Comparison { same_tally, compared, skipped, limit, mean_squared, beyond, ref largest } = self;
        let mut lines = Vec::new();
        if same_tally {
            lines.push("the tallies are the same, to the last bit".into());
        }
        let skipped = match skipped {
            0 => String::new(),
            skipped => format!("; {skipped} have fewer than {FEWEST_HITS} scores and are not"),
        };
        lines.push(format!("{} compared{skipped}", counted(compared as u64, "radiosity")));
        lines.push(format!("mean squared z: {mean_squared:.3} (1 is expected of runs with other seeds)"));
        lines.extend(largest.iter().take(beyond.max(1)).map(|Difference { place, channel, z, values }| {
            let [first, second] = values.map(|(value, error)| format!("{value:.6e} ± {error:.1e}"));
            let which = if beyond == 0 { "largest |z|:" } else { "beyond the limit:" };
            format!("{which} patch {}, {channel}: {first} and {second}, z = {z:.2}", place.join(" "))
        }));
        if beyond > TOLD {
            lines.push(format!("and {} more", beyond - TOLD));
        }
        let verdict = if beyond == 0 { "the results agree" } else { "the results differ" };
        lines.push(format!(
            "{verdict}: {beyond} beyond |z| = {limit:.2}, where chance alone brings any in 1 of {:.0} comparisons at most",
            1.0 / FALSE_ALARM
        ));
        lines
    }

    /// How the results differ; `None` where they agree.
    pub fn fault(&self) -> Option<String> {
        (self.beyond > 0).then(|| {
            format!(
                "{} of {} by more than {:.2} standard errors, which chance alone does once in {:.0} comparisons",
                self.beyond,
                counted(self.compared as u64, "radiosity"),
                self.limit,
                1.0 / FALSE_ALARM
            )
        })
    }

    /// The comparison as `--json` prints it.
    pub fn json(&self) -> Value {
        let largest =
            self.largest.iter().map(|Difference { place, channel, z, values: [first, second] }| {
                json!({"place": place, "column": channel, "z": z, "first": first, "second": second})
            });
        json!({
            "same_tally": self.same_tally,
            "compared": self.compared,
            "skipped": self.skipped,
            "limit": self.limit,
            "false_alarm": FALSE_ALARM,
            "beyond": self.beyond,
            "mean_squared_z": self.mean_squared,
            "agree": self.beyond == 0,
            "largest": largest.collect::<Vec<_>>(),
        })
    }
}
