//! MGF's transforms: `-t -rx -ry -rz -s -mx -my -mz`, repeated by `-i`, and arrays by `-a`.

use glam::{DAffine3, DMat3, DVec3};

use crate::error::UnplacedError;
use crate::text::number;

/// The largest number of copies that an array may name.
const MAX_COPIES: u64 = 1 << 24;

/// The placements of an `xf` or an include, one for each element of its arrays, the last array running fastest.
pub(super) struct Placements {
    groups: Vec<TransformGroup>,
    counts: Vec<u64>,
    next: Option<Vec<u64>>,
}

/// The moves after an `-i` or `-a`, to be applied as often as it says.
struct TransformGroup {
    place: DAffine3,
    repeat: RepeatCount,
}

enum RepeatCount {
    Times(u64),
    /// Applied as many times as the number of the copy in this array.
    Array(usize),
}

impl Placements {
    /// Reads the arguments of a transform.
    pub(super) fn parse(arguments: &[&[u8]]) -> Result<Self, UnplacedError> {
        let mut groups = vec![TransformGroup { place: DAffine3::IDENTITY, repeat: RepeatCount::Times(1) }];
        let mut counts = Vec::new();
        let mut rest = arguments;
        while let Some((&flag, after)) = rest.split_first() {
            rest = after;
            if matches!(flag, b"-i" | b"-a") {
                let count = read_count(&mut rest)?;
                let repeat =
                    if flag == b"-i" { RepeatCount::Times(count) } else { RepeatCount::Array(counts.len()) };
                counts.extend((flag == b"-a").then_some(count));
                groups.push(TransformGroup { place: DAffine3::IDENTITY, repeat });
                continue;
            }
            let last = groups.last_mut().expect("the first one");
            last.place = step(flag, &mut rest)? * last.place;
        }
        let next = (!counts.contains(&0)).then(|| vec![0; counts.len()]);
        Ok(Placements { groups, counts, next })
    }

    /// The number of placements; 2⁶⁴ − 1 stands for all larger numbers.
    pub(super) fn copies(&self) -> u64 {
        if self.next.is_none() {
            0
        } else {
            self.counts.iter().fold(1, |product, &count| product.saturating_mul(count))
        }
    }

    /// The work of finding one placement, in matrices that are multiplied.
    pub(super) fn steps(&self) -> u64 {
        4 * self.groups.len() as u64
    }

    fn place(&self, copy: &[u64]) -> DAffine3 {
        self.groups.iter().fold(DAffine3::IDENTITY, |placed, group| {
            let times = match group.repeat {
                RepeatCount::Times(times) => times,
                RepeatCount::Array(array) => copy[array],
            };
            power(group.place, times) * placed
        })
    }
}

impl Iterator for Placements {
    type Item = DAffine3;

    fn next(&mut self) -> Option<DAffine3> {
        let mut copy = self.next.take()?;
        let place = self.place(&copy);
        for array in (0..copy.len()).rev() {
            copy[array] += 1;
            if copy[array] < self.counts[array] {
                self.next = Some(copy);
                break;
            }
            copy[array] = 0;
        }
        Some(place)
    }
}

/// A placement applied `times` times. Moves are multiplied out, so that equal steps add no rounding.
fn power(place: DAffine3, times: u64) -> DAffine3 {
    if place.matrix3 == DMat3::IDENTITY {
        return DAffine3::from_translation(place.translation * times as f64);
    }
    let (mut square, mut result, mut times) = (place, DAffine3::IDENTITY, times);
    while times > 0 {
        if times % 2 == 1 {
            result = square * result;
        }
        square = square * square;
        times /= 2;
    }
    result
}

fn read_count(rest: &mut &[&[u8]]) -> Result<u64, UnplacedError> {
    let count = take(rest)?;
    if count >= 0.0 && count <= MAX_COPIES as f64 && count.fract() == 0.0 {
        return Ok(count as u64);
    }
    Err(UnplacedError::new(
        format!("{count} is no number of copies"),
        format!("copies are counted from 0 to {MAX_COPIES}"),
        "correct it",
    ))
}

fn take(rest: &mut &[&[u8]]) -> Result<f64, UnplacedError> {
    let (word, after) = rest.split_first().map_or((None, &[][..]), |(word, after)| (Some(*word), after));
    *rest = after;
    number(word)
}

fn step(flag: &[u8], rest: &mut &[&[u8]]) -> Result<DAffine3, UnplacedError> {
    let mirror = |axis: DVec3| Ok(DAffine3::from_scale(DVec3::ONE - 2.0 * axis));
    match flag {
        b"-t" => Ok(DAffine3::from_translation(DVec3::new(take(rest)?, take(rest)?, take(rest)?))),
        b"-rx" => Ok(DAffine3::from_mat3(about(take(rest)?, 0))),
        b"-ry" => Ok(DAffine3::from_mat3(about(take(rest)?, 1))),
        b"-rz" => Ok(DAffine3::from_mat3(about(take(rest)?, 2))),
        b"-s" => scale(take(rest)?),
        b"-mx" => mirror(DVec3::X),
        b"-my" => mirror(DVec3::Y),
        b"-mz" => mirror(DVec3::Z),
        _ => Err(UnplacedError::new(
            format!("{:?} is no transform", crate::text::name(flag)),
            "there are -t, -rx, -ry, -rz, -s, -mx, -my, -mz, -i and -a",
            "correct it",
        )),
    }
}

fn scale(factor: f64) -> Result<DAffine3, UnplacedError> {
    if factor == 0.0 {
        return Err(UnplacedError::new("a scale of 0", "nothing would have an area", "correct it"));
    }
    Ok(DAffine3::from_scale(DVec3::splat(factor)))
}

/// A rotation about an axis; right angles are exact.
fn about(degrees: f64, axis: usize) -> DMat3 {
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        degrees => degrees.to_radians().sin_cos(),
    };
    let mut columns = [[0.0; 3]; 3];
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    columns[axis][axis] = 1.0;
    (columns[u][u], columns[u][v]) = (cos, sin);
    (columns[v][u], columns[v][v]) = (-sin, cos);
    DMat3::from_cols_array_2d(&columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origins(text: &str) -> Vec<[f64; 3]> {
        let words: Vec<&[u8]> = text.split(' ').map(str::as_bytes).collect();
        let places = Placements::parse(&words).unwrap();
        places.map(|place| place.transform_point3(DVec3::X).to_array()).collect()
    }

    #[test]
    fn steps_apply_from_left_to_right() {
        assert_eq!(origins("-t 1 0 0 -rz 90"), [[0.0, 2.0, 0.0]]);
        assert_eq!(origins("-rz 90 -t 1 0 0"), [[1.0, 1.0, 0.0]]);
        assert_eq!(origins("-mx -s 2"), [[-2.0, 0.0, 0.0]]);
        assert_eq!(origins("-i 3 -s 2"), [[8.0, 0.0, 0.0]]);
    }

    #[test]
    fn arrays_have_a_copy_for_each_element() {
        assert_eq!(origins("-t 0 0 5 -a 3 -t 1 0 0"), [[1., 0., 5.], [2., 0., 5.], [3., 0., 5.]]);
        assert_eq!(origins("-a 2 -t 10 0 0 -a 2 -t 0 1 0").len(), 4);
        assert_eq!(origins("-a 0 -t 1 0 0").len(), 0);
    }
}
