//! The widest vectors of the processor.

use pulp::Arch;

/// Runs a loop with the widest vectors of the processor.
pub fn vectorized<T>(job: impl FnOnce() -> T) -> T {
    Arch::new().dispatch(job)
}
