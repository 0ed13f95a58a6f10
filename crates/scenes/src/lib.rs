//! Scenes made by rule, for tests, benchmarks and studies: functions of their arguments alone, without files.
//!
//! Coordinates are whole multiples of 2⁻¹⁸ m wherever a curve was rounded to triangles, so that a scene is the
//! same on every machine and exact in 32-bit floating point, which other tracers take.

#![warn(unreachable_pub, unnameable_types)]

mod boxes;
mod furniture;
mod interior;
mod material;
mod mesh;
mod obj;
mod trials;

pub use boxes::{cornell, corridor, cube, cube_of_surfaces, furnace, in_cells, room};
pub use interior::{interior, interior_obj};
pub use trials::{cube_with_tile, far_lamp, moved, plates, two_rooms, unequal_rooms, wedge};
