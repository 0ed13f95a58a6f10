//! Tables on their way to numpy.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use report::{Column, ColumnCells};

/// A column: its name, numpy's word for its cells, and the bytes of these, or their words.
pub(crate) type PyColumn<'py> = (String, &'static str, Bound<'py, PyAny>);

/// The columns of a table. Whole numbers with missing ones among them become numbers, where a missing one is NaN.
pub(crate) fn to_python<'py>(py: Python<'py>, columns: Vec<Column>) -> PyResult<Vec<PyColumn<'py>>> {
    columns.into_iter().map(|Column { name, cells }| column(py, name, cells)).collect()
}

fn column(py: Python<'_>, name: String, cells: ColumnCells) -> PyResult<PyColumn<'_>> {
    let (kind, cells) = match cells {
        ColumnCells::Words(words) => ("str", PyList::new(py, words)?.into_bound_py_any(py)?),
        ColumnCells::Number(numbers) => ("<f8", floats(py, numbers.into_iter())?),
        ColumnCells::Whole(numbers) if numbers.iter().all(Option::is_some) => {
            let bytes: Vec<u8> = numbers.into_iter().flatten().flat_map(i64::to_le_bytes).collect();
            ("<i8", PyBytes::new(py, &bytes).into_bound_py_any(py)?)
        }
        ColumnCells::Whole(numbers) => {
            ("<f8", floats(py, numbers.into_iter().map(|number| number.map(|number| number as f64)))?)
        }
    };
    Ok((name, kind, cells))
}

fn floats(py: Python<'_>, numbers: impl Iterator<Item = Option<f64>>) -> PyResult<Bound<'_, PyAny>> {
    let bytes: Vec<u8> = numbers.flat_map(|number| number.unwrap_or(f64::NAN).to_le_bytes()).collect();
    PyBytes::new(py, &bytes).into_bound_py_any(py)
}
