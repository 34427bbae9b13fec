//! Seeing a registration: one self-contained HTML page with an interactive 3D view.
//!
//! ```
//! use srrf_cloud::{PointCloud, Rigid};
//! use srrf_view::{Number, Page, Pair, Pose};
//!
//! let source = PointCloud::new(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])?;
//! let target = PointCloud::new(vec![[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 2.0, 0.0]])?;
//! let mut pose = Rigid::identity();
//! pose.translation.x = 5.0;
//! let html = Page::new("Two scans")
//!     .pair(
//!         Pair::new("scan 1 onto scan 2", &source, &target)
//!             .pose(Pose::new("result", pose))
//!             .number(Number::new("Inlier RMSE", 0.0).unit("m")),
//!     )
//!     .to_html();
//! assert!(html.starts_with("<!doctype html>"));
//! # Ok::<(), srrf_cloud::CloudError>(())
//! ```
//!
//! The page needs no network and no server: it opens from a file, in a light or a dark scheme, on a
//! phone. It shows the source before and after each pose, the target, skeletons with radii, the
//! strongest matches, and the distance of each source point to its nearest target point.
//!
//! Large clouds are thinned for display (at most [`POINTS_PER_CLOUD`] points each, fewer in a page
//! of many pairs) and the page says so. Coordinates are centred in `f64`, then stored with 16 bits
//! per axis over the cloud's bounding box: a drawn point is off by at most half of 1/65535 of the
//! box's edge along each axis. Distances are computed from the unrounded points against the whole
//! target; in targets of more than 10,000 points those beyond a tenth of half the bounding box's
//! diagonal are not told apart, and the page says so.
//!
//! What cannot be drawn (a pose with NaN, a skeleton with too few radii) is left out with a warning
//! on the page, so one failed method does not cost a report.

mod bundle;
mod describe;
mod encode;
mod encoded;
mod html;
mod map_page;
mod number;
mod page;
mod pair;
mod quantise;
mod residual;
mod sample;
mod still;
mod up;

pub use bundle::viewer_script;
pub use html::viewer_element;
pub use map_page::{MAP_POINTS, MapLink, MapPage, MapScan};
pub use number::{Number, Tone};
pub use page::{Page, ViewError};
pub use pair::{Pair, PointValues, Pose};
pub use srrf_cloud::{Skeleton, SoftMatch};
pub use still::to_png;
pub use up::Up;

/// Most points of one cloud that a page draws. Phones turn two clouds of this size smoothly, and a
/// page of one pair stays under 4 MB.
pub const POINTS_PER_CLOUD: usize = 120_000;

/// Most matches of one pair that a page draws, the strongest first: more lines hide each other.
pub const MATCHES_PER_PAIR: usize = 300;

/// Bytes of points and distances in one page before base64, which adds a third: about 7 MB of HTML.
/// Shared evenly by the pairs of a page.
pub const PAGE_BYTES: usize = 5_400_000;
