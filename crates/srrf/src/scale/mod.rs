//! The scale between two clouds: doubts about it, and a search for it.

mod applied;
mod check;
mod doubt;
mod estimate;
mod similarity;

pub use applied::{AppliedScale, ScaleOrigin};
pub use doubt::{CloudSize, ScaleDoubt};
