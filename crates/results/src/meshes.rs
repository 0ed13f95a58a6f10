//! The cells of meshes for a pilot, which are small where a first look has found much light, and the groups that are chosen of them.

use job::{Auto, Cut};
use judge::partition::{Cluster, Clusters, Grid, around, doublings, merged};
use radiosity::{SceneSpec, SurfaceSpec};

/// Scores that the pilot is expected to find on one of its patches, at the most.
const SCORES: f64 = 16.0;

/// The pilot's patches are of cells that get this part of its scores.
const CELLS_OF_PATCH: f64 = 2.0;

/// No patch of the pilot is larger than this part of the area.
const PATCHES: f64 = 512.0;

/// The most cells of a surface.
const MOST_CELLS: f64 = (1 << 12) as f64;

/// Faces are grouped where a job has fewer paths than the first of these for each, and fitted one by one where it has more than the last.
const PATHS_OF_FACE: [u64; 2] = [16, 512];

/// The result of the pilot's first look at the meshes of a scene.
pub(crate) struct FirstLook {
    /// The grid of every surface.
    pub(crate) grids: Vec<Grid>,
    /// By cell of all surfaces, the scores that the pilot is expected to find there.
    pub(crate) scores: Vec<f64>,
}

/// Meshes whose faces are to be grouped, cut finely.
pub(crate) struct Meshes {
    kinds: Vec<Option<u32>>,
    /// The coarsest grid of each surface.
    base: Vec<Grid>,
    /// The grid of each surface that the trees are of: of meshes a fine one.
    grids: Vec<Grid>,
}

/// Cuts a surface, whose cells on a coarse grid are expected to have these scores, so finely that no cell has more than a part of those of
/// a patch of the pilot.
fn cut_finely(surface: &mut SurfaceSpec, coarse: Grid, scores: &[f64]) -> Grid {
    let most = scores.iter().fold(0.0_f64, |most, &scores| most.max(scores));
    let area = surface.shape.area();
    let cells = (coarse.cells() as f64 * most * CELLS_OF_PATCH / SCORES).clamp(1.0, MOST_CELLS);
    let grid = coarse.doubled(doublings(&surface.shape, coarse, area / cells));
    assert!(grid.cut().apply(surface), "no cell emits by itself, and grids of a shape are cuts of it");
    grid
}

/// How all surfaces of a scene are cut, and which cells are one patch.
pub(crate) struct MeshCells {
    pub(crate) cuts: Vec<Cut>,
    /// The patch of each cell, in the order of surfaces and their cells. Patches are numbered in the order of their first cells.
    pub(crate) patch_of_cell: Vec<u32>,
    /// The patch that a part of a mesh is; `None` of parts that are none.
    pub(crate) patch_of_part: Vec<Option<u32>>,
}

/// Adds the patches of the cells of a surface, from a first number on: its own, or a patch for each cell. Returns their number.
pub(crate) fn add_patches(
    patch_of_cell: &mut Vec<u32>,
    first: u32,
    (cut, own): (&Cut, Option<&[u32]>),
) -> u32 {
    match own {
        Some(own) => {
            patch_of_cell.extend(own.iter().map(|patch| first + patch));
            own.iter().max().map_or(0, |last| last + 1)
        }
        None => {
            let count = cut.cells() as u32;
            patch_of_cell.extend(first..first + count);
            count
        }
    }
}

impl Meshes {
    /// Whether the faces of meshes are to be grouped in a job of some paths: where these are few for each, and not where they are many. `None` where it takes
    /// a trial: groups of small boxes lose little, those of furniture much.
    pub(crate) fn are_many(auto: &Auto, paths: u64) -> Option<bool> {
        let faces = auto.kinds.iter().flatten().count() as u64;
        let [few, many] = PATHS_OF_FACE.map(|paths_of_face| paths_of_face * faces);
        if paths < few { Some(true) } else { (paths >= many).then_some(false) }
    }

    /// The meshes of a job, of which a first look has found this, and the trees of their cells. The parts that are not halved are patches of the pilot:
    /// in each no more than [`SCORES`] are expected.
    pub(crate) fn new(spec: &SceneSpec, auto: &Auto, look: &FirstLook) -> (Self, Clusters) {
        let grids = |spec: &SceneSpec| spec.surfaces.iter().map(|surface| Grid::of(&surface.shape)).collect();
        let mut fine = spec.clone();
        // By cell, the scores that the pilot is expected to find there.
        let (mut scores, mut first) = (Vec::new(), 0);
        for ((surface, kind), &coarse) in fine.surfaces.iter_mut().zip(&auto.kinds).zip(&look.grids) {
            let seen = &look.scores[first..][..coarse.cells() as usize];
            first += seen.len();
            let grid =
                if kind.is_some() { cut_finely(surface, coarse, seen) } else { Grid::of(&surface.shape) };
            let share = coarse.cells() as f64 / grid.cells() as f64;
            match grid.cells() >= coarse.cells() {
                true => scores.extend((0..grid.cells()).map(|cell| share * seen[around(coarse, grid, cell)])),
                false => scores.extend((0..grid.cells()).map(|_| 0.0)),
            }
        }
        let area: f64 = auto.surfaces.iter().map(|&surface| spec.surfaces[surface].shape.area()).sum();
        let is_fine = |part: &Cluster| part.area <= area / PATCHES && part.scores <= SCORES;
        let clusters = Clusters::new(&fine, &auto.kinds, &scores, is_fine);
        (Meshes { kinds: auto.kinds.clone(), base: grids(spec), grids: grids(&fine) }, clusters)
    }

    /// Whether a surface is of a mesh whose faces are grouped.
    pub(crate) fn has(&self, surface: usize) -> bool {
        self.kinds[surface].is_some()
    }

    /// The number of cells that the trees are of, and of the other surfaces.
    pub(crate) fn cell_count(&self) -> usize {
        self.grids.iter().map(|grid| grid.cells() as usize).sum()
    }

    /// The cells of parts that are patches, given by the part of each cell, where other surfaces than those of meshes have these cuts, and their
    /// cells these patches ([`judge::partition::Choice::patches`]).
    pub(crate) fn cells(&self, part_of_cell: &[u32], cuts: &[Cut], others: &[Option<Vec<u32>>]) -> MeshCells {
        let parts = part_of_cell.iter().max().map_or(0, |last| *last as usize + 1);
        let patch_of_part = vec![None; parts];
        let mut cells = MeshCells { cuts: Vec::new(), patch_of_cell: Vec::new(), patch_of_part };
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
                let own = others.get(surface).and_then(Option::as_deref);
                patches += add_patches(&mut cells.patch_of_cell, patches, (cut, own));
            }
            first += count;
        }
        cells
    }
}
