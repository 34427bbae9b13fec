//! Registration pairs: a shape, corrupted and posed, with the exact answer.

mod config;
mod oracle;
mod pair;
mod pose;
mod stream;
mod synthesis;

pub use config::{Corrupt, InvalidConfig, Normalize, PairConfig, RotationRange, Sampling};
pub use oracle::oracle_pose;
pub use pair::{Bases, Pair, PairError};
pub use pose::{PoseDraw, dcp_test_pose};
pub use stream::{Purpose, Stream};
pub use synthesis::PairSynthesizer;
