//! What the programs of the lab share.

/// Shapes that the network of the program, `srrf`, was validated with ([`srrf_corrupt::datasets::held_out`]):
/// `data.validation` of its configuration.
pub const VALIDATION_SHAPES: usize = 192;
