//! `--reading`: where the paper's text and the reference code differ.

use clap::{Args, ValueEnum};
use srrf_args::flags::{help, value};

use crate::variants::Variants;

/// The readings of the corruptions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Reading {
    /// The paper's text.
    Paper,
    /// The code of ModelNet40-C.
    #[value(name = "modelnet40_c", alias = "modelnet40-c")]
    ModelNet40C,
}

/// `--reading`
#[derive(Debug, Clone, Copy, Args)]
pub struct ReadingArgs {
    #[arg(
        long,
        alias = "variants",
        value_enum,
        hide_possible_values = false,
        value_name = value::READING,
        default_value_t = Reading::Paper,
        help = help::READING
    )]
    reading: Reading,
}

impl ReadingArgs {
    /// The numbers of that reading.
    pub fn variants(self) -> Variants {
        match self.reading {
            Reading::Paper => Variants::paper(),
            Reading::ModelNet40C => Variants::modelnet40_c(),
        }
    }
}
