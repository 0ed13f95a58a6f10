//! Recognises closed boxes of axis-aligned rectangles.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};
use thiserror::Error;

use crate::rectangle::{Facing, Rectangle};

/// How far a coordinate may be off, relative to the extent of the box along its axis; and how much of a wall
/// may be missing, relative to its area.
const TOLERANCE: f64 = 1e-9;

/// Why a scene is not a closed box of axis-aligned rectangles. Surfaces count from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NotABox {
    /// A surface is a triangle.
    #[error(
        "surface {surface} is a triangle (closed forms are known here for rectangles only); \
         cut the walls into rectangles"
    )]
    Triangle {
        /// The number of the surface.
        surface: usize,
    },
    /// A surface reflects on both sides.
    #[error(
        "surface {surface} is two-sided (its back would look out of the box, where nothing returns light); \
         make it one-sided"
    )]
    TwoSided {
        /// The number of the surface.
        surface: usize,
    },
    /// The edges of a surface are not along two of the axes.
    #[error(
        "surface {surface} is not a rectangle along the axes (closed forms are known here for such \
         rectangles only); turn the scene so that its walls follow x, y and z"
    )]
    Slanted {
        /// The number of the surface.
        surface: usize,
    },
    /// A surface lies inside the box that bounds the scene.
    #[error(
        "surface {surface} lies inside the box that bounds the scene (it could hide patches from one \
         another, and the closed form of boxes knows no shadows); remove it"
    )]
    Inside {
        /// The number of the surface.
        surface: usize,
    },
    /// A wall looks out of the box.
    #[error("surface {surface} faces out of the box (its back would get the light); swap two of its corners")]
    FacesOut {
        /// The number of the surface.
        surface: usize,
    },
    /// Two surfaces of a wall overlap.
    #[error(
        "surfaces {first} and {second} overlap (one covers the other, and the closed form of boxes knows no \
         layers); remove one"
    )]
    Overlap {
        /// The one that comes first in the scene.
        first: usize,
        /// The one that comes second.
        second: usize,
    },
    /// A wall has a hole.
    #[error(
        "the wall at the {end} end of the {axis} axis lacks {missing:e} of its {area:e} m² (light would \
         leave, and the box not be closed); close it with more surfaces"
    )]
    Hole {
        /// `x`, `y` or `z`.
        axis: char,
        /// The end of the axis: `low` or `high`.
        end: &'static str,
        /// The area that no surface covers [m²].
        missing: f64,
        /// The area of the wall [m²].
        area: f64,
    },
}

/// A closed box whose walls are tiled by grids of rectangular patches: convex, so that nothing occludes.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxScene {
    patches: Vec<Rectangle>,
}

impl BoxScene {
    /// Finds the box that a scene is, anywhere in space and in any proportions, to a relative tolerance of
    /// 10⁻⁹. The scene must be one that [`radiosity::Scene::build`] accepts.
    ///
    /// # Errors
    /// [`NotABox`] names the first surface or wall that does not fit.
    pub fn recognise(spec: &SceneSpec) -> Result<Self, NotABox> {
        let frame = BoxGrid::new(spec);
        let tiles = spec.surfaces.iter().enumerate().map(|(number, surface)| frame.tile(number, surface));
        let tiles = tiles.collect::<Result<Vec<Rectangle>, NotABox>>()?;
        for axis in 0..3 {
            for facing in [Facing::Up, Facing::Down] {
                check_wall(&tiles, &frame, axis, facing)?;
            }
        }
        let cells = spec.surfaces.iter().zip(&tiles).map(|(surface, tile)| cells(&surface.shape, tile));
        Ok(BoxScene { patches: cells.flatten().collect() })
    }

    /// The patches in the order of their numbers [m], relative to the lowest corner of the box.
    pub fn patches(&self) -> &[Rectangle] {
        &self.patches
    }
}

/// The bounding box, and per axis the coordinates at which surfaces end.
struct BoxGrid {
    origin: DVec3,
    tolerance: DVec3,
    /// Ascending, relative to `origin`; coordinates that agree within the tolerance are one.
    levels: [Vec<f64>; 3],
}

impl BoxGrid {
    fn new(spec: &SceneSpec) -> Self {
        let corners: Vec<DVec3> = spec.surfaces.iter().flat_map(|surface| surface.shape.corners()).collect();
        let origin = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let top = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let tolerance = TOLERANCE * (top - origin);
        let levels =
            [0, 1, 2].map(|k| merge(corners.iter().map(|c| c[k] - origin[k]).collect(), tolerance[k]));
        BoxGrid { origin, tolerance, levels }
    }

    /// The place of a surface on the wall that it belongs to.
    fn tile(&self, number: usize, surface: &SurfaceSpec) -> Result<Rectangle, NotABox> {
        if let Shape::Triangle { .. } = surface.shape {
            return Err(NotABox::Triangle { surface: number });
        }
        if surface.sides == Sides::Both {
            return Err(NotABox::TwoSided { surface: number });
        }
        let (axis, facing) = self.normal(&surface.shape).ok_or(NotABox::Slanted { surface: number })?;
        let corners = surface.shape.corners();
        let (p, q) = (self.snap(corners[0]), self.snap(corners[2]));
        let (mut lo, mut hi) = (p.min(q), p.max(q));
        // Along the normal the corners agree within the tolerance; one of them counts.
        (lo[axis], hi[axis]) = (p[axis], p[axis]);
        let tile = Rectangle { axis, facing, lo, hi };
        if tile.area() == 0.0 {
            return Err(NotABox::Slanted { surface: number });
        }
        self.check_position(number, axis, facing, p[axis])?;
        Ok(tile)
    }

    /// The normal of a shape whose edges run along two different axes.
    fn normal(&self, shape: &Shape) -> Option<(usize, Facing)> {
        let (_, e_u, e_v) = shape.edges();
        let (along_u, along_v) = (self.axis_of(e_u)?, self.axis_of(e_v)?);
        if along_u == along_v {
            return None;
        }
        let axis = 3 - along_u - along_v;
        let facing = if e_u.cross(e_v)[axis] > 0.0 { Facing::Up } else { Facing::Down };
        Some((axis, facing))
    }

    /// The one axis along which an edge is longer than the tolerance.
    fn axis_of(&self, edge: DVec3) -> Option<usize> {
        let mut axes = (0..3).filter(|&axis| edge[axis].abs() > self.tolerance[axis]);
        axes.next().filter(|_| axes.next().is_none())
    }

    fn check_position(&self, surface: usize, axis: usize, facing: Facing, level: f64) -> Result<(), NotABox> {
        let inward = match level {
            level if level == self.wall(axis, Facing::Up) => Facing::Up,
            level if level == self.wall(axis, Facing::Down) => Facing::Down,
            _ => return Err(NotABox::Inside { surface }),
        };
        if facing == inward { Ok(()) } else { Err(NotABox::FacesOut { surface }) }
    }

    /// The level of the wall that faces that way.
    fn wall(&self, axis: usize, facing: Facing) -> f64 {
        match facing {
            Facing::Up => self.levels[axis][0],
            Facing::Down => self.levels[axis][self.levels[axis].len() - 1],
        }
    }

    fn extent(&self, axis: usize) -> f64 {
        self.wall(axis, Facing::Down) - self.wall(axis, Facing::Up)
    }

    /// One of the scene's corners relative to the origin, each coordinate replaced by its level.
    fn snap(&self, corner: DVec3) -> DVec3 {
        let offset = corner - self.origin;
        let level = |axis: usize| {
            let levels = &self.levels[axis];
            levels[levels.partition_point(|&level| level <= offset[axis]) - 1]
        };
        DVec3::new(level(0), level(1), level(2))
    }
}

/// Sorts coordinates and keeps one of those that agree within the tolerance.
fn merge(mut coordinates: Vec<f64>, tolerance: f64) -> Vec<f64> {
    coordinates.sort_by(f64::total_cmp);
    coordinates.dedup_by(|next, kept| *next - *kept <= tolerance);
    coordinates
}

/// Disjoint tiles on a wall whose areas add up to that of the wall leave no hole.
fn check_wall(tiles: &[Rectangle], frame: &BoxGrid, axis: usize, facing: Facing) -> Result<(), NotABox> {
    let on_wall = tiles.iter().enumerate().filter(|(_, tile)| (tile.axis, tile.facing) == (axis, facing));
    let on_wall: Vec<(usize, &Rectangle)> = on_wall.collect();
    for (n, &(first, a)) in on_wall.iter().enumerate() {
        if let Some(&(second, _)) = on_wall[n + 1..].iter().find(|(_, b)| overlap(a, b)) {
            return Err(NotABox::Overlap { first, second });
        }
    }
    let area: f64 = (0..3).filter(|&k| k != axis).map(|k| frame.extent(k)).product();
    let missing = area - on_wall.iter().map(|(_, tile)| tile.area()).sum::<f64>();
    if missing > TOLERANCE * area {
        let end = if facing == Facing::Up { "low" } else { "high" };
        return Err(NotABox::Hole { axis: ['x', 'y', 'z'][axis], end, missing, area });
    }
    Ok(())
}

/// Whether two tiles of one wall share area. Levels that coincide are equal, so touching is not sharing.
fn overlap(a: &Rectangle, b: &Rectangle) -> bool {
    a.spanned().into_iter().all(|k| a.lo[k].max(b.lo[k]) < a.hi[k].min(b.hi[k]))
}

/// The cells of a surface in the order of their patch numbers; `tile` is its snapped outline.
fn cells(shape: &Shape, tile: &Rectangle) -> Vec<Rectangle> {
    let (_, e_u, _) = shape.edges();
    let [p, q] = tile.spanned();
    let (along_u, along_v) = if e_u[p].abs() > e_u[q].abs() { (p, q) } else { (q, p) };
    (0..shape.cell_count() as u32).map(|cell| cell_of(shape, tile, [along_u, along_v], cell)).collect()
}

fn cell_of(shape: &Shape, tile: &Rectangle, along: [usize; 2], cell: u32) -> Rectangle {
    let (cells, label) = match *shape {
        Shape::Parallelogram { cells, .. } => (cells, shape.cell_label(cell)),
        Shape::Divided { ref leaves, .. } => (leaves.get(cell).grid(), leaves.get(cell).at),
        Shape::Triangle { .. } => unreachable!("tiles are parallelograms"),
    };
    let (_, e_u, e_v) = shape.edges();
    let mut rectangle = *tile;
    for ((axis, edge), (index, count)) in along.into_iter().zip([e_u, e_v]).zip(label.into_iter().zip(cells))
    {
        // Cells run from the corner, which is at the high end where the edge points down.
        let index = if edge[axis] > 0.0 { index } else { count - 1 - index };
        let [lo, hi] = tile.interval(axis);
        rectangle.lo[axis] = grid_line(lo, hi, index, count);
        rectangle.hi[axis] = grid_line(lo, hi, index + 1, count);
    }
    rectangle
}

/// Grid line k of n between lo and hi, exact at both ends.
fn grid_line(lo: f64, hi: f64, k: u32, n: u32) -> f64 {
    if k == n { hi } else { lo + (hi - lo) * (f64::from(k) / f64::from(n)) }
}
