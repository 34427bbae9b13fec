//! The ground floor of SRRF: point clouds, rigid poses, neighbours, files, and the seam
//! [`Register`] that every registration method implements. No tensors live here.
//!
//! Coordinates are `f64` throughout, in the unit of the input. Poses carry their frames in their
//! names: `target_from_source` maps source coordinates into the target frame,
//! `target ~ R source + t`.

mod centred;
mod cloud;
mod euler;
mod extent;
mod fps;
mod frame;
pub mod io;
mod mesh;
mod neighbours;
mod normals;
pub mod pose;
pub mod profile;
mod register;
mod right;
mod rigid;
mod solid;
mod triangles;
mod unit;
mod voxel;

pub use centred::CentredCloud;
pub use cloud::{CloudError, PointCloud, UnitSphere};
pub use euler::EulerXyz;
pub use fps::farthest_point_sampling;
pub use frame::PairFrame;
pub use mesh::{FEWEST_SCANNED, LEAST_SAMPLES, MOST_SAMPLES, MeshError, TriangleMesh};
pub use neighbours::KnnIndex;
pub use normals::{estimate_normals, least_direction};
pub use register::{
    Branch, BranchKind, Certainty, Register, RegisterError, Registration, Skeleton, Skeletons, SoftMatch,
};
pub use right::{RIGHT_IN_WORDS, RIGHT_RADIUS_SHARE, RIGHT_ROTATION_DEG, is_right};
pub use rigid::Rigid;
pub use solid::Solid;
pub use triangles::Triangles;
pub use unit::{LengthUnit, UnitError};
pub use voxel::{
    VoxelError, coarsen, point_spacing, spacing_of, thin_from, thin_to, voxel_downsample, voxel_downsample_to,
};
