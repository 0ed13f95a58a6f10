//! Uniform points of patches that are groups of cells: where discrete walks go on from.
//!
//! 64 random bits choose a cell of the group with a probability in proportion to its area (Walker's alias method), and what they
//! leave undecided is the first coordinate of the point; the second is their lower half. So a walk draws no more numbers than it
//! does where every cell is a patch, and Sobol points keep their order along both coordinates.

use crate::geometry::cells::EDGE;
use crate::geometry::face::Faces;
use crate::geometry::surface::Surface;
use crate::random::rng::unit_32;
use crate::random::sampling::AliasTable;
use crate::simd::batch::{Lanes, WIDTH};
use crate::walk::depart::Departures;

/// A cell: its surface, and its number there.
type GridCell = [u32; 2];

/// A column of an alias table: the cell of the column below the threshold, another one above it.
#[derive(Clone, Copy, Debug)]
struct AliasColumn {
    threshold: u64,
    places: [GridCell; 2],
}

/// The cells of the faces that consist of several.
#[derive(Clone, Debug)]
pub(crate) struct Scatter {
    columns: Vec<AliasColumn>,
    /// Where the columns of each face begin; their number last. A face of one cell has none.
    first: Vec<u32>,
}

impl Scatter {
    /// What the tables take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.columns[..]) + size_of_val(&self.first[..])
    }

    pub(crate) fn new(faces: &Faces, surfaces: &[Surface]) -> Self {
        let mut scatter = Scatter { columns: Vec::new(), first: vec![0] };
        for face in 0..faces.len() {
            let members: Vec<_> = faces.pieces(face).map(|piece| faces.piece(piece)).collect();
            if members.len() > 1 {
                let areas: Vec<f64> = members.iter().map(|member| member.area).collect();
                let place = |i: usize| {
                    let member = &members[i];
                    [member.surface, surfaces[member.surface as usize].cell_of(member)]
                };
                let columns = AliasTable::new(&areas).into_columns().into_iter().enumerate();
                scatter.columns.extend(columns.map(|(i, (threshold, alias))| AliasColumn {
                    threshold,
                    places: [place(i), place(alias as usize)],
                }));
            }
            scatter.first.push(scatter.columns.len() as u32);
        }
        scatter
    }

    /// The place that 64 random bits choose on a face, and two uniform numbers for a point there; `None` where the face is one cell.
    #[inline(always)]
    pub(crate) fn choose(&self, face: u32, bits: u64) -> Option<(GridCell, [f64; 2])> {
        let [first, end] = [face, face + 1].map(|i| self.first[i as usize]);
        if first == end {
            return None;
        }
        let product = u128::from(bits) * u128::from(end - first);
        let (column, rest) = ((product >> 64) as u32, product as u64);
        let AliasColumn { threshold, places } = self.columns[(first + column) as usize];
        let (place, above, width) = match rest < threshold {
            true => (places[0], rest, threshold as f64),
            false => (places[1], rest - threshold, (u64::MAX - threshold) as f64 + 1.0),
        };
        let along = (above as f64 + 0.5) / width;
        Some((place, [along.clamp(EDGE, 1.0 - EDGE), unit_32(bits as u32)]))
    }

    /// Moves departures from faces of several cells to uniform points of these.
    pub(crate) fn spread(
        &self,
        surfaces: &[Surface],
        lanes: Lanes,
        faces: &[u32; WIDTH],
        points: &[u64; WIDTH],
        departures: &mut Departures,
    ) {
        lanes.each(|lane| {
            if let Some(([surface, cell], point)) = self.choose(faces[lane], points[lane]) {
                let uv = surfaces[surface as usize].point_in_cell(cell, point);
                departures.surface[lane] = surface;
                departures.uv.iter_mut().zip(uv).for_each(|(row, uv)| row[lane] = uv);
            }
        });
    }
}
