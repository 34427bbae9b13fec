//! The lattice of control points that the three distortions share (paper and code).

/// Control points along each axis.
pub const CONTROL_POINTS_PER_AXIS: usize = 5;

/// All control points.
pub const CONTROL_POINTS: usize = CONTROL_POINTS_PER_AXIS * CONTROL_POINTS_PER_AXIS * CONTROL_POINTS_PER_AXIS;

/// Displacements of the control points. The one at step `(i, j, k)` along x, y, z has index `(5 i + j) 5 + k`.
pub type Displacements = [[f64; 3]; CONTROL_POINTS];
