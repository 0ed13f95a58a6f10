//! What chosen patches leave out of the light, measured by walks that have not chosen them, and finer patches where it is much.

use job::{Auto, Cut, Forecast, Job};
use judge::partition::{Finer, Missed, PatchControl};
use radiosity::{EstimatorKind, Experiment, Scene, Sequence, Shape, Space, Walks, rays::Arrival};

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::pilot::{Chosen, ENOUGH, Steps, seed};

/// A control takes one of this many parts of the walks that the patches are for: fewer find cuts that chance favours. Of light that is taken for even, of
/// which nothing is predicted, it takes the second one.
const SHARES: [u64; 2] = [4, 16];

/// The least and the most walks of a control, where the budget allows the least.
const WALKS: [u64; 2] = [1 << 14, 1 << 18];

/// The least walks of a control of light that is taken for even, in runs of fewer walks too: nothing but a control can say that it is not.
const EVEN_WALKS: u64 = 1 << 17;

/// A control has this many arrivals at most, as far as the rays of a pilot predict: what hits tell does not depend on how many walks they are of, and all are kept
/// until they are counted.
const ARRIVALS: f64 = 4e6;

/// Patches are cut finer by what a control finds this many times at the most, …
const ROUNDS: u32 = 2;

/// … where cuts are expected to take this part of the energy of the whole error. What is expected is too much: the cuts are those that chance
/// favours.
const WORTH: f64 = 0.2;

/// A control is long enough where its standard error is this part of the energy of the total error that is asked for, …
const SHARP: f64 = 0.25;

/// … and is followed by a longer one where it is not: of this many times the walks that are expected to be long enough, …
const MARGIN: f64 = 1.2;

/// … but of this many times its own walks at the least and at the most: that light is uneven may take fewer.
const LONGER: [f64; 2] = [1.25, 6.0];

/// Light that was taken for even is not where a control finds that much left out, in standard errors.
const SURE: f64 = 2.0;

impl Chosen {
    /// The choice, cut finer where walks of a control let expect that it pays, and predicting the noise of its patches and what their fits leave out
    /// as walks find them that have not chosen them. It is the same whatever the threads.
    ///
    /// # Errors
    /// Where the scene is refused.
    pub(crate) fn controlled<E: From<Error>>(
        mut self,
        (job, auto): (&Job, &Auto),
        threads: usize,
        steps: &mut Steps<'_, E>,
    ) -> Result<Self, E> {
        let Some(forecast) = self.partition.forecast else { return Ok(self) };
        let mut controls = Controls::new((job, auto), forecast, threads);
        loop {
            let finer = match steps.kept()? {
                Some((found, finer)) => {
                    controls.found = found;
                    finer
                }
                None => {
                    let cells = (&self.partition.cuts[..], &self.partition.groups[..]);
                    self.scene = job.scene.recut(self.scene, cells).map_err(Error::from)?;
                    let experiment = shooting(self.scene.clone())?;
                    let finer = controls.look(&experiment, cells, steps)?;
                    steps.keep(&(controls.found, &finer))?;
                    finer
                }
            };
            let Some(finer) = finer else { break };
            (self.partition.cuts, self.partition.groups) = finer;
        }
        self.partition.linear = controls.found.forecast.linear;
        self.partition.forecast = Some(controls.found.forecast);
        Ok(self)
    }

    /// Whether its groups of faces are predicted to err by less than the noise of fits to each face, by a control of its own; all its walks and rays; and a scene of
    /// the surfaces.
    ///
    /// # Errors
    /// Where the scene is refused.
    pub(crate) fn groups_pay<E: From<Error>>(
        self,
        (job, auto): (&Job, &Auto),
        threads: usize,
        steps: &mut Steps<'_, E>,
    ) -> Result<(bool, [u64; 2], Scene), E> {
        if let Some((pay, counted)) = steps.kept()? {
            return Ok((pay, counted, self.scene));
        }
        let mut controls = Controls::new((job, auto), self.forecast(), threads);
        let Chosen { partition, mut scene } = self;
        // Walks that judge whether to group do not judge the groups.
        controls.found.seed = seed(!job.seed);
        let mut pay = false;
        if !partition.groups.is_empty() {
            let cells = (&partition.cuts[..], &partition.groups[..]);
            scene = job.scene.recut(scene, cells).map_err(Error::from)?;
            pay = controls.do_groups_pay(&shooting(scene.clone())?, steps)?;
        }
        let Forecast { paths, rays, .. } = controls.found.forecast;
        steps.keep(&(pay, [paths, rays]))?;
        Ok((pay, [paths, rays], scene))
    }
}

/// The walks of a control.
fn shooting(scene: Scene) -> Result<Experiment, Error> {
    let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Collision) };
    Ok(Experiment::new(scene, walks)?)
}

/// The walks of a control of patches whose fits are expected to leave out this energy.
fn walks_of(forecast: &Forecast, predicted: f64) -> u64 {
    let rays = forecast.rays as f64 / forecast.paths.max(1) as f64;
    let most = WALKS[1].min((ARRIVALS / rays.max(1.0)) as u64);
    let (share, least) = match predicted > 0.0 {
        true => (SHARES[0], WALKS[0].min(forecast.for_paths)),
        false => (SHARES[1], EVEN_WALKS.min(most)),
    };
    (forecast.for_paths / share).clamp(least, most.max(least))
}

/// The controls of a choice, one after the other.
struct Controls<'a> {
    job: &'a Job,
    auto: &'a Auto,
    threads: usize,
    found: ControlState,
}

/// The state of the controls so far: their walks, and the errors that they found.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct ControlState {
    /// The seed of the latest.
    seed: u64,
    /// The walks of the next one.
    walks: u64,
    /// How often the patches have been chosen anew since the pilot's choice.
    round: u32,
    forecast: Forecast,
    /// The energy that the fits are expected to leave out, as a part of that of the light, before a control measures it.
    predicted: f64,
    /// The energy of the noise, by the pilot, and by a control of the patches that the pilot has chosen.
    noise: [f64; 2],
}

/// The cut of each surface and the patch of each cell, as in [`job::Partition`].
type PatchLayout = (Vec<Cut>, Vec<u32>);

impl<'a> Controls<'a> {
    fn new((job, auto): (&'a Job, &'a Auto), forecast: Forecast, threads: usize) -> Self {
        let [noise, predicted] = [forecast.noise, forecast.discretisation].map(|part| part * part);
        // Neither the walks of a pilot nor those of a first look.
        let seed = seed(seed(job.seed));
        let walks = walks_of(&forecast, predicted);
        let found = ControlState { seed, walks, round: 0, forecast, predicted, noise: [noise, 0.0] };
        Controls { job, auto, threads, found }
    }

    /// Takes down what a control measures of the patches. Returns the patches that another control has to measure: finer ones where these are expected
    /// to pay, or the same again.
    fn look<E: From<Error>>(
        &mut self,
        experiment: &Experiment,
        cells: (&[Cut], &[u32]),
        steps: &mut Steps<'_, E>,
    ) -> Result<Option<PatchLayout>, E> {
        // A seed of its own, so that what few walks happen to find does not bend the prediction.
        self.found.seed = seed(self.found.seed);
        let control = PatchControl::new(experiment, self.found.walks);
        let groups = self.walked(&control, steps)?;
        Ok(self.judge((&control, &groups), cells))
    }

    /// Takes down what the arrivals of a control say. Returns the patches that another control has to measure.
    fn judge(
        &mut self,
        (control, groups): (&PatchControl<'_>, &[Vec<Arrival>]),
        cells: (&[Cut], &[u32]),
    ) -> Option<PatchLayout> {
        let missed = control.missed(groups, self.found.forecast.linear)?;
        let round = self.found.round;
        let same = || Some((cells.0.to_vec(), cells.1.to_vec()));
        if round == 0 && self.is_uneven(missed) {
            // More walks cut the surfaces.
            let missed = control.missed(groups, true)?;
            let Missed { noise, energy, .. } = missed;
            let found = &mut self.found;
            found.forecast.linear = true;
            found.predicted = missed.with(0.0);
            found.noise = [noise / energy / found.forecast.for_paths as f64; 2];
            found.walks = found.walks.max(walks_of(&found.forecast, found.predicted));
            found.round = 1;
            return same();
        }
        self.take_down(missed, round);
        if self.found.forecast.linear && round < ROUNDS {
            let finer = self.finer((control, groups), cells, missed.energy);
            if finer.is_some() {
                self.found.round += 1;
                return finer;
            }
        }
        // Fewer walks would leave open whether the patches keep within the error that is asked for.
        self.found.walks = self.longer(missed)?;
        same()
    }

    /// The walks of a longer control of the same patches, where one is to say whether they keep within the total error that is asked for.
    fn longer(&self, missed: Missed) -> Option<u64> {
        let ControlState { forecast, walks, .. } = self.found;
        let asked = self.job.total_target?.total_error.powi(2);
        let sharp = SHARP * asked;
        // Of the fits' loss the least that is likely, and of the noise that after as many walks as the pilot is large enough for.
        let [least, noise] = [missed.part - SURE * missed.error, forecast.noise.powi(2) / ENOUGH as f64];
        let rays = forecast.rays as f64 / forecast.paths.max(1) as f64;
        let most = self.job.budget.paths.min((ARRIVALS / rays.max(1.0)) as u64);
        let times = (MARGIN * missed.error / sharp).clamp(LONGER[0], LONGER[1]);
        let is_open = least < asked && noise < asked && missed.error > sharp;
        (is_open && walks < most).then(|| most.min((times * walks as f64) as u64))
    }

    /// Whether light that was taken for even is not, and linear fits may be had.
    fn is_uneven(&self, missed: Missed) -> bool {
        let ControlState { forecast, predicted, noise: [noise, _], .. } = self.found;
        let is_taken_for_even = !forecast.linear && self.auto.linear && predicted == 0.0;
        is_taken_for_even && missed.part > SURE * missed.error && missed.part > WORTH * (noise + missed.part)
    }

    /// Whether the whole error of groups is less than the noise alone of fits to each face.
    fn do_groups_pay<E: From<Error>>(
        &mut self,
        experiment: &Experiment,
        steps: &mut Steps<'_, E>,
    ) -> Result<bool, E> {
        let control = PatchControl::new(experiment, self.found.walks);
        let groups = self.walked(&control, steps)?;
        let Some(missed) = control.missed(&groups, self.found.forecast.linear) else { return Ok(true) };
        self.take_down(missed, 0);
        let ControlState { forecast, .. } = self.found;
        let of_faces = control.noise_of_surfaces(&groups) / missed.energy / forecast.for_paths as f64;
        Ok(forecast.total().powi(2) < of_faces)
    }

    /// What a control tells of the whole error.
    fn take_down(&mut self, missed: Missed, round: u32) {
        let found = &mut self.found;
        let noise = missed.noise / missed.energy / found.forecast.for_paths as f64;
        if round == 0 {
            found.noise[1] = noise;
        }
        let [of_pilot, of_chosen] = found.noise;
        found.forecast.noise = (of_pilot + noise - of_chosen).max(0.0).sqrt();
        found.forecast.discretisation = missed.with(found.predicted).sqrt();
    }

    /// Finer patches, if they are expected to pay. What their fits leave out is then expected to be no more than their noise, since cuts go on until
    /// they pay no more.
    fn finer(
        &mut self,
        (control, groups): (&PatchControl<'_>, &[Vec<Arrival>]),
        cells: (&[Cut], &[u32]),
        energy: f64,
    ) -> Option<PatchLayout> {
        let ControlState { forecast, .. } = self.found;
        let [of_chosen, lost] = [forecast.noise, forecast.discretisation].map(|part| part * part);
        let worth = WORTH * (of_chosen + lost);
        if lost < worth {
            return None;
        }
        let is_open = |surface: usize| can_be_cut(self.job, self.auto, surface);
        let Finer { cuts, groups, noise, gained } =
            control.finer(groups, cells, is_open, forecast.for_paths as f64)?;
        let [noise, gained] = [noise, gained].map(|part| part / energy);
        if gained.min(lost) - noise < worth {
            return None;
        }
        let balanced = of_chosen + noise;
        self.found.predicted = match self.found.predicted > 0.0 {
            true => self.found.predicted.min(balanced),
            false => balanced,
        };
        Some((cuts, groups))
    }

    /// The arrivals of all groups of a control. Its walks and rays are added to those of the pilot.
    fn walked<E: From<Error>>(
        &mut self,
        control: &PatchControl<'_>,
        steps: &mut Steps<'_, E>,
    ) -> Result<Vec<Vec<Arrival>>, E> {
        let sequence = Sequence::new(self.found.seed);
        let group = |number| control.group(number, &sequence);
        let groups = steps.groups(PatchControl::GROUPS, self.threads, group)?;
        let (groups, counts): (Vec<Vec<Arrival>>, Vec<[u64; 2]>) = groups.into_iter().unzip();
        for [paths, rays] in counts {
            self.found.forecast.paths += paths;
            self.found.forecast.rays += rays;
        }
        Ok(groups)
    }
}

/// Whether a surface may be cut into parts of different sizes: one that is open, and has no cells of its own. Those of a triangle are groups.
fn can_be_cut(job: &Job, auto: &Auto, surface: usize) -> bool {
    let shape = &job.scene.spec().surfaces[surface].shape;
    let can_be_grouped = !auto.kinds.is_empty();
    auto.surfaces.binary_search(&surface).is_ok()
        && shape.cell_count() == 1
        && (can_be_grouped || !matches!(shape, Shape::Triangle { .. }))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use job::Partition;
    use radiosity::IndexChoice;

    use super::*;
    use crate::PilotStage;

    /// That a pilot predicts what its patches leave out is no reason to leave it out, nor that it takes the light for even: cuts that pay are
    /// taken, and less is left.
    #[test]
    fn light_that_is_predicted_to_be_left_out_is_cut_too() {
        const PATHS: u64 = 100_000;
        let folder = tempfile::tempdir().unwrap();
        let mut spec = scenes::cube_with_tile(0.1, 0.5);
        spec.surfaces[0].emittance = 1.0.into();
        fs::write(folder.path().join("scene.toml"), job::to_toml(&spec)).unwrap();
        let path = folder.path().join("job.toml");
        fs::write(&path, "[scene]\nfile = \"scene.toml\"\npatches = \"auto\"\n").unwrap();
        let job = job::load(&path, &[format!("budget.paths={PATHS}")]).unwrap();
        let cuts = vec![Cut::Grid([1, 1]); spec.surfaces.len()];
        let scene = job.scene.build_cut((&cuts[..], &[][..]), IndexChoice::Auto).unwrap();
        for (linear, discretisation) in [(true, 1.0), (false, 0.0)] {
            let forecast = Forecast {
                surfaces: cuts.len() as u64,
                paths: 0,
                rays: 0,
                linear,
                for_paths: PATHS,
                noise: 0.01,
                discretisation,
            };
            let partition = Partition {
                cuts: cuts.clone(),
                groups: Vec::new(),
                linear,
                space: Space::Continuous,
                forecast: Some(forecast),
            };
            let auto = job.auto.as_ref().unwrap();
            let chosen = Chosen { partition, scene: scene.clone() };
            let mut runner = |_: &PilotStage| -> Result<_, Error> { unreachable!("the pilot is over") };
            let mut steps = Steps::new((&job, auto), &mut runner);
            let finer = chosen.controlled((&job, auto), 2, &mut steps).unwrap().partition;
            let patches: u64 = finer.cuts.iter().map(Cut::cells).sum();
            let forecast = finer.forecast.unwrap();
            assert!(finer.linear && patches > 20 && forecast.discretisation < 0.2, "{patches}, {forecast:?}");
        }
    }
}
