//! What sensors make of samples: rays of their own gather what the walks of a sample, a batch or a chain have found of the
//! faces that they see.
//!
//! In a tally the rows of sensors follow those of faces: a row that counts samples and rays, then a row for each cell.
//! Where walks are samples of their own, sample s is that of walks s·n … (s + 1)·n − 1; it is booked with the last of them.
//! So a tally of any walks has its samples whole, however these were leased.

use std::ops::Range;

use super::Experiment;
use super::board::{Scores, Sensing};
use crate::geometry::sensor::Sensors;
use crate::jacobi::faces::FaceTable;
use crate::jacobi::final_gather::{GatheredLight, SourcesOfLight, sense};
use crate::method::Walks;
use crate::random::rng::Sequence;
use crate::random::sampling::cosine_direction;
use crate::tally::Tally;
use crate::trace::ray::{Hit, Ray};

/// Rays of sensors are this part of the rays of a sample, in all.
pub(super) const SENSING_PART: u64 = 4;

/// The rays of sensors of sample n are those of walk 2⁶³ + 2⁶² + n: no job has that number of walks, and no final
/// gather that number of batches.
const SENSING_RAYS: u64 = 3 << 62;

/// Walks between two questions whether to go on.
const WALKS_AT_ONCE: usize = 1 << 12;

/// The numbers of a sensor's rays that meet active sides, backs, and nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorView {
    /// Sides that reflect and emit.
    pub active: u32,
    /// Backs of one-sided surfaces.
    pub backs: u32,
    /// Rays that met nothing.
    pub nothing: u32,
}

impl Experiment {
    /// What `rays` rays of a sensor meet, which are equal at every call.
    pub fn sensor_view(&self, sensor: usize, rays: u32) -> SensorView {
        let mut view = SensorView::default();
        let Some(sensors) = self.sensors() else { return view };
        let mut rng = Sequence::new(0).walk(SENSING_RAYS + sensor as u64);
        let frames = sensors.frames_of(sensor);
        let response = sensors.response(&sensors.cell(sensors.cells_of(sensor).start));
        let mut ray = |number: u32| {
            let place = rng.pair();
            let frame = &frames[number as usize % frames.len()];
            let direction = frame.direction(1.0, cosine_direction(rng.bits()));
            // Every eighth of a turn about a cylinder.
            let direction = response.turned(direction.into(), number << 29);
            Ray { origin: frame.point(place).into(), direction, from: Ray::FREE }
        };
        let rays: Vec<Ray> = (0..rays).map(&mut ray).collect();
        for hit in self.scene.closest_hits(&rays) {
            match hit {
                None => view.nothing += 1,
                Some(Hit { surface, side, .. }) => {
                    let is_active = self.scene.surfaces()[surface as usize].is_active(side);
                    *(if is_active { &mut view.active } else { &mut view.backs }) += 1;
                }
            }
        }
        view
    }

    /// Walks that are samples of their own, where there are sensors. The walks of a sample are scored apart, and when the last
    /// of them is done, sensors gather what all of them have found. Those that another lease holds are walked once more.
    pub(super) fn sensed_walks(
        &self,
        (plan, sensors): (&Walks, &Sensors),
        sequence: &Sequence,
        walks: Range<u64>,
        (scores, sensing): (&mut Scores, &mut Sensing),
        go_on: &dyn Fn() -> bool,
    ) {
        let size = sensors.sample_walks();
        let mut next = walks.start;
        while next < walks.end {
            let sample = next / size;
            let end_of_sample = (sample + 1) * size;
            let end = walks.end.min(end_of_sample);
            sensing.open_at(next, scores);
            self.single_walks(plan, (sequence, next..end), (scores, None), go_on);
            sensing.open.end = end;
            next = end;
            if end < end_of_sample {
                return;
            }
            let elsewhere = sample * size..sensing.open.start;
            let Some(before) = self.walked_elsewhere(plan, sequence, elsewhere, go_on) else { return };
            // Where a sum has left its range, the board says so when it is taken.
            let Ok(whole) = sensing.close(scores, before) else { return };
            let reflected = self.reflected_by_tally(&whole);
            let rays = whole.counts.rays / SENSING_PART;
            let Some(gathered) = self.sense(sensors, &reflected, rays, (sequence, sample), go_on) else {
                return;
            };
            sensing.add(&self.largest_at_sensors, &gathered);
        }
    }

    /// The tally of walks of a sample that are not on the board.
    fn walked_elsewhere(
        &self,
        plan: &Walks,
        sequence: &Sequence,
        walks: Range<u64>,
        go_on: &dyn Fn() -> bool,
    ) -> Option<Tally> {
        let rows = self.face_rows();
        let mut tally = Tally::new(rows, self.layout());
        if walks.is_empty() {
            return Some(tally);
        }
        let mut scores = self.scores(rows);
        for first in walks.clone().step_by(WALKS_AT_ONCE) {
            if !go_on() {
                return None;
            }
            let end = walks.end.min(first + WALKS_AT_ONCE as u64);
            self.single_walks(plan, (sequence, first..end), (&mut scores, None), go_on);
        }
        scores.add_to(&mut tally).expect("few walks do not wrap a sum");
        Some(tally)
    }

    /// H of every cell of the sensors, as sample number `sample` finds it by about `rays` rays, given the `reflected` light of
    /// all faces.
    pub(super) fn sense(
        &self,
        sensors: &Sensors,
        reflected: &[f64],
        rays: u64,
        (sequence, sample): (&Sequence, u64),
        go_on: &dyn Fn() -> bool,
    ) -> Option<Vec<GatheredLight>> {
        sense(
            &FaceTable::new(&self.scene),
            sensors,
            (reflected, self.sources_of_light().as_ref()),
            rays,
            sequence.walk(SENSING_RAYS + sample),
            go_on,
        )
    }

    /// b = R·H of every face, face-major, then by source where sources are distinguished, and channel-minor [W/m²], as single walks tell it. Each
    /// class of sources has rows of its own in the tally.
    pub(super) fn reflected_by_tally(&self, tally: &Tally) -> Vec<f64> {
        let walks = tally.counts.walks as f64;
        let (faces, channels) = (self.scene.faces().len(), self.scene.channels());
        let classes = self.groups().map_or(&[][..], |groups| &groups.classes);
        let source_of = |class: usize| classes.get(class).map_or(0, |class| class.source as usize);
        let mut reflected = vec![0.0; faces * channels * self.source_count().max(1)];
        let of_face = reflected.len() / faces;
        for (i, face) in self.scene.faces().iter().enumerate() {
            for c in 0..channels {
                let meaning = self.meaning_of((i, &face), c, tally);
                let unit = meaning.and_then(|meaning| Some(meaning.unit * meaning.irradiance_per_event?));
                let per_unit = face.reflectance[c] * unit.unwrap_or(0.0) / walks;
                for class in 0..classes.len().max(1) {
                    let sum = tally.patch(class * faces + i, c)[0] as f64;
                    reflected[i * of_face + source_of(class) * channels + c] += per_unit * sum;
                }
            }
        }
        reflected
    }

    /// Whose light faces and lamps emit, where sources are distinguished.
    pub(super) fn sources_of_light(&self) -> Option<SourcesOfLight> {
        let groups = self.groups().filter(|groups| !groups.sources().is_empty())?;
        let source = |emitter: usize| groups.classes[groups.class_of(emitter)].source as usize;
        let emitters = self.scene.faces().len() + self.scene.lamp_count();
        Some(SourcesOfLight {
            count: groups.sources().len(),
            of_emitter: (0..emitters).map(source).collect(),
        })
    }
}
