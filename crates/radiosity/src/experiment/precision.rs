//! How well a solution is known: the relative half-widths of its faces, over the area that light can reach.

use serde::{Deserialize, Serialize};

use super::solution::{Channels, Estimate, Estimates};
use crate::executor::ParallelFor;
use crate::geometry::face::Face;
use crate::scene::Scene;
use crate::scene::sealed::Sealed;
use crate::walk::Space;

/// The quantity whose half-widths are judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// H of every face that walks tell of, emitters and black faces included. Of a face that reflects and does not emit the relative
    /// half-width of H is that of B.
    #[default]
    Irradiance,
    /// B = E + R·H, of the faces that reflect. A black face has B = E exactly, and is not judged.
    Radiosity,
    /// E − (1 − R)·H: what leaves a face less what the face absorbs, of every face.
    Net,
}

impl Quantity {
    /// The word of the quantity in files.
    pub fn word(self) -> &'static str {
        match self {
            Quantity::Irradiance => "irradiance",
            Quantity::Radiosity => "radiosity",
            Quantity::Net => "net",
        }
    }

    /// The quantity in words.
    pub fn words(self) -> &'static str {
        match self {
            Quantity::Net => "net flux",
            _ => self.word(),
        }
    }

    /// What is known of the quantity in one channel of a face; `None` where it is known without any walk, or the estimator does
    /// not give it.
    pub fn of(self, face: &Face, channel: usize, estimate: &Estimate) -> Option<Judged> {
        let [reflectance, emittance] = [face.reflectance[channel], face.emittance[channel]];
        let half_width = |[low, high]: [f64; 2]| 0.5 * (high - low);
        let judged = match self {
            Quantity::Irradiance => {
                Judged { value: estimate.irradiance, half_width: half_width(estimate.irradiance_interval?) }
            }
            Quantity::Radiosity => Judged {
                value: estimate.known_radiosity(),
                half_width: half_width([estimate.ci_low, estimate.ci_high]),
            },
            Quantity::Net => Judged {
                value: estimate.irradiance.map(|h| emittance - (1.0 - reflectance) * h),
                half_width: (1.0 - reflectance) * half_width(estimate.irradiance_interval?),
            },
        };
        (judged.half_width > 0.0).then_some(judged)
    }

    /// The largest relative half-width of a face's channels; `None` where no channel is judged.
    pub fn relative_error(self, face: &Face, channels: &Channels) -> Option<f64> {
        let judged = channels.iter().enumerate().filter_map(|(c, estimate)| self.of(face, c, estimate));
        judged.map(|judged| judged.relative(0.0)).reduce(f64::max)
    }
}

/// An estimate that is judged [W/m²].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The estimate; `None` where nothing was scored.
    pub value: Option<f64>,
    /// Half of the interval's width, above 0.
    pub half_width: f64,
}

impl Judged {
    /// The half-width over the estimate, or over `floor` where that is more; infinite where both are 0.
    pub fn relative(&self, floor: f64) -> f64 {
        self.half_width / self.value.map_or(floor, |value| value.abs().max(floor))
    }
}

/// How well a solution is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Precision {
    /// The half-widths of the judged quantity.
    pub headline: Headline,
    /// Area-weighted root mean square of half-width over estimate, of the faces that reflect, do not emit, and were hit; where no face
    /// reflects without emitting, that of the irradiance of all faces that were hit. Infinite where none was.
    pub rms_relative_error: f64,
    /// The largest of them; infinite while one of these faces was never hit, and where there are none.
    pub max_relative_error: f64,
    /// The face that has it.
    pub worst_face: Option<u32>,
    /// Faces that light may come to, as far as is known, and that no walk has hit.
    pub unhit: FaceShare,
}

/// Half-widths over the area that light can reach. Each is divided by the larger of the estimate and a floor; that of a face that no
/// walk has hit is half of its bound, over the floor. Of a face that light reaches a part of, the part counts: its area, and of the floor, since
/// the mean over the face is that part of the mean over what is lit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Headline {
    /// The quantity that is judged.
    pub quantity: Quantity,
    /// The area of the judged faces [m²].
    pub area: f64,
    /// [`FLOOR`] of the area mean of the quantity's absolute value over the judged faces, channel by channel [W/m²].
    pub floor: [f64; 3],
    /// What the parts [`QUANTILES`] of the judged area do not exceed; infinite where nothing is known.
    pub quantiles: [f64; 3],
    /// The largest half-width of a judged face. Faces of less than [`TINY`] of the judged area are passed over, while together
    /// they are no more than the last of [`QUANTILES`] leaves out: the worst is not below any quantile.
    pub worst: f64,
    /// The face that has it.
    pub worst_face: Option<u32>,
    /// Its area [m²].
    pub worst_area: f64,
    /// The area of faces that no path of light joins to an emitter [m²] ([`crate::Sealed`]).
    pub sealed_area: f64,
}

/// The parts of the area that [`Headline::quantiles`] are about.
pub const QUANTILES: [f64; 3] = [0.5, 0.9, 0.99];

/// The floor of an estimate that a half-width is divided by, as a part of the area mean.
pub const FLOOR: f64 = 0.01;

/// A face of a smaller part of the area is not named as the worst where there are few such faces: no picture shows them, and few walks find them.
pub const TINY: f64 = 1e-6;

/// The size of a set of faces: their number, and their part of the area of all faces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceShare {
    /// The number of these faces.
    pub faces: u64,
    /// The part that they are of the area of all faces.
    pub area: f64,
}

impl FaceShare {
    /// Counts a face of this part of the area.
    pub fn add(&mut self, area: f64) {
        self.faces += 1;
        self.area += area;
    }
}

/// A face that is judged.
struct Ranked {
    face: u32,
    area: f64,
    /// The part of the area that light reaches.
    part: f64,
    is_hit: bool,
    channels: [Option<Judged>; 3],
}

impl Estimates<'_> {
    /// How well the faces are known, by the half-widths of a quantity. The executor runs the search for what light comes to.
    pub fn precision(&self, quantity: Quantity, executor: &ParallelFor) -> Precision {
        let mut ranks = Vec::new();
        let mut hit = vec![false; self.scene().faces().len()];
        let (mut of_dark, mut of_all) = (Spread::default(), Spread::default());
        for (i, face, channels) in self.known() {
            let is_unhit = channels.iter().any(Estimate::is_unsampled);
            hit[i] = !is_unhit;
            let judged = |c: usize| quantity.of(&face, c, channels.get(c)?);
            let ranked = [0, 1, 2].map(judged);
            if ranked.iter().any(Option::is_some) {
                ranks.push(Ranked {
                    face: i as u32,
                    area: face.area,
                    part: 1.0,
                    is_hit: !is_unhit,
                    channels: ranked,
                });
            }
            let unknown = channels.iter().enumerate().filter(|(c, _)| self.is_lit(*c));
            let errors = || unknown.clone().filter_map(|(c, e)| Quantity::Irradiance.of(&face, c, e));
            of_all.add(i, face.area, errors());
            if face.reflectance.is_lit() && !face.emittance.is_lit() {
                let reflects = unknown.clone().filter(|(c, _)| face.reflectance[*c] > 0.0);
                of_dark.add(i, face.area, reflects.filter_map(|(c, e)| Quantity::Irradiance.of(&face, c, e)));
            }
        }
        let reach = Reach::new(self, &hit, executor);
        let all: f64 = self.scene().faces().iter().map(|face| face.area).sum();
        let (mut unhit, mut sealed_area) = (FaceShare::default(), 0.0);
        ranks.retain_mut(|ranked| match reach.of(ranked.face, ranked.is_hit) {
            Place::Room { part } => {
                ranked.part = part;
                sealed_area += (1.0 - part) * ranked.area;
                if !ranked.is_hit {
                    unhit.add(part * ranked.area / all);
                }
                true
            }
            Place::Sealed => {
                sealed_area += ranked.area;
                false
            }
            Place::Sky => false,
        });
        let Spread { worst, .. } = if of_dark.faces > 0 { of_dark } else { of_all };
        let of = if of_dark.faces > 0 { &of_dark } else { &of_all };
        Precision {
            headline: Headline { sealed_area, ..headline(quantity, ranks) },
            rms_relative_error: if of.area > 0.0 { (of.squares / of.area).sqrt() } else { f64::INFINITY },
            max_relative_error: worst.map_or(f64::INFINITY, |(error, _)| error),
            worst_face: worst.map(|(_, face)| face),
            unhit,
        }
    }
}

/// Where a face is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// In the room, where light comes to this part of the face's area, above 0: headlines and targets are about such faces.
    Room {
        /// The part.
        part: f64,
    },
    /// Where no path of light was found to come, and no walk either.
    Sealed,
    /// On the box that stands for the sky ([`Scene::surfaces_before_sky`]).
    Sky,
}

/// Tells of faces where they are, by which of them walks have hit.
pub struct Reach<'a> {
    scene: &'a Scene,
    before_sky: usize,
    dark: Dark<'a>,
}

/// What light does not reach.
enum Dark<'a> {
    /// Nothing: every face was hit.
    Nowhere,
    /// Whole faces, between which light goes: groups of them, and which of the groups walks have hit.
    Faces(&'a Sealed, Vec<bool>),
    /// Parts of faces: by face, the part that light reaches.
    Parts(Vec<f64>),
}

impl<'a> Reach<'a> {
    /// The faces of a solved scene, each of which was `hit` or not. What walks have hit is reached by light, and so is all that is
    /// joined to it. Walks that go on from where they arrive light parts of faces, others whole faces.
    pub fn new(estimates: &Estimates<'a>, hit: &[bool], executor: &ParallelFor) -> Self {
        let scene = estimates.scene();
        let dark = match estimates.experiment().method().space() {
            _ if !hit.contains(&false) => Dark::Nowhere,
            Space::Discrete => {
                let sealed = scene.sealed();
                Dark::Faces(sealed, sealed.groups_with(|face| hit[face as usize]))
            }
            Space::Continuous => Dark::Parts(scene.lit_parts(hit, executor)),
        };
        Reach { scene, before_sky: scene.surfaces_before_sky(), dark }
    }

    /// Where a face is.
    pub fn of(&self, face: u32, is_hit: bool) -> Place {
        let part = match &self.dark {
            Dark::Parts(parts) => parts[face as usize],
            Dark::Faces(sealed, lit) if !is_hit => {
                sealed.group_of(face).map_or(1.0, |group| f64::from(u8::from(lit[group as usize])))
            }
            _ => 1.0,
        };
        match self.scene.faces().get(face as usize).surface as usize >= self.before_sky {
            true => Place::Sky,
            false if part == 0.0 => Place::Sealed,
            false => Place::Room { part },
        }
    }
}

/// Relative half-widths of some faces, none of which has a floor.
#[derive(Clone, Copy, Default)]
struct Spread {
    /// The sum of area × square, and of area, of the channels that were hit.
    squares: f64,
    area: f64,
    faces: u64,
    /// The largest, and its face.
    worst: Option<(f64, u32)>,
}

impl Spread {
    fn add(&mut self, face: usize, area: f64, channels: impl Iterator<Item = Judged>) {
        let mut error: Option<f64> = None;
        for judged in channels {
            let relative = judged.relative(0.0);
            if relative.is_finite() {
                self.squares += area * relative * relative;
                self.area += area;
            }
            error = Some(error.map_or(relative, |error| error.max(relative)));
        }
        let Some(error) = error else { return };
        self.faces += 1;
        if self.worst.is_none_or(|(worst, _)| error > worst) {
            self.worst = Some((error, face as u32));
        }
    }
}

/// The headline of judged faces.
fn headline(quantity: Quantity, ranks: Vec<Ranked>) -> Headline {
    let area = ranks.iter().fold(0.0, |sum, ranked| sum + ranked.part * ranked.area);
    let floor = [0, 1, 2].map(|c| {
        let value = |ranked: &Ranked| ranked.channels[c].and_then(|judged| judged.value).unwrap_or(0.0);
        FLOOR * ranks.iter().map(|ranked| ranked.area * value(ranked).abs()).sum::<f64>() / area
    });
    let error = |ranked: &Ranked| {
        let channels = ranked.channels.iter().zip(floor);
        channels
            .filter_map(|(judged, floor)| Some(judged.as_ref()?.relative(ranked.part * floor)))
            .fold(0.0, f64::max)
    };
    let mut errors: Vec<(f64, f64, u32)> =
        ranks.iter().map(|ranked| (error(ranked), ranked.part * ranked.area, ranked.face)).collect();
    errors.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.2.cmp(&a.2)));
    let worst = worst(&errors, area);
    Headline {
        quantity,
        area,
        floor: if area > 0.0 { floor } else { [0.0; 3] },
        quantiles: quantiles(&errors, area),
        worst: worst.map_or(f64::INFINITY, |(error, ..)| *error),
        worst_face: worst.map(|(.., face)| *face),
        worst_area: worst.map_or(0.0, |(_, of_face, _)| *of_face),
        sealed_area: 0.0,
    }
}

/// The worst of (error, area, face) by error, as [`Headline::worst`] says.
fn worst(ranks: &[(f64, f64, u32)], total: f64) -> Option<&(f64, f64, u32)> {
    let [.., last] = QUANTILES;
    let mut passed_over = 0.0;
    ranks.iter().rev().find(|(_, area, _)| {
        passed_over += area;
        *area >= TINY * total || passed_over > (1.0 - last) * total
    })
}

/// What [`QUANTILES`] of the area do not exceed, of (error, area, face) by error.
fn quantiles(ranks: &[(f64, f64, u32)], total: f64) -> [f64; 3] {
    QUANTILES.map(|part| {
        let mut below = 0.0;
        let reached = ranks.iter().find(|(_, area, _)| {
            below += area;
            below >= part * total * (1.0 - 1e-12)
        });
        reached.map_or(f64::INFINITY, |&(error, ..)| error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A large face of error 0.1, and `many` of half of [`TINY`] whose error is 2: these hold the worst as soon as they are a hundredth of the area.
    #[test]
    fn the_worst_is_not_below_a_quantile() {
        for (many, expected) in [(3, 0.1), (10_000, 0.1), (30_000, 2.0)] {
            let mut ranks = vec![(0.1, 1.0, 0)];
            ranks.extend((1..=many).map(|face| (2.0, 0.5 * TINY, face)));
            let total = ranks.iter().map(|(_, area, _)| area).sum();
            let (error, ..) = *worst(&ranks, total).unwrap();
            assert_eq!(error, expected, "{many} tiny faces");
            assert!(error >= quantiles(&ranks, total)[2]);
        }
        let alike: Vec<(f64, f64, u32)> = (0..2_000_000).map(|face| (f64::from(face), 1.0, face)).collect();
        assert!(worst(&alike, 2e6).is_some_and(|worst| worst.0 >= quantiles(&alike, 2e6)[2]), "all are tiny");
    }
}
