//! The Python module of SRRF.

use pyo3::prelude::*;

/// The compiled part of the Python package `srrf`.
#[pymodule]
fn _srrf(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
