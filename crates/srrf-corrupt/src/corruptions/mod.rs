//! The registry: one file and one line for each corruption.
//!
//! # A new corruption
//! 1. Write `corruptions/rain.rs`: a type that implements [`Corruption`](crate::Corruption), its numbers with
//!    their sources, and a `CARD` (name, family, a line for lists, what grows with the severity, how it is made).
//! 2. Add `Rain = rain,` to the list below, at its end: the order numbers the corruptions in seeds and tables.
//!
//! Nothing else changes: the names on the command line and in files, the lists, the contact sheet, the
//! benchmark's pairs and the training's draws all come from here. A corruption that is not for everybody needs
//! not even that: see `examples/own_corruption.rs`.
//!
//! # Numbers
//! Tables have one column for each severity, 1 to 5. Unless a line says otherwise the numbers are those of
//! ModelNet40-C (Sun et al. 2022, `data/generate_c.py` and `data/distortion.py`), on which the paper's corruptions
//! are built and whose severities it leaves unstated. Lengths are in the canonical unit: clouds have radius 1.
//! The lengths for which the paper states another number are in [`Variants`](crate::Variants).
//!
//! The deterministic core of each corruption takes its draws as arguments and is public, so that it can be
//! compared with other implementations number by number.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::card::Card;

mod blocks;
pub mod clusters;
mod draws;
pub mod lattice;
pub mod rbf;
#[cfg(test)]
pub(crate) mod testing;

/// Declares the files, the names and the order of the corruptions.
macro_rules! corruptions {
    ($($kind:ident = $file:ident,)+) => {
        $(pub mod $file;)+

        /// The corruptions by name: the paper's twelve, in its order (density, noise, transformation).
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum CorruptionKind {
            $(
                #[doc = concat!("See [`", stringify!($file), "`](crate::corruptions::", stringify!($file), ").")]
                $kind,
            )+
        }

        impl CorruptionKind {
            /// All corruptions in the paper's order.
            pub const ALL: [Self; [$(Self::$kind),+].len()] = [$(Self::$kind),+];

            /// What its file says of it.
            pub fn card(self) -> &'static Card {
                match self {
                    $(Self::$kind => &$file::CARD,)+
                }
            }
        }

        #[cfg(test)]
        const FILES: [&str; CorruptionKind::ALL.len()] = [$(stringify!($file)),+];
    };
}

corruptions! {
    DensityInc = density_inc,
    DensityDec = density_dec,
    Cutout = cutout,
    Uniform = uniform,
    Gaussian = gaussian,
    Background = background,
    Impulse = impulse,
    Upsampling = upsampling,
    Shear = shear,
    Distortion = distortion,
    DistortionRbf = distortion_rbf,
    DistortionRbfInv = distortion_rbf_inv,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variants::Variants;

    #[test]
    fn a_corruption_is_called_as_its_file_everywhere() {
        for (kind, file) in CorruptionKind::ALL.into_iter().zip(FILES) {
            assert_eq!(kind.card().name, file);
            assert_eq!((kind.card().build)(&Variants::paper()).name(), file);
            assert_eq!(serde_json::to_value(kind).unwrap(), file);
        }
    }
}
