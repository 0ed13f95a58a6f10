//! Patches: the cells of surfaces, made when they are asked for. A scene of a million patches on six surfaces keeps
//! six records.

use glam::DVec3;

use crate::spec::{SceneSpec, Shape, Sides, Spectrum};
use crate::surface::cell_centroid;

/// A patch as outputs show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The surface it is a cell of.
    pub surface: u32,
    /// The cell's label on that surface (parallelogram: i_u, i_v; triangle: row, position).
    pub cell: [u32; 2],
    /// Its centroid, in the coordinates of the file [m].
    pub centroid: DVec3,
    /// A: area of one side [m²].
    pub area: f64,
    /// 1 or 2 active sides.
    pub sides: Sides,
    /// R.
    pub reflectance: Spectrum,
    /// E [W/m²] of each active side.
    pub emittance: Spectrum,
}

impl Patch {
    /// The area that exchanges power: A times the active sides [m²].
    pub fn active_area(&self) -> f64 {
        self.area * self.sides.count()
    }

    /// Φ: self-emitted power of all active sides in one channel [W].
    pub fn power(&self, channel: usize) -> f64 {
        self.active_area() * self.emittance[channel]
    }
}

/// What the cells of a surface have in common.
#[derive(Clone, Debug)]
struct Common {
    first_patch: u32,
    shape: Shape,
    /// Of a cell [m²].
    area: f64,
    sides: Sides,
    reflectance: Spectrum,
    emittance: Spectrum,
}

/// The patches of a scene, by number.
#[derive(Clone, Debug)]
pub struct Patches {
    surfaces: Vec<Common>,
    /// Emittances of single patches, in ascending order.
    single: Vec<(u32, Spectrum)>,
    len: usize,
}

impl Patches {
    /// The patches of a valid scene.
    pub(crate) fn new(spec: &SceneSpec) -> Self {
        let mut patches = Patches { surfaces: Vec::new(), single: Vec::new(), len: 0 };
        for surface in &spec.surfaces {
            let cells = surface.shape.cell_count();
            let first_patch = patches.len as u32;
            patches.surfaces.push(Common {
                first_patch,
                shape: surface.shape,
                area: surface.shape.area() / cells as f64,
                sides: surface.sides,
                reflectance: surface.reflectance,
                emittance: surface.emittance,
            });
            let single =
                surface.cell_emittance.iter().map(|&(cell, emittance)| (first_patch + cell, emittance));
            patches.single.extend(single);
            patches.len += cells as usize;
        }
        // Of several for one cell the last one counts.
        patches.single.reverse();
        patches.single.sort_by_key(|&(patch, _)| patch);
        patches.single.dedup_by_key(|&mut (patch, _)| patch);
        patches
    }

    /// How many there are.
    #[expect(clippy::len_without_is_empty, reason = "no scene is without patches")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Patch number `i`.
    ///
    /// # Panics
    /// Where there is none.
    pub fn get(&self, i: usize) -> Patch {
        assert!(i < self.len, "patch {i} of {}", self.len);
        let number = i as u32;
        let surface = self.surfaces.partition_point(|surface| surface.first_patch <= number) - 1;
        let common = &self.surfaces[surface];
        let cell = number - common.first_patch;
        let (corner, e_u, e_v) = common.shape.edges();
        let [u, v] = cell_centroid(&common.shape, cell);
        let single = self.single.binary_search_by_key(&number, |&(patch, _)| patch);
        Patch {
            surface: surface as u32,
            cell: common.shape.cell_label(cell),
            centroid: corner + e_u * u + e_v * v,
            area: common.area,
            sides: common.sides,
            reflectance: common.reflectance,
            emittance: single.map_or(common.emittance, |i| self.single[i].1),
        }
    }

    /// All of them in order.
    pub fn iter(&self) -> Iter<'_> {
        Iter { patches: self, range: 0..self.len }
    }
}

impl<'a> IntoIterator for &'a Patches {
    type Item = Patch;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

/// Patches in order.
#[derive(Clone, Debug)]
pub struct Iter<'a> {
    patches: &'a Patches,
    range: std::ops::Range<usize>,
}

impl Iterator for Iter<'_> {
    type Item = Patch;

    fn next(&mut self) -> Option<Patch> {
        self.range.next().map(|i| self.patches.get(i))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.range.size_hint()
    }
}

impl ExactSizeIterator for Iter<'_> {}
