//! In which way the jobs of two results differ, and what that means for their answers.

use std::fs;
use std::path::Path;

use job::{Beside, Keyword, WalkKind};
use protocol::Checkpoint;
use radiosity::{
    Space,
    methods::{AbsorptionMode, InfiniteEnd},
};
use serde::Deserialize;

use crate::replica;
use crate::settings::Settings;

/// One way in which two jobs differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobDifference {
    /// The subject: `scene`, `patches`, `space`, `sources`, `light`, `method`, `end` or `seed`.
    pub subject: &'static str,
    /// What it is in either job.
    pub values: [String; 2],
    /// What follows for the two results.
    pub meaning: &'static str,
    /// Whether the answers that the results estimate are not the same.
    pub other_answer: bool,
}

/// What is known of the job of a result.
pub(super) struct JobFacts {
    scene_hash: Option<[u8; 32]>,
    /// `None` of a deterministic solution.
    settings: Option<Settings>,
}

/// The field of `exact.json` that tells the scene.
#[derive(Deserialize)]
struct OfExact {
    scene_hash: String,
}

impl JobFacts {
    /// The job of a tally.
    ///
    /// # Errors
    /// In words, where it cannot be read.
    pub(super) fn of_run(checkpoint: &Checkpoint) -> Result<Self, String> {
        let settings = replica::settings(&checkpoint.book.job)?;
        Ok(JobFacts { scene_hash: Some(checkpoint.scene_hash), settings: Some(settings) })
    }

    /// The job of a deterministic solution, whose summary may be missing.
    pub(super) fn of_exact(summary: &Path) -> Self {
        let read = fs::read(summary).ok().and_then(|bytes| serde_json::from_slice::<OfExact>(&bytes).ok());
        let hash = read.and_then(|read| blake3::Hash::from_hex(read.scene_hash).ok());
        JobFacts { scene_hash: hash.map(Into::into), settings: None }
    }

    fn space(&self) -> &'static str {
        self.settings.as_ref().map_or(Space::Discrete, |settings| settings.method.space).word()
    }

    fn method(&self) -> String {
        let Some(Settings { method, .. }) = &self.settings else { return "solved without walks".into() };
        let mut words = match method.walk {
            WalkKind::Jacobi => vec![method.walk.word()],
            walk => vec![walk.word(), method.estimator.word(), method.sampler.word()],
        };
        words.extend((method.beside == Beside::Slopes).then_some("linear"));
        words.join(" ")
    }

    /// How walks are cut off; `None` where chance alone ends them, and without walks.
    fn cutoff(&self) -> Option<InfiniteEnd> {
        let method = &self.settings.as_ref()?.method;
        let infinite =
            method.walk != WalkKind::Jacobi && method.estimator.absorption() == AbsorptionMode::Implicit;
        Some(method.infinite).filter(|end| infinite && end.is_biased())
    }

    /// The factors of the sources; `None` where there is one light.
    fn sources(&self) -> Option<String> {
        let Settings { sources, mixture, .. } = self.settings.as_ref()?;
        let factor = |i: usize| mixture.get(i).copied().unwrap_or(1.0);
        let scaled = sources.iter().enumerate().filter(|(i, _)| factor(*i) != 1.0);
        let scaled: Vec<String> =
            scaled.map(|(i, source)| format!("{} × {}", source.name, factor(i))).collect();
        Some(if scaled.is_empty() { "as written".into() } else { scaled.join(", ") })
    }
}

/// The ways in which two jobs differ, those first that change the answer.
pub(super) fn differences([a, b]: [&JobFacts; 2]) -> Vec<JobDifference> {
    let mut found = Vec::new();
    let mut hold = |subject, values: [String; 2], meaning, other_answer| {
        if values[0] != values[1] {
            found.push(JobDifference { subject, values, meaning, other_answer });
        }
    };
    if let (Some(first), Some(second)) = (a.scene_hash, b.scene_hash) {
        let short = |hash: [u8; 32]| format!("hash {}", &blake3::Hash::from_bytes(hash).to_hex()[..8]);
        let meaning =
            "geometry, patches, materials or lamps are written otherwise, so that the light may be other";
        hold("scene", [short(first), short(second)], meaning, true);
    }
    let both = a.settings.as_ref().zip(b.settings.as_ref());
    if let Some((first, second)) = both {
        let chosen =
            |settings: &Settings| if settings.forecast.is_some() { "chosen by a pilot" } else { "given" };
        let meaning = "means over other patches are other numbers";
        hold("patches", [first, second].map(|settings| chosen(settings).into()), meaning, true);
    }
    let meaning = "discrete transport solves the radiosity system of the patches, continuous walks the integral equation: the \
                   results differ by the error of discretisation, which more walks do not lessen";
    hold("space", [a, b].map(|job| job.space().into()), meaning, true);
    if both.is_some() {
        let sources = [a, b].map(|job| job.sources().unwrap_or_default());
        let meaning = "the results are of mixtures with other factors, which multiply what the sources emit";
        hold("sources", sources, meaning, true);
    }
    if let Some((first, second)) = both {
        let light = [first, second].map(|settings| settings.light.word().into());
        hold("light", light, "the numbers have other units", true);
    }
    let end = |job: &JobFacts| job.cutoff().map_or("no walk is cut off".into(), |end| format!("{end:?}"));
    let meaning = "a walk that is cut off leaves patches too dark, by `bias_bound` in patches.csv at most";
    hold("end", [a, b].map(end), meaning, true);
    let meaning = "the answers are the same, the errors are not";
    hold("method", [a, b].map(JobFacts::method), meaning, false);
    if let Some((first, second)) = both {
        let seeds = [first.seed, second.seed];
        if seeds[0] == seeds[1] {
            let same = "walks of one seed take the same random numbers: differences may be smaller than chance makes them";
            let difference = JobDifference {
                subject: "seed",
                values: seeds.map(|seed| seed.to_string()),
                meaning: same,
                other_answer: false,
            };
            let other_walks = !found.is_empty();
            found.extend(other_walks.then_some(difference));
        } else {
            hold(
                "seed",
                seeds.map(|seed| seed.to_string()),
                "the walks are independent, as z assumes",
                false,
            );
        }
    }
    found
}
