//! What the stages share: clouds on the host with their neighbours and samples, rows of tables, and distances.
//! All of it is deterministic.

mod clouds;
mod copy;
mod distance;
mod gather;
mod neighbours;
mod sampling;
pub(crate) mod simd;

pub use clouds::{HostClouds, flat_indices};
pub use copy::{CopyError, to_host};
pub use distance::nearest_distance;
pub(crate) use distance::{distance, nearest_rows, squared_distances};
pub(crate) use gather::on_cubecl;
pub use gather::{RowNumbers, rows, rows_at};
pub use neighbours::{k_nearest, nearest, share_within};
pub use sampling::{even_subsample, even_tokens, farthest_points, token_rows};
