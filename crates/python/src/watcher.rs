//! How Python hears of walks, and ends them.

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;

/// A function of Python that is told where walks stand, and what it has raised.
pub(crate) struct Watcher {
    function: Option<Py<PyAny>>,
    trouble: Option<PyErr>,
}

impl Watcher {
    pub(crate) fn new(function: Option<Py<PyAny>>) -> Self {
        Watcher { function, trouble: None }
    }

    /// Tells the function; whether walks go on, for which no signal came and nothing was raised. The interpreter is taken for as long as this takes, and
    /// let go while walks go on.
    pub(crate) fn tell(&mut self, stage: impl for<'py> PyCallArgs<'py>) -> bool {
        let outcome = Python::attach(|py| {
            py.check_signals()?;
            self.function.as_ref().map_or(Ok(()), |function| function.call1(py, stage).map(drop))
        });
        self.trouble = outcome.err();
        self.trouble.is_none()
    }

    /// What came of the walks; `None` where they were given up.
    ///
    /// # Errors
    /// What was raised.
    pub(crate) fn end<T>(self, done: Option<T>) -> PyResult<T> {
        match (self.trouble, done) {
            (Some(trouble), _) => Err(trouble),
            (None, Some(done)) => Ok(done),
            (None, None) => unreachable!("walks are given up for trouble alone"),
        }
    }
}
