//! Every parameter of every corruption, with its source.
//!
//! Tables have one column for each severity, 1 to 5. Unless a line says otherwise the numbers are
//! those of ModelNet40-C (Sun et al. 2022, `data/generate_c.py` and `data/distortion.py`), on
//! which the paper's corruptions are built and whose severities it leaves unstated. Lengths are in
//! the canonical unit: clouds have radius 1. The lengths for which the paper states another
//! number are in [`Variants`](crate::Variants).
//!
//! Counts are stated for clouds of [`REFERENCE_POINTS`] points. For other clouds they grow in
//! proportion, so that a severity always means the same share of the cloud.

/// Number of points of the clouds for which the counts below are stated.
pub const REFERENCE_POINTS: usize = 1024;

/// Points of the clouds that ModelNet40-C thins for its `density_inc`: twice the reference.
pub const DENSITY_INC_DENSE_POINTS: usize = 2048;

/// Fewest points for which the corruptions of density are defined: below, a cluster of `cutout`
/// rounds to less than one point.
pub const DENSITY_MIN_POINTS: usize = 32;

/// `density_inc` and `density_dec`: points of a cluster, the nearest of its centre, which counts.
pub const DENSITY_CLUSTER_POINTS: usize = 100;

/// `density_inc` and `density_dec`: number of clusters.
pub const DENSITY_CLUSTERS: [usize; 5] = [1, 2, 3, 4, 5];

/// `density_dec`: points deleted from each cluster.
pub const DENSITY_DEC_DELETED: usize = 75;

/// `cutout`: points of a cluster, all of which are deleted.
pub const CUTOUT_CLUSTER_POINTS: usize = 30;

/// `cutout`: number of clusters.
pub const CUTOUT_CLUSTERS: [usize; 5] = [2, 3, 5, 7, 10];

/// `uniform`: largest noise on each coordinate.
pub const UNIFORM_HALF_WIDTH: [f64; 5] = [0.01, 0.02, 0.03, 0.04, 0.05];

/// `gaussian`: standard deviation of the noise on each coordinate.
pub const GAUSSIAN_SIGMA: [f64; 5] = [0.010, 0.015, 0.020, 0.025, 0.030];

/// `gaussian`: coordinates are clipped to plus and minus this (paper: "constrained within the
/// range of -1 to 1"; the code clips the coordinates, not the noise).
pub const GAUSSIAN_CLIP: f64 = 1.0;

/// `background`: one point is added for each so many points, in the cube `[-1, 1]^3`.
pub const BACKGROUND_DIVISOR: [usize; 5] = [45, 40, 35, 30, 20];

/// `impulse`: one of so many points is displaced.
pub const IMPULSE_DIVISOR: [usize; 5] = [30, 25, 20, 15, 10];

/// `upsampling`: one of so many points is copied.
pub const UPSAMPLING_DIVISOR: [usize; 5] = [5, 4, 3, 2, 1];

/// `shear`: mean magnitude of a coefficient.
pub const SHEAR_COEFFICIENT: [f64; 5] = [0.05, 0.10, 0.15, 0.20, 0.25];

/// `shear`: a magnitude is uniform within this distance of its mean.
pub const SHEAR_SPREAD: f64 = 0.05;

/// `distortion`, `distortion_rbf`, `distortion_rbf_inv`: control points along each axis (paper
/// and code).
pub const CONTROL_POINTS_PER_AXIS: usize = 5;

/// `distortion`, `distortion_rbf`, `distortion_rbf_inv`: all control points.
pub const CONTROL_POINTS: usize = CONTROL_POINTS_PER_AXIS * CONTROL_POINTS_PER_AXIS * CONTROL_POINTS_PER_AXIS;

/// `distortion`: largest displacement of a control point on each coordinate, in units of the
/// lattice's side, [`DISTORTION_BOX_SIDE`].
pub const DISTORTION_AMPLITUDE: [f64; 5] = [0.1, 0.2, 0.3, 0.4, 0.5];

/// `distortion`: side of the lattice's box `[-1, 1]^3`. PyGeM measures displacements in it, so
/// the amplitudes above count double.
pub const DISTORTION_BOX_SIDE: f64 = 2.0;

/// `distortion_rbf` and `distortion_rbf_inv`: length of each control point's displacement.
pub const RBF_SHIFT: [f64; 5] = [0.025, 0.05, 0.075, 0.1, 0.125];

/// `distortion_rbf` and `distortion_rbf_inv`: radius of the basis functions. The paper names it
/// `r` without a number; this is the default of PyGeM, which the code leaves as it is.
pub const RBF_RADIUS: f64 = 0.5;
