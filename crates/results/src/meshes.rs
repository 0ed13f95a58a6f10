//! The cells of meshes for a pilot, and the groups that are chosen of them.

use job::{Auto, Cut};
use judge::partition::{Cluster, Clusters, Grid, doublings, merged};
use radiosity::SceneSpec;

/// Parts that the pilot sees are of cells of this part of their area.
const CELLS_OF_PART: f64 = 2.0;

/// Meshes whose faces are to be grouped, cut finely.
pub(crate) struct Meshes {
    kinds: Vec<Option<u32>>,
    /// The coarsest grid of each surface.
    base: Vec<Grid>,
    /// The grid of each surface that the trees are of: of meshes a fine one.
    grids: Vec<Grid>,
    pub(crate) clusters: Clusters,
    /// Which parts are patches of the pilot.
    pub(crate) finest: Vec<bool>,
}

/// How all surfaces of a scene are cut, and which cells are one patch.
pub(crate) struct Cells {
    pub(crate) cuts: Vec<Cut>,
    /// The patch of each cell, in the order of surfaces and their cells. Patches are numbered in the order of their first cells.
    pub(crate) patch_of_cell: Vec<u32>,
    /// The patch that a part of a mesh is; `None` of parts that are none.
    pub(crate) patch_of_part: Vec<Option<u32>>,
}

impl Meshes {
    /// The meshes of a job of some paths; `None` where their faces are few enough for patches of their own: fits to each face then
    /// gain more than groups do, the more paths there are.
    pub(crate) fn new(spec: &SceneSpec, auto: &Auto, paths: u64, cells: u64) -> Option<Self> {
        let faces = auto.kinds.iter().flatten().count() as f64;
        if faces * faces <= 4.0 * paths as f64 {
            return None;
        }
        let area: f64 = auto.surfaces.iter().map(|&surface| spec.surfaces[surface].shape.area()).sum();
        let of_part = area / cells as f64;
        let mut fine = spec.clone();
        let grids = |spec: &SceneSpec| spec.surfaces.iter().map(|surface| Grid::of(&surface.shape)).collect();
        let base = grids(spec);
        for (surface, _) in fine.surfaces.iter_mut().zip(&auto.kinds).filter(|(_, kind)| kind.is_some()) {
            let base = Grid::of(&surface.shape);
            let grid = base.doubled(doublings(&surface.shape, base, of_part / CELLS_OF_PART));
            assert!(
                grid.cut().apply(surface),
                "no cell emits by itself, and grids of a shape are cuts of it"
            );
        }
        let clusters = Clusters::new(&fine, &auto.kinds);
        let is_fine = |part: &Cluster| part.area <= of_part || part.halves.is_none();
        let finest = clusters.parts.iter().map(is_fine).collect();
        Some(Meshes { kinds: auto.kinds.clone(), base, grids: grids(&fine), clusters, finest })
    }

    /// Whether a surface is of a mesh whose faces are grouped.
    pub(crate) fn has(&self, surface: usize) -> bool {
        self.kinds[surface].is_some()
    }

    /// The cells of the pilot's scene, where other surfaces than those of meshes have these cuts.
    pub(crate) fn pilot(&self, cuts: &[Cut]) -> Cells {
        let mut part_of_place = vec![0; self.clusters.cells.len()];
        let mut open = self.clusters.roots.clone();
        while let Some(number) = open.pop() {
            let part = &self.clusters.parts[number as usize];
            match part.halves {
                Some(halves) if !self.finest[number as usize] => open.extend(halves),
                _ => part_of_place[part.cells[0] as usize..part.cells[1] as usize].fill(number),
            }
        }
        self.cells(&part_of_place, cuts)
    }

    /// The cells of parts that are patches, where other surfaces than those of meshes have these cuts.
    pub(crate) fn cells(&self, part_of_place: &[u32], cuts: &[Cut]) -> Cells {
        let mut part_of_cell = vec![0; self.grids.iter().map(|grid| grid.cells() as usize).sum()];
        for (&cell, &part) in self.clusters.cells.iter().zip(part_of_place) {
            part_of_cell[cell as usize] = part;
        }
        let mut cells = Cells { cuts: Vec::new(), patch_of_cell: Vec::new(), patch_of_part: Vec::new() };
        cells.patch_of_part.resize(self.clusters.parts.len(), None);
        let (mut first, mut patches) = (0, 0);
        for (surface, cut) in cuts.iter().enumerate() {
            let count = self.grids[surface].cells() as usize;
            if self.has(surface) {
                let labels = part_of_cell[first..first + count].to_vec();
                let (grid, labels) = merged(self.base[surface], self.grids[surface], labels);
                cells.cuts.push(grid.cut());
                for part in labels {
                    let patch = cells.patch_of_part[part as usize].get_or_insert(patches);
                    patches += u32::from(*patch == patches);
                    cells.patch_of_cell.push(*patch);
                }
            } else {
                cells.cuts.push(cut.clone());
                let more = cut.cells() as u32;
                cells.patch_of_cell.extend(patches..patches + more);
                patches += more;
            }
            first += count;
        }
        cells
    }
}
