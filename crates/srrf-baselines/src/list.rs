//! The one list of learned baselines: what training, scoring and reports know of them.

use srrf_model::embedded::TrainedWeights;

use crate::{BASELINES, LearnedConfig};

/// A learned baseline.
#[derive(Debug, Clone, Copy)]
pub struct BaselineEntry {
    /// Name of the method, in configurations and tables: [`LearnedConfig::NAME`].
    pub name: &'static str,
    /// Trained weights in the program, if there are some.
    pub weights: Option<TrainedWeights>,
}

/// What somebody does with a baseline of which only the name is known: [`visit`](crate::visit) calls it with its type.
pub trait BaselineVisitor {
    /// What comes of it.
    type Output;

    /// Is called with the configuration of the baseline.
    fn visit<C: LearnedConfig + 'static>(self) -> Self::Output;
}

/// The weights in the program of the baseline of this name, if there are any.
pub fn embedded(name: &str) -> Option<&'static [u8]> {
    BASELINES.iter().find(|entry| entry.name == name)?.weights.map(|weights| weights.bytes)
}

/// Makes the modules of the baselines, [`BASELINES`](crate::BASELINES) and [`visit`](crate::visit) from the list in `lib.rs`:
/// a line is `module::Configuration;`, or `module::Configuration, weights "file in weights/";`.
macro_rules! learned_baselines {
    ($($module:ident::$config:ident $(, weights $weights:literal)?;)+) => {
        $(mod $module;)+
        $(pub use $module::*;)+

        /// All learned baselines, in the order of the tables.
        pub const BASELINES: &[BaselineEntry] = &[$(BaselineEntry {
            name: <$module::$config as LearnedConfig>::NAME,
            weights: learned_baselines!(@trained $($weights)?),
        }),+];

        /// Calls `visitor` with the configuration of the baseline `name`; `None` where there is none of that name.
        pub fn visit<V: BaselineVisitor>(name: &str, visitor: V) -> Option<V::Output> {
            $(if name == <$module::$config as LearnedConfig>::NAME {
                return Some(visitor.visit::<$module::$config>());
            })+
            None
        }
    };
    (@trained) => { None };
    (@trained $weights:literal) => {
        Some(TrainedWeights {
            bytes: include_bytes!(concat!("../weights/", $weights, ".safetensors")),
            card: include_str!(concat!("../weights/", $weights, ".md")),
        })
    };
}
