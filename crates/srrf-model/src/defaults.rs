//! Defaults of configuration values that came later than files which lack them, and the tests by which such a value is
//! left out of a file again. In the form that serde calls.
#![allow(clippy::trivially_copy_pass_by_ref, reason = "the form that serde calls")]

/// The default of a factor.
pub fn one() -> f64 {
    1.0
}

/// Whether a factor is its default.
pub fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// Whether a weight is its default, which serde knows without help.
pub fn is_zero(value: &f64) -> bool {
    *value == 0.0
}
