//! Results for other programs: VTK for ParaView, glTF for viewers and modellers, Parquet for data frames. All have the
//! corners of the patches. Exchange factors as matrices for NumPy, SciPy and Matrix Market, and as
//! view factors for the programs that read these.

#[cfg(test)]
mod agree;
mod csr;
mod glb;
pub(crate) mod matrix_market;
mod matrix_rows;
mod netcdf;
pub(crate) mod npz;
mod parquet;
mod table;
mod view_factors;
mod vtu;

pub use csr::{CsrKind, CsrNumbers, write_csr};
pub use glb::write_glb;
pub use matrix_market::write as write_mtx;
pub use matrix_rows::{MatrixRow, MatrixRows};
pub use netcdf::write_udales_netcdf;
pub(crate) use parquet::write_columns_parquet;
pub use parquet::{FactorEntry, write_factors_parquet, write_parquet};
pub use table::{Column, ColumnCells, columns, corners, read_table};
pub use view_factors::{
    FoamList, write_energyplus, write_openfoam, write_openfoam_map, write_udales, write_udales_sky,
    write_view3d,
};
pub use vtu::write_vtu;
