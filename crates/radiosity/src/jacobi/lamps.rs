//! Points of emitters, to which shadow rays go.

use crate::geometry::cells::EDGE;
use crate::geometry::face::Face;
use crate::jacobi::faces::FaceTable;
use crate::random::rng::unit_32;

/// The pieces that emit, each with its part of the shadow rays.
pub(super) struct EmittingPieces {
    pub(super) list: Vec<EmittingPiece>,
    /// The parts of all lamps before each, and of all.
    cumulated: Vec<f64>,
}

/// A piece that emits.
pub(super) struct EmittingPiece {
    pub(super) piece: Face,
    /// The face that the piece is a part of.
    pub(super) face: u32,
    /// The part of the shadow rays that go there: its part of Φ_T.
    pub(super) part: f64,
}

impl EmittingPieces {
    /// The emitters of a scene; none where nothing emits.
    pub(super) fn new(faces: &FaceTable) -> Self {
        let of_scene = faces.scene.faces();
        let (pieces, parts) = pieces_with_parts(faces, &emitted_shares(faces));
        let lamp = |(&piece, &part)| EmittingPiece {
            piece: of_scene.piece(piece),
            face: of_scene.face_of(piece),
            part,
        };
        let mut sum = 0.0;
        let cumulated = parts.iter().map(|part| {
            sum += part;
            sum
        });
        let cumulated = std::iter::once(0.0).chain(cumulated).collect();
        EmittingPieces { list: pieces.iter().zip(&parts).map(lamp).collect(), cumulated }
    }

    /// The number of the lamp that 32 random bits choose, and what they leave undecided: a uniform number in (0, 1).
    pub(super) fn choose(&self, bits: u32) -> (usize, f64) {
        let place = unit_32(bits) * self.cumulated[self.list.len()];
        let number = self.cumulated.partition_point(|&before| before <= place).clamp(1, self.list.len()) - 1;
        let [before, after] = [self.cumulated[number], self.cumulated[number + 1]];
        (number, ((place - before) / (after - before)).clamp(EDGE, 1.0 - EDGE))
    }
}

/// k = cos θ cos θ′/(πr²) between two points [1/m²], given both cosines and their distance r: 0 where one is behind the other,
/// infinite where they are one point.
pub(super) fn kernel(leaves: f64, arrives: f64, distance: f64) -> f64 {
    let kernel = leaves * arrives / (std::f64::consts::PI * distance * distance);
    if leaves > 0.0 && arrives > 0.0 && !kernel.is_nan() { kernel } else { 0.0 }
}

/// The power that faces emit in one channel [W].
pub(super) fn emitted_power(faces: &FaceTable, channel: usize) -> f64 {
    match faces.scene.lamp_count() {
        0 => faces.scene.total_power(channel),
        _ => faces.list.iter().zip(&faces.areas).map(|(face, area)| face.emittance[channel] * area).sum(),
    }
}

/// The part of shadow rays that each face should get: its part of the power that faces emit, the mean of the channels that have light.
pub(crate) fn emitted_shares(faces: &FaceTable) -> Vec<f64> {
    let scene = faces.scene;
    if (0..scene.channels()).all(|c| scene.total_power(c) == 0.0) {
        return Vec::new();
    }
    let emitted = (0..scene.channels()).map(|c| (c, emitted_power(faces, c)));
    let lit: Vec<(usize, f64)> = emitted.filter(|&(_, power)| power > 0.0).collect();
    let share = |(face, area): (&Face, &f64)| {
        let part = |&(c, power): &(usize, f64)| face.emittance[c] * area / power;
        lit.iter().map(part).sum::<f64>() / lit.len().max(1) as f64
    };
    faces.list.iter().zip(&faces.areas).map(share).collect()
}

/// The pieces of the faces with a part of shadow rays, each with its part of that: by area.
pub(super) fn pieces_with_parts(faces: &FaceTable, share: &[f64]) -> (Vec<u32>, Vec<f64>) {
    let of_scene = faces.scene.faces();
    let pieces = |(face, share): (usize, &f64)| {
        let (share, alone) = (*share, of_scene.pieces(face).nth(1).is_none());
        let part = move |piece: u32| match alone {
            true => share,
            false => share * (of_scene.piece(piece).area / faces.areas[face]),
        };
        of_scene.pieces(face).map(move |piece| (piece, part(piece)))
    };
    share.iter().enumerate().filter(|(_, share)| **share > 0.0).flat_map(pieces).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SceneSpec;
    use crate::scene::{IndexChoice, Scene};

    /// Even numbers choose each lamp as often as its power asks, and leave even numbers.
    #[test]
    fn lamps_are_chosen_by_power() {
        let mut spec = SceneSpec::furnace(2, 0.5);
        for (surface, emittance) in spec.surfaces.iter_mut().zip([1.0, 0.0, 3.0, 0.0, 0.0, 0.0]) {
            surface.emittance = emittance.into();
        }
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let lamps = EmittingPieces::new(&FaceTable::new(&scene));
        assert_eq!(lamps.list.len(), 8);
        let (mut chosen, mut rests) = ([0.0; 8], [0.0; 8]);
        const NUMBERS: u32 = 1 << 16;
        for number in 0..NUMBERS {
            let (lamp, rest) = lamps.choose(number << 16);
            (chosen[lamp], rests[lamp]) = (chosen[lamp] + 1.0, rests[lamp] + rest);
        }
        for (lamp, (chosen, rest)) in lamps.list.iter().zip(chosen.into_iter().zip(rests)) {
            assert!((chosen / f64::from(NUMBERS) - lamp.part).abs() < 1e-4, "{chosen}");
            assert!((rest / chosen - 0.5).abs() < 1e-3, "{rest}");
        }
    }
}
