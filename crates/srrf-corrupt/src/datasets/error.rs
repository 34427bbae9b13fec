//! Why a source of shapes cannot be opened or sampled.

use std::path::{Path, PathBuf};

use srrf_cloud::CloudError;
use srrf_cloud::io::IoError;

/// The layouts that [`crate::datasets::open`] accepts, for messages.
pub const ACCEPTED_LAYOUTS: &str = "accepted layouts: \
     ModelNet40 as HDF5 (ply_data_train0.h5, ... and shape_names.txt; 1,024 or 2,048 points) or one such .h5 file, \
     as OFF meshes (class/train/*.off, class/test/*.off), \
     as resampled text (modelnet40_train.txt, modelnet40_test.txt, class/name.txt), \
     or a folder of clouds or meshes in any format that srrf reads (.ply, .pcd, .off, .obj, .xyz, .csv, .npy, ...)";

/// Why a source of shapes cannot be opened or sampled.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// Nothing usable at the path.
    #[error("no shapes found at {path:?}: {looked}; {ACCEPTED_LAYOUTS}")]
    NotFound {
        /// The path that was given.
        path: PathBuf,
        /// What was looked for, and where.
        looked: String,
    },
    /// A file or folder cannot be read.
    #[error("cannot read {path:?}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file is not HDF5, or is damaged.
    #[cfg(feature = "hdf5")]
    #[error("{path:?} is truncated, damaged or not HDF5; fetch it again: {source}")]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// The reader's reason.
        source: Box<hdf5_pure::Error>,
    },
    /// A file is readable, but its content is not what the layout calls for.
    #[error("{path:?}: {problem}")]
    Layout {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what is expected.
        problem: String,
    },
    /// A file with a cloud cannot be read.
    #[error(transparent)]
    File(#[from] IoError),
    /// A shape is not a usable cloud.
    #[error("{path:?}, shape {shape}: {source}")]
    Shape {
        /// The file or folder.
        path: PathBuf,
        /// Number or name of the shape in it.
        shape: String,
        /// What is wrong with it.
        source: CloudError,
    },
    /// A family of procedural shapes that does not exist, or none at all.
    #[error("there is no family of shapes named {name:?}; the families are {known}")]
    Families {
        /// The name that was given.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// A set of no shapes was asked for.
    #[error("a set of 0 shapes was asked for; 1 is the least")]
    NoShapes,
    /// There is no shape of that number.
    #[error("shape {index} was asked for, but there are only {len}")]
    NoSuchShape {
        /// The number asked for.
        index: usize,
        /// How many shapes there are.
        len: usize,
    },
}

impl SourceError {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }

    #[cfg(feature = "hdf5")]
    pub(crate) fn hdf5(path: &Path, source: hdf5_pure::Error) -> Self {
        Self::Hdf5 { path: path.to_owned(), source: Box::new(source) }
    }

    pub(crate) fn layout(path: &Path, problem: impl Into<String>) -> Self {
        Self::Layout { path: path.to_owned(), problem: problem.into() }
    }
}
