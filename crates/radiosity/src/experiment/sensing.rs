//! What sensors make of samples: rays of their own gather what the walks of a sample, a batch or a chain have found of the
//! faces that they see.
//!
//! In a tally the rows of sensors follow those of faces: a row that counts samples and rays, then a row for each cell.
//! Where walks are samples of their own, sample s is that of walks s·n … (s + 1)·n − 1; it is booked with the last of them.
//! So a tally of any walks has its samples whole, however these were leased.

use std::ops::Range;

use super::Experiment;
use super::board::Scores;
use crate::geometry::face::Face;
use crate::geometry::sensor::Sensors;
use crate::jacobi::UNITS;
use crate::jacobi::faces::FaceTable;
use crate::jacobi::final_gather::{Gathered, sense};
use crate::method::Walks;
use crate::random::rng::Sequence;
use crate::random::sampling::cosine_direction;
use crate::tally::{Layout, Overflow, Tally};
use crate::trace::ray::{Hit, Ray};
use crate::walk::score::fixed_units;

/// Rays of sensors are this part of the rays of a sample, in all.
pub(super) const SENSING_PART: u64 = 4;

/// The rays of sensors of sample n are those of walk 2⁶³ + 2⁶² + n: no job has that number of walks, and no final
/// gather that number of batches.
const SENSING_RAYS: u64 = 3 << 62;

/// Walks between two questions whether to go on.
const WALKS_AT_ONCE: usize = 1 << 12;

/// What a board keeps for sensors.
#[derive(Clone, Debug)]
pub(crate) struct Sensing<const M: usize> {
    /// The walks that the scores of faces hold, where walks are samples of their own: those of a sample that is not done.
    pub(super) open: Range<u64>,
    /// What faces have scored before.
    done: Tally,
    /// The rows of sensors; `None` once a sum has left its range.
    sums: Option<Vec<u128>>,
    layout: Layout,
}

/// Units of score in the largest radiosity, for boards of `moments` power sums.
pub(super) fn units(moments: usize) -> f64 {
    fixed_units(moments).min(UNITS)
}

impl<const M: usize> Sensing<M> {
    pub(super) fn new(faces: usize, cells: usize, layout: Layout) -> Self {
        Sensing {
            open: 0..0,
            done: Tally::new(faces, layout),
            sums: Some(vec![0; (1 + cells) * layout.columns()]),
            layout,
        }
    }

    /// The next walk is number `walk`. Where it does not follow the open ones, their sample will be done elsewhere.
    pub(super) fn open_at(&mut self, walk: u64, scores: &mut Scores<M>) {
        if self.open.end != walk {
            if !self.open.is_empty() && scores.add_to(&mut self.done).is_err() {
                self.sums = None;
            }
            self.open = walk..walk;
        }
    }

    /// The sample of the open walks is done: all of it, those `before` the open ones included.
    pub(super) fn close(&mut self, scores: &mut Scores<M>, mut before: Tally) -> Result<Tally, Overflow> {
        self.open = self.open.end..self.open.end;
        let mut add = || {
            let own = scores.take()?;
            self.done.merge(&own).map_err(|_| Overflow)?;
            before.merge(&own).map_err(|_| Overflow)
        };
        match add() {
            Ok(()) => Ok(before),
            Err(Overflow) => {
                self.sums = None;
                Err(Overflow)
            }
        }
    }

    /// Scores what one sample of every cell has gathered: H over `largest`.
    pub(super) fn add(&mut self, largest: &[f64; 3], gathered: &[Gathered]) {
        let Layout { moments, events, .. } = self.layout;
        let last = self.layout.columns() - 1;
        let Some(sums) = &mut self.sums else { return };
        let mut rows = sums.chunks_exact_mut(self.layout.columns());
        let mut fits = true;
        let mut add = |sum: &mut u128, x: Option<u128>| match x.and_then(|x| sum.checked_add(x)) {
            Some(raised) => *sum = raised,
            None => fits = false,
        };
        let count = rows.next().expect("the row of samples");
        add(&mut count[0], Some(1));
        add(&mut count[1], Some(gathered.iter().map(|cell| u128::from(cell.rays)).sum()));
        for (row, Gathered { irradiance, landed, .. }) in rows.zip(gathered) {
            for (c, h) in irradiance.iter().enumerate() {
                let x = (h / largest[c] * units(M) + 0.5) as u128;
                let mut power = Some(1_u128);
                for sum in &mut row[c * moments..(c + 1) * moments] {
                    power = power.and_then(|power| power.checked_mul(x));
                    add(sum, power);
                }
            }
            if events {
                add(&mut row[last], Some(u128::from(*landed)));
            }
        }
        if !fits {
            self.sums = None;
        }
    }

    /// Hands over all that faces and sensors have scored.
    pub(super) fn take(&mut self, scores: &mut Scores<M>) -> Result<Tally, Overflow> {
        self.open = 0..0;
        let faces = self.done.patches();
        scores.add_to(&mut self.done)?;
        let done = std::mem::replace(&mut self.done, Tally::new(faces, self.layout));
        let rows = self.sums.as_ref().ok_or(Overflow)?.len();
        let of_sensors = self.sums.replace(vec![0; rows]).ok_or(Overflow)?;
        let counts = done.counts;
        let mut sums = done.into_sums();
        sums.extend(of_sensors);
        let patches = faces + rows / self.layout.columns();
        Ok(Tally::from_parts(counts, patches, self.layout, sums).expect("the layout is the board's own"))
    }
}

/// What some rays of a sensor meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorView {
    /// Sides that reflect and emit.
    pub active: u32,
    /// Backs of one-sided surfaces.
    pub backs: u32,
    /// Nothing.
    pub nothing: u32,
}

impl Experiment {
    /// What `rays` rays of a sensor meet, which are equal at every call.
    pub fn sensor_view(&self, sensor: usize, rays: u32) -> SensorView {
        let mut view = SensorView::default();
        let Some(sensors) = self.sensors() else { return view };
        let mut rng = Sequence::new(0).walk(SENSING_RAYS + sensor as u64);
        let mut ray = || {
            let place = rng.pair();
            let frame = sensors.frame(sensor);
            let direction = frame.direction(1.0, cosine_direction(rng.bits()));
            Ray { origin: frame.point(place).into(), direction: direction.into(), from: Ray::FREE }
        };
        let rays: Vec<Ray> = (0..rays).map(|_| ray()).collect();
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
    pub(super) fn sensed_walks<const M: usize>(
        &self,
        (plan, sensors): (&Walks, &Sensors),
        sequence: &Sequence,
        walks: Range<u64>,
        (scores, sensing): (&mut Scores<M>, &mut Sensing<M>),
        go_on: &dyn Fn() -> bool,
    ) {
        let size = sensors.sample_walks();
        let mut next = walks.start;
        while next < walks.end {
            let sample = next / size;
            let end_of_sample = (sample + 1) * size;
            let end = walks.end.min(end_of_sample);
            sensing.open_at(next, scores);
            self.single_walks(plan, sequence, next..end, scores);
            sensing.open.end = end;
            next = end;
            if end < end_of_sample {
                return;
            }
            let elsewhere = sample * size..sensing.open.start;
            let Some(before) = self.walked_elsewhere::<M>(plan, sequence, elsewhere, go_on) else { return };
            // Where a sum has left its range, the board says so when it is taken.
            let Ok(whole) = sensing.close(scores, before) else { return };
            let reflected = self.reflected_by_tally(&whole);
            let rays = whole.counts.rays / SENSING_PART;
            let Some(gathered) = self.sense(sensors, &reflected, rays, (sequence, sample), go_on) else {
                return;
            };
            sensing.add(&self.largest_radiosity, &gathered);
        }
    }

    /// The tally of walks of a sample that are not on the board.
    fn walked_elsewhere<const M: usize>(
        &self,
        plan: &Walks,
        sequence: &Sequence,
        walks: Range<u64>,
        go_on: &dyn Fn() -> bool,
    ) -> Option<Tally> {
        let faces = self.scene.faces().len();
        let mut tally = Tally::new(faces, self.layout::<M>());
        if walks.is_empty() {
            return Some(tally);
        }
        let mut scores = self.scores::<M>(faces);
        for first in walks.clone().step_by(WALKS_AT_ONCE) {
            if !go_on() {
                return None;
            }
            let end = walks.end.min(first + WALKS_AT_ONCE as u64);
            self.single_walks(plan, sequence, first..end, &mut scores);
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
    ) -> Option<Vec<Gathered>> {
        sense(
            &FaceTable::new(&self.scene),
            sensors,
            reflected,
            rays,
            sequence.walk(SENSING_RAYS + sample),
            go_on,
        )
    }

    /// b = R·H of every face, face-major and channel-minor [W/m²], as single walks tell it.
    fn reflected_by_tally(&self, tally: &Tally) -> Vec<f64> {
        let walks = tally.counts.walks as f64;
        let of_face = |(i, face): (usize, Face)| {
            (0..self.scene.channels()).map(move |c| {
                let meaning = self.meaning_of((i, &face), c, tally);
                let unit = meaning.and_then(|meaning| Some(meaning.unit * meaning.irradiance_per_event?));
                face.reflectance[c] * unit.unwrap_or(0.0) * (tally.patch(i, c)[0] as f64 / walks)
            })
        };
        self.scene.faces().iter().enumerate().flat_map(of_face).collect()
    }
}
