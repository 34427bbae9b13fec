//! The losses, each a scalar tensor of shape `[1]`.

mod matching;
mod registration;
mod skeleton;

pub use matching::matching_loss;
pub use registration::{correspondence_loss, registration_loss};
pub use skeleton::{SkeletonLoss, SkeletonLossConfig, chamfer, skeleton_loss, spread};
