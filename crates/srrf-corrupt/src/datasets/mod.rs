//! Sets of shapes from which registration pairs are made.

mod catalogue;
mod error;
mod folder;
mod held_out;
#[cfg(feature = "hdf5")]
mod modelnet_hdf5;
mod modelnet_off;
mod open;
mod resampled_text;
mod source;
#[cfg(feature = "hdf5")]
mod stored;

pub(crate) use catalogue::{Catalogue, Entry, Listed, checked};
pub use error::{ACCEPTED_LAYOUTS, SourceError};
pub use held_out::held_out;
pub use open::{default_data_path, open};
pub use source::{Label, SYMMETRIC_CLASSES, ShapeSource, Split};
