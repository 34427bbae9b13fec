//! The compiled part of the Python package `srrf`.
//!
//! The package's own files (`python/srrf`) hold what a user sees: its classes, their documentation and types. Here is
//! what they call: clouds are copied out of NumPy once ([`cloud`]), the work runs without the interpreter's lock on
//! threads of its own ([`work`]), and what goes wrong becomes an exception of the package ([`refusal`]).

use pyo3::prelude::*;

use refusal::{Fault, Refusal};

mod align;
mod bases;
mod cloud;
mod corruption;
mod files;
mod options;
mod pairs;
mod picture;
mod pose;
mod program;
mod refusal;
mod registrar;
mod score;
mod surface;
mod work;

/// JSON as the program writes it: keys in order, numbers in the fewest digits that give the same bits.
///
/// # Errors
/// `InternalError` for text that is no JSON.
#[pyfunction]
fn canonical_json(text: &str) -> Result<String, Refusal> {
    let value: serde_json::Value =
        serde_json::from_str(text).map_err(|e| Refusal::new(Fault::Internal, format!("no JSON: {e}")))?;
    Ok(value.to_string())
}

/// The compiled part of the Python package `srrf`.
#[pymodule]
fn _srrf(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("CORRUPTIONS", corruption::names())?;
    module.add("FORMATS", srrf_cloud::io::format_names())?;
    module.add_class::<cloud::Cloud>()?;
    module.add_class::<registrar::PyRegistrar>()?;
    module.add_class::<registrar::PyTarget>()?;
    module.add_class::<pairs::Pairs>()?;
    module.add_function(wrap_pyfunction!(align::align, module)?)?;
    module.add_function(wrap_pyfunction!(canonical_json, module)?)?;
    module.add_function(wrap_pyfunction!(corruption::corrupt, module)?)?;
    module.add_function(wrap_pyfunction!(files::open, module)?)?;
    module.add_function(wrap_pyfunction!(files::read, module)?)?;
    module.add_function(wrap_pyfunction!(files::scans, module)?)?;
    module.add_function(wrap_pyfunction!(files::unit_factor, module)?)?;
    module.add_function(wrap_pyfunction!(files::write, module)?)?;
    module.add_function(wrap_pyfunction!(picture::page, module)?)?;
    module.add_function(wrap_pyfunction!(pose::rigid_motion, module)?)?;
    module.add_function(wrap_pyfunction!(program::program, module)?)?;
    module.add_function(wrap_pyfunction!(score::score, module)?)
}
