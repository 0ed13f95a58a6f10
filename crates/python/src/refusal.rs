//! What radwalk refuses, as an exception of Python.

use std::fmt::Display;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(
    radwalk,
    Error,
    PyException,
    "What radwalk refuses, or could not do. The message names the problem, its reason and the remedy, as the program does."
);

/// What went wrong, in the program's own words, as an exception.
pub(crate) fn refuse(error: impl Display) -> PyErr {
    Error::new_err(error.to_string())
}
