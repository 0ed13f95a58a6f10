//! The comparison of two results, for people and for programs.

use report::words::counted;
use serde_json::{Value, json};

use crate::diff::{Comparison, Difference, FALSE_ALARM, FEWEST_HITS, JobDifference, LISTED};

impl JobDifference {
    /// What the jobs differ in, or share where that matters, and what it means, in words.
    pub fn line(&self) -> String {
        let JobDifference { subject, values: [first, second], meaning, .. } = self;
        if first == second {
            format!("the jobs share the {subject} {first}; {meaning}")
        } else {
            format!("the jobs differ in {subject}: {first} against {second}; {meaning}")
        }
    }
}

impl Comparison {
    /// The comparison in words: how the jobs differ first, the verdict last.
    pub fn lines(&self) -> Vec<String> {
        let &Comparison { same_tally, compared, skipped, limit, mean_squared, beyond, ref largest, ref jobs } =
            self;
        let mut lines: Vec<String> = jobs.iter().map(JobDifference::line).collect();
        if same_tally {
            lines.push(
                match self.other_answer() {
                    false => "the tallies are the same, to the last bit",
                    true => "the walks are the same, to the last bit: what differs, differs by no chance",
                }
                .into(),
            );
        }
        let skipped = match skipped {
            0 => String::new(),
            skipped => format!("; {skipped} have fewer than {FEWEST_HITS} scores and are not"),
        };
        lines.push(format!("{} compared{skipped}", counted(compared as u64, "radiosity")));
        if !same_tally {
            lines.push(format!("mean squared z: {mean_squared:.3} (1 is expected of runs with other seeds)"));
        }
        let shown = if same_tally { beyond } else { beyond.max(1) };
        lines.extend(largest.iter().take(shown).map(|Difference { place, channel, z, values }| {
            let [first, second] = values.map(|(value, error)| format!("{value:.6e} ± {error:.1e}"));
            let which = match beyond {
                0 => "largest |z|:",
                _ if same_tally => "differs:",
                _ => "beyond the limit:",
            };
            format!("{which} patch {}, {channel}: {first} and {second}, z = {z:.2}", place.join(" "))
        }));
        if beyond > LISTED {
            lines.push(format!("and {} more", beyond - LISTED));
        }
        lines.push(match (beyond, same_tally) {
            (0, true) => "the results agree: they are the same".into(),
            (_, true) => format!("the results differ: {}", self.reason()),
            (beyond, false) => format!(
                "{}: {beyond} beyond |z| = {limit:.2}, where chance alone brings any in 1 of {:.0} comparisons at most{}",
                if beyond == 0 { "the results agree" } else { "the results differ" },
                1.0 / FALSE_ALARM,
                if beyond > 0 { self.expected() } else { String::new() }
            ),
        });
        lines
    }

    /// Whether the jobs differ in something that changes the answer.
    fn other_answer(&self) -> bool {
        self.jobs.iter().any(|job| job.other_answer)
    }

    /// A clause that names what makes the answers differ; empty where nothing does.
    fn expected(&self) -> String {
        let subjects: Vec<&str> =
            self.jobs.iter().filter(|job| job.other_answer).map(|job| job.subject).collect();
        match subjects.is_empty() {
            true => String::new(),
            false => format!("; jobs that differ in {} have other answers", subjects.join(" and ")),
        }
    }

    /// How results of the same walks differ, and why.
    fn reason(&self) -> String {
        let of = format!("{} of {}", self.beyond, counted(self.compared as u64, "radiosity"));
        match self.other_answer() {
            true => format!("{of}{}", self.expected()),
            false => format!(
                "{of}, though the tallies are the same: one table is not made from the tally beside it (it was changed, or \
                 another version wrote it); `radwalk report OUT` makes it again"
            ),
        }
    }

    /// How the results differ; `None` where they agree.
    pub fn fault(&self) -> Option<String> {
        (self.beyond > 0).then(|| match self.same_tally {
            true => self.reason(),
            false => format!(
                "{} of {} by more than {:.2} standard errors, which chance alone does once in {:.0} comparisons{}",
                self.beyond,
                counted(self.compared as u64, "radiosity"),
                self.limit,
                1.0 / FALSE_ALARM,
                self.expected()
            ),
        })
    }

    /// The comparison as `--json` prints it.
    pub fn json(&self) -> Value {
        let largest =
            self.largest.iter().map(|Difference { place, channel, z, values: [first, second] }| {
                json!({"place": place, "column": channel, "z": z, "first": first, "second": second})
            });
        let jobs = self.jobs.iter().map(|JobDifference { subject, values: [first, second], meaning, other_answer }| {
            json!({"subject": subject, "first": first, "second": second, "meaning": meaning, "other_answer": other_answer})
        });
        json!({
            "jobs": jobs.collect::<Vec<_>>(),
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
