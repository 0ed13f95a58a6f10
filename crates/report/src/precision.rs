//! How well the patches are known, as the summary shows it.

use std::collections::BTreeMap;

use radiosity::{
    Scene,
    precision::{FaceShare, Headline, Precision, Quantity},
};
use serde::{Serialize, Serializer};

use crate::patches::face_words;
use crate::words::{brief_percent, share};

/// [`Precision`] as the summary shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrecisionSummary {
    /// Area-weighted root mean square of half-width over estimate of the patches that reflect, do not emit, and were hit; where none
    /// reflects without emitting, of the irradiance of all that were hit.
    pub rms_relative_error: f64,
    /// The largest of them; infinite while one of these patches was never hit.
    pub max_relative_error: f64,
    /// The patch that has it.
    pub worst_patch: Option<u32>,
    /// The half-widths over the area that light can reach.
    pub headline: HeadlineSummary,
    /// What half, nine tenths and 99 hundredths of the area of the headline do not exceed.
    pub error_quantiles: BTreeMap<&'static str, f64>,
    /// Patches that light may come to and no walk has hit, and their part of the area.
    pub unhit: PatchShare,
}

/// [`Headline`] as the summary shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeadlineSummary {
    /// The quantity that is judged.
    #[serde(serialize_with = "quantity_word")]
    pub quantity: Quantity,
    /// The area that is judged [m²].
    pub area: f64,
    /// What an estimate counts for at least where a half-width is divided by it [W/m²]: a number, in colour three.
    #[serde(serialize_with = "one_or_three")]
    pub floor: Vec<f64>,
    /// The relative half-width that half of the area does not exceed.
    pub median: f64,
    /// The relative half-width that nine tenths of the area do not exceed.
    pub p90: f64,
    /// The relative half-width that 99 hundredths of the area do not exceed.
    pub p99: f64,
    /// The largest relative half-width of a patch that is not tiny.
    pub worst: f64,
    /// The patch that has it.
    pub worst_patch: Option<u32>,
    /// Its area [m²].
    pub worst_area: f64,
    /// The worst patch as messages name it.
    #[serde(skip)]
    pub worst_place: Option<String>,
    /// The area that no path of light joins to an emitter [m²].
    pub sealed_area: f64,
    /// The part that this is of the area of all patches.
    #[serde(skip)]
    pub sealed_part: f64,
}

/// Some patches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PatchShare {
    /// The number of these patches.
    pub patches: u64,
    /// Their part of the area of all patches.
    pub area: f64,
}

impl From<FaceShare> for PatchShare {
    fn from(FaceShare { faces, area }: FaceShare) -> Self {
        PatchShare { patches: faces, area }
    }
}

pub(crate) fn quantity_word<S: Serializer>(quantity: &Quantity, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(quantity.word())
}

fn one_or_three<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    match values {
        [only] => serializer.serialize_f64(*only),
        values => values.serialize(serializer),
    }
}

/// How far the answer of the discretised system is from that of the integral equation: the relative L2 distance of the irradiances of the
/// patches, over the area, with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DiscretisedSummary {
    /// The distance.
    pub distance: f64,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
}

impl DiscretisedSummary {
    /// The distance in words.
    fn words(&self) -> String {
        let [distance, low, high] = [self.distance, self.low, self.high].map(brief_percent);
        match self.low {
            0.0 => format!("{high} at most from the integral equation's answer"),
            _ => format!("{distance} ({low} … {high}) from the integral equation's answer"),
        }
    }
}

impl PrecisionSummary {
    pub(crate) fn new(scene: &Scene, precision: &Precision) -> Self {
        let patch = |face: Option<u32>| face.map(|face| scene.faces().get(face as usize).patch);
        let Headline { quantity, area, floor, quantiles, worst, worst_face, worst_area, sealed_area } =
            precision.headline;
        let all: f64 = scene.faces().iter().map(|face| face.area).sum();
        PrecisionSummary {
            rms_relative_error: precision.rms_relative_error,
            max_relative_error: precision.max_relative_error,
            worst_patch: patch(precision.worst_face),
            headline: HeadlineSummary {
                quantity,
                area,
                floor: floor[..scene.channels()].to_vec(),
                median: quantiles[0],
                p90: quantiles[1],
                p99: quantiles[2],
                worst,
                worst_patch: patch(worst_face),
                worst_area,
                worst_place: worst_face.map(|face| face_words(scene, face as usize)),
                sealed_area,
                sealed_part: sealed_area / all,
            },
            error_quantiles: ["0.5", "0.9", "0.99"].into_iter().zip(quantiles).collect(),
            unhit: precision.unhit.into(),
        }
    }
}

/// Half-widths beyond this say no more than that nothing is known: most are bounds of patches that no walk has hit.
const UNKNOWN: f64 = 10.0;

/// A relative half-width in words.
fn in_words(half_width: f64) -> String {
    match half_width > UNKNOWN {
        true => format!("beyond {}", brief_percent(UNKNOWN)),
        false => brief_percent(half_width),
    }
}

impl HeadlineSummary {
    /// The headline in words, of intervals of this level. `discretised`: the distance from the integral equation's answer, if it was
    /// examined, where the answer is that of the discretised system.
    pub fn line(
        &self,
        (confidence, simultaneous): (f64, bool),
        discretised: Option<Option<DiscretisedSummary>>,
    ) -> String {
        let all = if simultaneous { "simultaneous " } else { "" };
        let intervals = format!("{}, {all}{} % intervals", self.quantity.words(), 100.0 * confidence);
        let (system, distance) = match discretised {
            None => ("", String::new()),
            Some(None) => (
                ", of the discretised system",
                "; how far that is from the integral equation's answer was not examined".into(),
            ),
            Some(Some(known)) => (", of the discretised system", format!("; that is {}", known.words())),
        };
        let sealed = match self.sealed_part {
            0.0 => String::new(),
            part => format!(
                "; {} of the area is sealed: backs and gaps that no light reaches",
                brief_percent(part)
            ),
        };
        if self.area == 0.0 {
            return format!(
                "nothing to judge: no walk can tell of the {} of any patch{sealed}",
                self.quantity.words()
            );
        }
        if !self.median.is_finite() {
            return format!(
                "no walk has reached any patch: only upper bounds are known ({intervals}){sealed}"
            );
        }
        let place = self.worst_place.as_ref().map_or(String::new(), |place| format!(" ({place})"));
        format!(
            "relative half-width by area{system}: median {}, 90th percentile {}, 99th {}, worst {} on {} of the area{place}; {intervals}{distance}{sealed}",
            in_words(self.median),
            in_words(self.p90),
            in_words(self.p99),
            in_words(self.worst),
            share(self.worst_area / self.area)
        )
    }
}
