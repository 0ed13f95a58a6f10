//! The native half of the Python package `radwalk`: what crosses the border between the languages, and nothing else. The other half,
//! `python/radwalk`, makes arrays, frames and words of it.
//!
//! Arrays cross as bytes, so that the extension needs no numpy to be built and works with any.

#![warn(unreachable_pub, unnameable_types)]

mod answer;
mod daylight;
mod factors;
mod mesh;
mod refusal;
mod run;
mod table;
mod watcher;

use pyo3::prelude::*;

#[pymodule]
mod _radwalk {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::answer::Answer;
    #[pymodule_export]
    use crate::daylight::daylight;
    #[pymodule_export]
    use crate::factors::factors;
    #[pymodule_export]
    use crate::mesh::ArrayMesh;
    #[pymodule_export]
    use crate::refusal::Error;
    #[pymodule_export]
    use crate::run::{exact, load, run};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("__git__", env!("RADWALK_GIT"))
    }
}
