//! Results for other programs: VTK for ParaView, glTF for viewers and modellers, Parquet for data frames. All have the
//! corners of the patches. Exchange factors as matrices for NumPy and for Matrix Market.

#[cfg(test)]
mod agree;
mod glb;
pub(crate) mod matrix_market;
pub(crate) mod npz;
mod parquet;
mod table;
mod vtu;

pub use glb::write_glb;
pub use parquet::write_parquet;
pub use table::{Cells, Column, columns, corners, read_table};
pub use vtu::write_vtu;
