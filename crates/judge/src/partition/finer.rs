//! Finer cuts of chosen patches, where the walks of a control show that their fits leave light out.
//!
//! Each patch that lies on one surface is looked at as a surface by itself, by the arrivals on it, and gets the [tree](super::tree) of cuts that a
//! pilot of as many walks would give it. What its first cut gains is expected from all patches that are lit about as brightly: single ones prove
//! little, and light beside lamps is steep on most of them.

use std::collections::BTreeMap;

use job::Cut;
use radiosity::{
    rays::Arrival,
    surfaces::{CutCell, Leaves},
};

use super::grid::Grid;
use super::merged::around;
use super::missed::{FaceArrival, PatchControl};
use super::quarters::{MOST_CUTS, Triangles};
use super::seen::{Basis, GridCells, PartShape, SideArrival, SurfaceLight};
use super::tree::{JobWalks, Rectangles, Start, rectangles};

/// A patch of fewer arrivals proves nothing.
const LEAST_ARRIVALS: usize = 6;

/// Parts of surfaces that a thread takes at once.
const AT_ONCE: usize = 16;

/// The groups of a control are joined to this number of groups: products of what they find have the errors of a pilot's, in less time.
const TREE_GROUPS: usize = 4;

/// Patches of which some are cut finer.
#[derive(Clone, Debug)]
pub struct Finer {
    /// The cut of each surface.
    pub cuts: Vec<Cut>,
    /// The patch of each cell, as in [`job::Partition`].
    pub groups: Vec<u32>,
    /// The noise that the cuts add [W²/m²].
    pub noise: f64,
    /// The energy that fits catch beyond those on the patches as they were [W²/m²].
    pub gained: f64,
}

/// A patch as a part of its surface.
#[derive(Clone, Copy, Debug)]
struct SurfacePart {
    base: Grid,
    /// How often halvings of the surface led to it, along u and v; of a triangle, how often it was cut in four.
    levels: [u32; 2],
    /// A place of its surface has the coordinates (place − origin)·scale + offset on it.
    origin: [f64; 2],
    scale: [f64; 2],
    offset: f64,
}

impl SurfacePart {
    fn of_leaf(CutCell { levels, at }: CutCell) -> Self {
        let scale = levels.map(|level| f64::from(1_u32 << level));
        let origin = [0, 1].map(|k| f64::from(at[k]) / scale[k]);
        SurfacePart { base: Grid::Quad([1, 1]), levels, origin, scale, offset: 0.0 }
    }

    /// A cell of a triangle that is cut in four some times.
    fn of_triangle(level: u32, cell: usize) -> Self {
        let (origin, sign) = GridCells::new(Grid::Triangle(1 << level)).centre(cell);
        let scale = [sign * f64::from(1_u32 << level); 2];
        SurfacePart { base: Grid::Triangle(1), levels: [level, 0], origin, scale, offset: 1.0 / 3.0 }
    }

    /// A place of the surface that lies on it, in its own coordinates.
    fn place(&self, uv: [f64; 2]) -> [f64; 2] {
        // Cells do not hold their far edges.
        const BELOW_ONE: f64 = 1.0 - 1e-9;
        let [u, v] =
            [0, 1].map(|k| ((uv[k] - self.origin[k]) * self.scale[k] + self.offset).clamp(0.0, BELOW_ONE));
        match self.base {
            Grid::Triangle(_) if u + v >= BELOW_ONE => [u, v].map(|x| x * BELOW_ONE / (u + v)),
            _ => [u, v],
        }
    }

    fn area(&self, of_surface: f64) -> f64 {
        match self.base {
            Grid::Quad(_) => of_surface / (self.scale[0] * self.scale[1]),
            Grid::Triangle(_) => of_surface / (self.scale[0] * self.scale[0]),
        }
    }
}

/// How the patches of a surface are cut, all of which are parts of it.
enum SurfaceTree {
    Leaves(Leaves),
    /// The rows of the cells, and the part of each.
    Triangles(u32, Vec<u32>),
}

/// The parts of a surface.
struct SurfaceParts {
    tree: SurfaceTree,
    parts: Vec<SurfacePart>,
}

impl SurfaceParts {
    /// `None` where a patch is no part that is made by halving, or by cutting triangles in four.
    fn new(cut: &Cut, own: Option<&[u32]>) -> Option<Self> {
        let each_is_a_patch = own.is_none_or(|own| own.iter().zip(0..).all(|(&patch, cell)| patch == cell));
        match cut {
            Cut::Rows(rows) => {
                let cells = (0..rows * rows).collect::<Vec<u32>>();
                Self::of_triangles(*rows, own.unwrap_or(&cells))
            }
            _ if !each_is_a_patch => None,
            Cut::Leaves(leaves) => Some(Self::of_leaves(leaves.clone())),
            Cut::Grid(cells) => {
                let [a, b] = cells.map(u32::trailing_zeros);
                let fits = cells.iter().all(|n| n.is_power_of_two()) && a.max(b) <= Leaves::MOST_CUTS;
                let axis = |part: CutCell| {
                    if part.levels[0] < a { Some(0) } else { (part.levels[1] < b).then_some(1) }
                };
                fits.then(|| Self::of_leaves(Leaves::grow(axis)))
            }
        }
    }

    fn of_leaves(leaves: Leaves) -> Self {
        let parts = leaves.iter().map(SurfacePart::of_leaf).collect();
        SurfaceParts { tree: SurfaceTree::Leaves(leaves), parts }
    }

    fn of_triangles(rows: u32, own: &[u32]) -> Option<Self> {
        if !rows.is_power_of_two() {
            return None;
        }
        let mut cells: BTreeMap<u32, Vec<u64>> = BTreeMap::new();
        own.iter().zip(0..).for_each(|(&patch, cell)| cells.entry(patch).or_default().push(cell));
        let fine = Grid::Triangle(rows);
        let mut parts = Vec::new();
        for cells in cells.values() {
            let level = (u64::from(rows) * u64::from(rows) / cells.len() as u64).ilog2() / 2;
            let coarse = Grid::Triangle(1 << level);
            let cell = around(coarse, fine, cells[0]);
            let is_whole = cells.len() as u64 * coarse.cells() == fine.cells()
                && cells.iter().all(|&other| around(coarse, fine, other) == cell);
            parts.push(is_whole.then(|| SurfacePart::of_triangle(level, cell))?);
        }
        let numbers: BTreeMap<u32, u32> = cells.keys().copied().zip(0..).collect();
        let own = own.iter().map(|patch| numbers[patch]).collect();
        Some(SurfaceParts { tree: SurfaceTree::Triangles(rows, own), parts })
    }
}

/// What cutting a part comes to.
enum PartCuts {
    Leaves(Leaves),
    Triangles(u32, Vec<u32>),
}

impl PatchControl<'_> {
    /// The surfaces of a partition cut finer for a number of walks, where the arrivals of all groups prove that it pays. Only patches of the
    /// surfaces that are open are cut, which lie on one surface each. `None` where nothing is proven.
    pub fn finer(
        &self,
        groups: &[Vec<Arrival>],
        (cuts, labels): (&[Cut], &[u32]),
        is_open: impl Fn(usize) -> bool,
        walks: f64,
    ) -> Option<Finer> {
        let cells = CellsOfSurfaces::new(cuts, labels);
        let parts: Vec<Option<SurfaceParts>> = cuts
            .iter()
            .enumerate()
            .map(|(surface, cut)| {
                let is_free = is_open(surface) && !cells.is_shared(surface);
                is_free.then(|| SurfaceParts::new(cut, cells.own(surface).as_deref()))?
            })
            .collect();
        let seen = self.seen(groups, &parts);
        let rates = LightClassRates::new(&seen);
        let mut finer = Finer { cuts: cuts.to_vec(), groups: Vec::new(), noise: 0.0, gained: 0.0 };
        let mut found: BTreeMap<usize, BTreeMap<usize, PartCuts>> = BTreeMap::new();
        let trees = parallel::map(&seen, AT_ONCE, |SeenPart { part, light, .. }| {
            cut_part(part, light, rates.gain(light), walks)
        });
        for (SeenPart { surface, number, .. }, tree) in seen.iter().zip(trees) {
            if let Some(tree) = tree {
                finer.noise += tree.noise;
                finer.gained += tree.gained;
                found.entry(*surface).or_default().insert(*number, tree.cuts);
            }
        }
        if found.is_empty() {
            return None;
        }
        let own = parts.iter().enumerate().map(|(surface, parts)| {
            let (cuts, parts) = (found.remove(&surface)?, parts.as_ref()?);
            let (cut, own) = parts.grafted(cuts);
            finer.cuts[surface] = cut;
            Some(own)
        });
        let own: Vec<Option<Option<Vec<u32>>>> = own.collect();
        finer.groups = cells.renumbered(&finer.cuts, &own);
        Some(finer)
    }

    /// The light on every part that enough walks arrive on.
    fn seen(&self, groups: &[Vec<Arrival>], parts: &[Option<SurfaceParts>]) -> Vec<SeenPart> {
        let (scene, on_faces) = (self.scene(), self.on_faces(groups));
        // Each part is a patch, and a patch that is a part lies on one surface.
        let mut placed: Vec<([usize; 2], &[FaceArrival<'_>])> = Vec::new();
        for landed in on_faces.chunk_by(|a, b| a.face == b.face) {
            let arrival = landed[0].arrival;
            let surface = scene.faces().piece(arrival.piece).surface as usize;
            if let Some(own) = &parts[surface] {
                placed.push(([surface, own.part_of(scene.surfaces()[surface].cell_at(arrival.uv))], landed));
            }
        }
        placed.sort_by_key(|&(part, _)| part);
        let sides = placed.chunk_by(|a, b| a.0 == b.0);
        let arrivals = |sides: &[([usize; 2], &[FaceArrival<'_>])]| -> usize {
            sides.iter().map(|(_, landed)| landed.len()).sum()
        };
        let lit: Vec<_> = sides.filter(|sides| arrivals(sides) >= LEAST_ARRIVALS).collect();
        parallel::map(&lit, AT_ONCE, |sides| {
            let [surface, number] = sides[0].0;
            let part = parts[surface].as_ref().expect("arrivals are on parts").parts[number];
            let landings: Vec<Vec<SideArrival>> =
                sides.iter().map(|(_, landed)| self.landings(&part, landed)).collect();
            let whole = &scene.surfaces()[surface];
            let edges = [0, 1].map(|k| whole.edges()[k].length() / part.scale[k].abs());
            let shape = PartShape { base: part.base, area: part.area(whole.area()), edges };
            let light = SurfaceLight::of_landings(shape, &landings, TREE_GROUPS, self.walks());
            SeenPart { surface, number, part, light }
        })
    }

    /// The arrivals on one side of a part.
    fn landings(&self, part: &SurfacePart, landed: &[FaceArrival<'_>]) -> Vec<SideArrival> {
        let face = self.scene().faces().get(landed[0].face as usize);
        let together = TREE_GROUPS as f64 / PatchControl::GROUPS as f64;
        let values = self.values(face.reflectance).map(|value| together * value);
        let landing = |&FaceArrival { group, arrival, .. }: &FaceArrival<'_>| SideArrival {
            group: group * TREE_GROUPS / PatchControl::GROUPS,
            at: part.place(arrival.uv),
            light: std::array::from_fn(|c| values[c] * arrival.weights[c]),
        };
        landed.iter().map(landing).collect()
    }
}

/// A part of a surface, and what the walks of a control tell of the light on it.
struct SeenPart {
    surface: usize,
    number: usize,
    part: SurfacePart,
    light: SurfaceLight,
}

/// Parts are alike whose light is within a factor of two: what they gain in proportion to their energy, all of a class together.
struct LightClassRates {
    by_class: BTreeMap<i64, f64>,
}

impl LightClassRates {
    fn new(seen: &[SeenPart]) -> Self {
        // By class the gains of first cuts, the variance of their sum, and the energies.
        let mut sums: BTreeMap<i64, [f64; 3]> = BTreeMap::new();
        for SeenPart { light, .. } in seen {
            let Some(first) = light.first_cut() else { continue };
            let noise = first.noise / light.walks;
            let variance = (4.0 * first.gain.max(0.0) + 2.0 * first.unknowns * noise) * noise;
            let of_class = sums.entry(class(light)).or_default();
            let parts = [first.gain, variance, light.caught(Basis::Linear, [0, 0])];
            of_class.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
        let rate = |[gain, variance, energy]: [f64; 3]| {
            let gain = gain.max(0.0);
            if energy > 0.0 && gain > 0.0 {
                gain * gain / (gain * gain + variance) * gain / energy
            } else {
                0.0
            }
        };
        LightClassRates { by_class: sums.into_iter().map(|(class, sums)| (class, rate(sums))).collect() }
    }

    /// What the first cut of a part is expected to gain.
    fn gain(&self, light: &SurfaceLight) -> f64 {
        let rate = self.by_class.get(&class(light)).copied().unwrap_or(0.0);
        rate * light.caught(Basis::Linear, [0, 0]).max(0.0)
    }
}

/// The class of a part: the power of four in the mean square of its light.
fn class(light: &SurfaceLight) -> i64 {
    let square = light.caught(Basis::Linear, [0, 0]) / light.area;
    // The exponent of a number that is not negative.
    (square.max(0.0).to_bits() >> 52) as i64 / 2
}

/// A part that is cut.
struct CutPart {
    cuts: PartCuts,
    /// The noise that this adds, and the energy that fits catch beyond that on the part [W²/m²].
    noise: f64,
    gained: f64,
}

/// The cuts of a part whose first one is expected to gain `gain`, for a job of some walks; `None` where none pays.
fn cut_part(part: &SurfacePart, light: &SurfaceLight, gain: f64, walks: f64) -> Option<CutPart> {
    let (most, expected) = match part.base {
        // Cuts along both edges gain it together.
        Grid::Quad(_) => (part.levels.map(|level| Leaves::MOST_CUTS - level), 0.5 * gain),
        Grid::Triangle(_) => ([MOST_CUTS.saturating_sub(part.levels[0]), 0], gain),
    };
    let walks = JobWalks { pilot: light.walks, job: walks };
    let start = Start { expected: Some(expected), most };
    if let Some(images) = &light.images {
        let Rectangles { leaves, noise, caught, .. } = rectangles(images, walks, start);
        let noise = (noise - 3.0 * images.noise([0, 0], [0, 0])) / walks.job;
        let gained = caught - images.caught([0, 0])[0];
        return (leaves.len() > 1).then_some(CutPart { cuts: PartCuts::Leaves(leaves), noise, gained });
    }
    let quarters = light.quarters.as_ref()?;
    let Triangles { rows, patch_of_cell, noise, caught, .. } = quarters.triangles(walks, start);
    let [of_whole, caught_by_whole] = quarters.whole();
    let (noise, gained) = ((noise - of_whole) / walks.job, caught - caught_by_whole);
    (rows > 1).then_some(CutPart { cuts: PartCuts::Triangles(rows, patch_of_cell), noise, gained })
}

impl SurfaceParts {
    /// The cut of the surface with the cuts of its parts, and the patch of each cell where cells are not patches.
    fn grafted(&self, cuts: BTreeMap<usize, PartCuts>) -> (Cut, Option<Vec<u32>>) {
        match &self.tree {
            SurfaceTree::Leaves(leaves) => {
                let mut parts = 0..;
                let text: String = leaves
                    .text()
                    .chars()
                    .map(|letter| match letter {
                        '.' => match cuts.get(&parts.next().expect("few leaves")) {
                            Some(PartCuts::Leaves(own)) => own.text().to_owned(),
                            _ => letter.to_string(),
                        },
                        cut => cut.to_string(),
                    })
                    .collect();
                (Cut::Leaves(text.parse().expect("no part is cut too often")), None)
            }
            SurfaceTree::Triangles(rows, own) => {
                let finest = |(&part, cuts): (&usize, &PartCuts)| match cuts {
                    PartCuts::Triangles(rows, _) => (1 << self.parts[part].levels[0]) * rows,
                    PartCuts::Leaves(_) => 1,
                };
                let finest = cuts.iter().map(finest).fold(*rows, u32::max);
                let (coarse, fine) = (Grid::Triangle(*rows), Grid::Triangle(finest));
                let cells = GridCells::new(fine);
                // Parts of parts, by the part and the number in it.
                let of_cell = |cell: u64| {
                    let part = own[around(coarse, fine, cell)] as usize;
                    let within = match cuts.get(&part) {
                        Some(PartCuts::Triangles(rows, patches)) => {
                            let place = self.parts[part].place(cells.centre(cell as usize).0);
                            patches[GridCells::new(Grid::Triangle(*rows)).cell_at(place)]
                        }
                        _ => 0,
                    };
                    [part as u32, within]
                };
                let keys: Vec<[u32; 2]> = (0..fine.cells()).map(of_cell).collect();
                (Cut::Rows(finest), Some(in_order(keys)))
            }
        }
    }

    /// The part that a cell is of.
    fn part_of(&self, cell: u32) -> usize {
        match &self.tree {
            SurfaceTree::Leaves(_) => cell as usize,
            SurfaceTree::Triangles(_, own) => own[cell as usize] as usize,
        }
    }
}

/// Numbers for keys, in the order in which they are first met.
fn in_order<K: Ord>(keys: Vec<K>) -> Vec<u32> {
    let mut numbers = BTreeMap::new();
    keys.into_iter()
        .map(|key| {
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        })
        .collect()
}

/// The patches of the cells of all surfaces.
struct CellsOfSurfaces<'a> {
    /// The first cell of each surface, and the number of all.
    first: Vec<usize>,
    /// The patch of each cell; empty where every cell is a patch.
    labels: &'a [u32],
    /// By patch, whether it lies on several surfaces.
    is_shared: Vec<bool>,
}

impl<'a> CellsOfSurfaces<'a> {
    fn new(cuts: &[Cut], labels: &'a [u32]) -> Self {
        let mut first = vec![0];
        cuts.iter().for_each(|cut| first.push(first[first.len() - 1] + cut.cells() as usize));
        let mut surface_of = vec![None; labels.iter().max().map_or(0, |last| *last as usize + 1)];
        let mut is_shared = vec![false; surface_of.len()];
        for surface in 0..if labels.is_empty() { 0 } else { cuts.len() } {
            for &patch in &labels[first[surface]..first[surface + 1]] {
                is_shared[patch as usize] |= *surface_of[patch as usize].get_or_insert(surface) != surface;
            }
        }
        CellsOfSurfaces { first, labels, is_shared }
    }

    /// The patches of the cells of a surface, counted from 0; `None` where every cell is a patch.
    fn own(&self, surface: usize) -> Option<Vec<u32>> {
        (!self.labels.is_empty()).then(|| in_order(self.labels_of(surface).to_vec()))
    }

    fn labels_of(&self, surface: usize) -> &[u32] {
        self.labels.get(self.first[surface]..self.first[surface + 1]).unwrap_or_default()
    }

    fn is_shared(&self, surface: usize) -> bool {
        self.labels_of(surface).iter().any(|&patch| self.is_shared[patch as usize])
    }

    /// The patch of each cell with new cuts of surfaces, of which some have patches of their own (`Some`), which cells are where that is
    /// `None`. Empty where every cell is a patch.
    fn renumbered(&self, cuts: &[Cut], own: &[Option<Option<Vec<u32>>>]) -> Vec<u32> {
        let mut keys = Vec::new();
        for (surface, (cut, own)) in cuts.iter().zip(own).enumerate() {
            let labels = self.labels_of(surface);
            keys.extend((0..cut.cells() as u32).map(|cell| match own {
                Some(Some(own)) => [1 + surface as u32, own[cell as usize]],
                None if !labels.is_empty() => [0, labels[cell as usize]],
                _ => [1 + surface as u32, cell],
            }));
        }
        let labels = in_order(keys);
        if labels.iter().zip(0..).all(|(&patch, cell)| patch == cell) { Vec::new() } else { labels }
    }
}
