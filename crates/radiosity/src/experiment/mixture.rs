//! Mixtures of sources: what the same walks say where each source is brighter or darker than in the scene.
//!
//! A walk of source s scores as if it carried a_s times its power, a_s being the factor of the source. A walk has one source,
//! so that of N walks Σ a_s·Σx_s and Σ a_s²·Σx_s² are the moments of the weighted scores: the births of walks were drawn
//! from all emitters, and the spread between sources is in them.

use std::collections::BTreeMap;

use stats::{Interval, Sample};

use super::Experiment;
use super::groups::{Class, Groups, Mixture};
use super::meaning::Meaning;
use crate::geometry::face::Face;
use crate::geometry::spec::{SceneSpec, Spectrum, SurfaceSpec};
use crate::scene::{IndexChoice, Scene, SceneError};
use crate::tally::Tally;

/// How much of what each class has scored counts.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    /// By class, in [0, 1]; one of them is 1, or all are 0.
    parts: Vec<f64>,
    /// What a part of 1 stands for; 0 where all parts are 0.
    scale: f64,
}

impl Shares {
    /// `factor` of each class.
    pub(super) fn new(groups: &Groups, factor: impl Fn(&Class) -> f64) -> Self {
        let factors: Vec<f64> = groups.classes.iter().map(factor).collect();
        let scale = factors.iter().copied().fold(0.0, f64::max);
        let part = |factor: &f64| if scale > 0.0 { factor / scale } else { 0.0 };
        Shares { parts: factors.iter().map(part).collect(), scale }
    }

    /// What a unit of score is worth.
    pub(super) fn scaled(&self, meaning: Meaning) -> Meaning {
        Meaning {
            irradiance_per_event: meaning.irradiance_per_event.map(|per_event| per_event * self.scale),
            irradiance_bias: meaning.irradiance_bias * self.scale,
            ..meaning
        }
    }

    /// The weighted scores of face i in one channel, and events. Where all that counts counts alike, sums are exact.
    pub(super) fn sample(&self, groups: &Groups, tally: &Tally, i: usize, channel: usize) -> (Sample, u128) {
        let n = tally.counts.walks;
        let counted = || groups.sums(tally, i, channel).zip(&self.parts).filter(|(_, part)| **part > 0.0);
        let add = |a: [u128; 3], b: [u128; 3]| std::array::from_fn(|column| a[column] + b[column]);
        let [sum, sum_sq, events] = counted().fold([0; 3], |total, (sums, _)| add(total, sums));
        if counted().all(|(_, part)| *part == 1.0) {
            return ((&stats::Moments { n, sum, sum_sq }).into(), events);
        }
        (Sample::weighted(n, counted().map(|([sum, sum_sq, _], part)| (*part, sum, sum_sq))), events)
    }

    /// The interval of the weighted mean [events], `unit` events being a unit of score, from the intervals that `interval` gives of sources with nearly the
    /// same part. Their half-widths go together as standard errors do (G. Y. Zou & A. Donner, Statistics in Medicine 27 (2008)
    /// 1693–1702), so that a bright source which no walk has brought here keeps its own upper limit, however often dim ones
    /// have come. Walks of one class are none of another: by as much as that lowers the standard error, it lowers the half-widths.
    pub(super) fn interval(
        &self,
        (groups, tally, i, channel): (&Groups, &Tally, usize, usize),
        (whole, unit): (&Sample, f64),
        interval: &dyn Fn(Sample) -> Interval,
    ) -> Interval {
        if whole.counts {
            return interval(*whole);
        }
        let n = tally.counts.walks;
        let mut of_sources = BTreeMap::<u32, (f64, u128, u128)>::new();
        // Walks of a source that has no light in the channel are known to bring none.
        let parts = self.parts.iter().zip(&groups.lit);
        let parts = parts.map(|(&part, lit)| if lit[channel] { part } else { 0.0 });
        let classes = groups.classes.iter().zip(groups.sums(tally, i, channel)).zip(parts);
        for ((class, [sum, sum_sq, _]), part) in classes.filter(|&(_, part)| part > 0.0) {
            let of_source = of_sources.entry(class.source).or_insert((part, 0, 0));
            *of_source = (part, of_source.1 + sum, of_source.2 + sum_sq);
        }
        let mut alike = BTreeMap::<u64, Vec<(f64, u128, u128)>>::new();
        for of_source in of_sources.into_values() {
            // What may have stayed out where nothing has come is bounded for all such sources together.
            let class = if of_source.1 > 0 { stats::size_class(of_source.0) } else { u64::MAX };
            alike.entry(class).or_default().push(of_source);
        }
        let (mut below, mut above, mut variance) = (0.0_f64, 0.0_f64, 0.0);
        for classes in alike.into_values() {
            let part = classes.iter().map(|&(part, ..)| part).fold(0.0, f64::max);
            let sample = sample_of(n, &classes, part);
            let (mean, Interval { low, high }) = (unit * sample.sum / n as f64, interval(sample));
            below = below.hypot(part * (mean - low));
            above = above.hypot(part * (high - mean));
            variance += part * part * sample.variance.unwrap_or(0.0);
        }
        let excluding = whole.variance.map_or(1.0, |whole| (whole / variance).sqrt().min(1.0));
        let mean = unit * whole.sum / n as f64;
        Interval { low: (mean - excluding * below).max(0.0), high: mean + excluding * above }
    }

    /// Whether a class counts.
    pub(super) fn counts(&self, class: usize) -> bool {
        self.parts[class] > 0.0
    }

    /// The face without what it emits, where its class does not count.
    pub(super) fn shown(&self, groups: &Groups, i: usize, face: Face) -> Face {
        match face.emittance.is_lit() && self.parts[groups.class_of(i)] == 0.0 {
            true => Face { emittance: Spectrum::BLACK, ..face },
            false => face,
        }
    }
}

/// The scores of classes of n walks, each times its part over `part`: exact where all parts are alike.
fn sample_of(n: u64, classes: &[(f64, u128, u128)], part: f64) -> Sample {
    if classes.iter().all(|class| class.0 == part) {
        let [sum, sum_sq] = classes.iter().fold([0; 2], |sums, class| [sums[0] + class.1, sums[1] + class.2]);
        return (&stats::Moments { n, sum, sum_sq }).into();
    }
    Sample::weighted(n, classes.iter().map(|&(of, sum, sum_sq)| (of / part, sum, sum_sq)))
}

impl Experiment {
    /// The experiment whose estimates are those of a mixture: each source emits `factors` times what it does in `spec`, the
    /// scene that is walked in. What is walked stays as it is.
    ///
    /// # Errors
    /// Where the mixture emits nothing, or power without end.
    ///
    /// # Panics
    /// Where there is not a factor for each source.
    pub fn with_mixture(mut self, spec: &SceneSpec, factors: &[f64]) -> Result<Self, SceneError> {
        let groups = self.groups().expect("sources are told apart");
        assert_eq!(groups.sources().len(), factors.len(), "a factor for each source");
        let spec = mixed(spec, self.scene(), groups, factors);
        let index = if self.scene.has_tree() { IndexChoice::Tree } else { IndexChoice::Flat };
        let scene = Scene::build(&spec, index)?;
        self.mixture = Some(Mixture { factors: factors.into(), scene }.into());
        Ok(self)
    }

    /// What is estimated in place of the light of the scene: a factor for each source. `None`: that light.
    pub fn mixture(&self) -> Option<&[f64]> {
        self.mixture.as_ref().map(|mixture| &mixture.factors[..])
    }

    /// The factor of a source, 1 where the light of the scene itself is estimated.
    pub(super) fn factor_of(&self, source: u32) -> f64 {
        self.mixture().map_or(1.0, |factors| factors[source as usize])
    }
}

/// A scene with other emittances.
fn mixed(spec: &SceneSpec, scene: &Scene, groups: &Groups, factors: &[f64]) -> SceneSpec {
    let faces = scene.faces();
    let emittance = |cell: u32| faces.piece(cell).emittance;
    let factor = |cell: u32| match emittance(cell).is_lit() {
        true => factors[groups.classes[groups.class_of(faces.face_of(cell) as usize)].source as usize],
        false => 1.0,
    };
    let scaled = |emittance: Spectrum, factor: f64| Spectrum::rgb(emittance.channels().map(|e| e * factor));
    let mut first = 0;
    let mut surface = |surface: &SurfaceSpec| {
        let cells = first..first + surface.shape.cell_count() as u32;
        first = cells.end;
        let of_emitters = || cells.clone().filter(|&cell| emittance(cell).is_lit());
        let Some(common) = of_emitters().next().map(factor) else { return surface.clone() };
        if of_emitters().all(|cell| factor(cell) == common) {
            let cell = |&(cell, emittance): &(u32, Spectrum)| (cell, scaled(emittance, common));
            let cell_emittance = surface.cell_emittance.iter().map(cell).collect();
            let emittance = scaled(surface.emittance, common);
            return SurfaceSpec { emittance, cell_emittance, ..surface.clone() };
        }
        let cell = |cell: u32| (cell - cells.start, scaled(emittance(cell), factor(cell)));
        let cell_emittance = cells.clone().map(cell).collect();
        SurfaceSpec { emittance: Spectrum::BLACK, cell_emittance, ..surface.clone() }
    };
    let mut mixed = SceneSpec { surfaces: spec.surfaces.iter().map(&mut surface).collect(), ..spec.clone() };
    for (number, lamp) in mixed.lamps.list.iter_mut().enumerate() {
        lamp.strength = scaled(lamp.strength, factors[groups.source_of_lamp(number)]);
    }
    mixed
}
