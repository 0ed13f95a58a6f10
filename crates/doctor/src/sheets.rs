//! Orientation by connectivity: one-sided surfaces that share whole edges form sheets, whose fronts lie on one side.

use std::collections::HashMap;

use glam::DVec3;
use radiosity::{SceneSpec, Sides};

/// The part of the largest coordinate below which two corners are one vertex.
const SAME: f64 = 1.0 / (1_u64 << 40) as f64;

/// The factor by which the surfaces that are to be turned must outnumber the others for a whole sheet to be turned.
const CLEARLY: usize = 4;

/// The sheets of a scene.
pub(crate) struct OrientedSheets {
    /// For each sheet its surfaces, and whether each faces the other way than the first one.
    sheets: Vec<Vec<(u32, bool)>>,
}

/// An edge of a surface by its two vertices, the lesser first, and whether the surface runs along it from the greater.
type SheetEdge = ([u32; 2], bool);

impl OrientedSheets {
    pub(crate) fn of(spec: &SceneSpec) -> Self {
        let mut links: HashMap<[u32; 2], Vec<(u32, bool)>> = HashMap::new();
        for (surface, edges) in edges(spec) {
            for (vertices, backwards) in edges {
                links.entry(vertices).or_default().push((surface, backwards));
            }
        }
        // If three surfaces or more meet at an edge, the edge says nothing of their sides.
        let mut neighbours: HashMap<u32, Vec<(u32, bool)>> = HashMap::new();
        for pair in links.into_values() {
            if let [(a, a_backwards), (b, b_backwards)] = pair[..] {
                // Neighbours with their fronts on one side run along the edge in opposite directions.
                let turned = a_backwards == b_backwards;
                neighbours.entry(a).or_default().push((b, turned));
                neighbours.entry(b).or_default().push((a, turned));
            }
        }
        let mut starts: Vec<u32> = neighbours.keys().copied().collect();
        starts.sort_unstable();
        let mut seen: HashMap<u32, bool> = HashMap::new();
        let sheets = starts.into_iter().filter_map(|start| sheet(start, &neighbours, &mut seen));
        OrientedSheets { sheets: sheets.collect() }
    }

    /// The surfaces to turn round: of sheets that the votes agree on, all that face the wrong way, whether they have a
    /// vote or not; and every flipped surface that is part of no such sheet.
    pub(crate) fn turned(&self, flipped: &[u32], right: impl Fn(u32) -> bool) -> Vec<u32> {
        let mut turned: Vec<u32> = flipped.to_vec();
        for sheet in &self.sheets {
            let is_flipped = |surface: u32| flipped.binary_search(&surface).is_ok();
            // A flipped surface that faces the other way than the first is a vote for the first.
            let for_first = sheet.iter().filter(|&&(surface, other)| match other {
                false => right(surface),
                true => is_flipped(surface),
            });
            let against_first = sheet.iter().filter(|&&(surface, other)| match other {
                false => is_flipped(surface),
                true => right(surface),
            });
            let (for_first, against_first) = (for_first.count(), against_first.count());
            let first_is_wrong = against_first > CLEARLY * for_first;
            if first_is_wrong || for_first > CLEARLY * against_first {
                turned.retain(|surface| sheet.binary_search_by_key(surface, |&(member, _)| member).is_err());
                let wrong = sheet.iter().filter(|(_, other)| *other != first_is_wrong);
                turned.extend(wrong.map(|&(surface, _)| surface));
            }
        }
        turned.sort_unstable();
        turned
    }
}

/// The sheet of a surface that belongs to none yet; `None` where it does, or where the sheet has a single side, as a
/// Möbius strip has.
fn sheet(
    start: u32,
    neighbours: &HashMap<u32, Vec<(u32, bool)>>,
    seen: &mut HashMap<u32, bool>,
) -> Option<Vec<(u32, bool)>> {
    if seen.contains_key(&start) {
        return None;
    }
    seen.insert(start, false);
    let (mut sheet, mut next, mut two_sided) = (vec![(start, false)], 0, true);
    while let Some(&(surface, other)) = sheet.get(next) {
        next += 1;
        for &(neighbour, turned) in neighbours.get(&surface).into_iter().flatten() {
            match seen.get(&neighbour) {
                Some(&known) => two_sided &= known == (other != turned),
                None => {
                    seen.insert(neighbour, other != turned);
                    sheet.push((neighbour, other != turned));
                }
            }
        }
    }
    sheet.sort_unstable();
    two_sided.then_some(sheet)
}

/// The edges of every one-sided surface.
fn edges(spec: &SceneSpec) -> Vec<(u32, Vec<SheetEdge>)> {
    let one_sided = || (0_u32..).zip(&spec.surfaces).filter(|(_, surface)| surface.sides == Sides::Front);
    let outlines: Vec<(u32, Vec<DVec3>)> =
        one_sided().map(|(number, surface)| (number, surface.shape.corners().to_vec())).collect();
    let largest = outlines
        .iter()
        .flat_map(|(_, corners)| corners)
        .fold(0.0_f64, |largest, corner| largest.max(corner.abs().max_element()));
    let grid = (largest * SAME).max(f64::MIN_POSITIVE);
    let mut vertices: HashMap<[i64; 3], u32> = HashMap::new();
    let mut vertex = |corner: &DVec3| {
        let place = corner.to_array().map(|x| (x / grid).round() as i64);
        let next = vertices.len() as u32;
        *vertices.entry(place).or_insert(next)
    };
    let outline_edges = outlines.iter().map(|(number, corners)| {
        let ring: Vec<u32> = corners.iter().map(&mut vertex).collect();
        let ends = ring.iter().zip(ring.iter().cycle().skip(1));
        let edge = |(&from, &to): (&u32, &u32)| ([from.min(to), from.max(to)], from > to);
        (*number, ends.map(edge).collect())
    });
    outline_edges.collect()
}

#[cfg(test)]
mod tests {
    use radiosity::{Shape, Spectrum, SurfaceSpec};

    use super::*;

    /// The four faces of a tetrahedron: fronts outside, but those of `turned` inside.
    fn tetrahedron(turned: &[usize]) -> SceneSpec {
        let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        let surface = |(number, [a, b, c]): (usize, [DVec3; 3])| {
            let (b, c) = if turned.contains(&number) { (c, b) } else { (b, c) };
            SurfaceSpec {
                name: None,
                shape: Shape::Triangle { a, b, c, rows: 1 },
                sides: Sides::Front,
                reflectance: 0.5.into(),
                emittance: Spectrum::BLACK,
                cell_emittance: Vec::new(),
                transmittance: Default::default(),
            }
        };
        SceneSpec::new(faces.into_iter().enumerate().map(surface).collect())
    }

    #[test]
    fn surfaces_without_a_vote_follow_their_sheet() {
        let sheets = OrientedSheets::of(&tetrahedron(&[1, 2]));
        assert_eq!(sheets.sheets, [[(0, false), (1, true), (2, true), (3, false)]]);
        assert_eq!(sheets.turned(&[1], |surface| surface == 0), [1, 2]);
        assert_eq!(sheets.turned(&[0], |surface| surface == 1), [0, 3]);
        assert_eq!(
            sheets.turned(&[1], |surface| surface == 2),
            [1],
            "votes that contradict each other stand alone"
        );
        assert!(sheets.turned(&[], |_| false).is_empty());
    }

    #[test]
    fn two_sided_surfaces_link_nothing() {
        let mut spec = tetrahedron(&[1]);
        spec.surfaces.iter_mut().for_each(|surface| surface.sides = Sides::Both);
        assert!(OrientedSheets::of(&spec).sheets.is_empty());
    }
}
