//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum, value_parser};
use srrf_corrupt::{CorruptionKind, Severity, Variants};

use crate::sheet::Up;

/// Corrupts point clouds in the twelve ways of the SRRF paper.
///
/// The cloud is brought to the unit sphere, corrupted there, and mapped back. Files are PLY, XYZ
/// and other text, NPY or OFF, by their extension.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Cli {
    /// Draws a sheet instead.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// List the corruptions and what grows with their severity.
    #[arg(long, exclusive = true)]
    pub list: bool,
    /// Corrupts a file.
    #[command(flatten)]
    pub corrupt: Option<CorruptArgs>,
}

/// What can be done besides corrupting a file.
#[derive(Subcommand)]
pub enum Command {
    /// Draw every corruption at every severity as a PNG.
    Sheet(SheetArgs),
}

/// How to corrupt a file.
#[derive(Args)]
pub struct CorruptArgs {
    /// The cloud to corrupt.
    pub input: PathBuf,
    /// Which corruption; --list shows them.
    #[arg(short, long, value_name = "NAME")]
    pub corruption: CorruptionKind,
    /// How strong, 1 to 5.
    #[arg(short, long, default_value = "3", value_name = "1-5")]
    pub severity: Severity,
    /// Seed of all draws.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// The cloud to write.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The readings of the corruptions.
    #[arg(long, value_enum, default_value_t = Reading::Paper)]
    pub variants: Reading,
    /// Leave out points with NaN or infinite coordinates instead of refusing the file.
    #[arg(long)]
    pub drop_nan: bool,
}

/// How to draw a sheet.
#[derive(Args)]
pub struct SheetArgs {
    /// The cloud to show; a built-in shape without it.
    pub input: Option<PathBuf>,
    /// The PNG to write.
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
    /// Seed of all draws.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Points of the clean cloud: larger clouds are thinned to so many.
    #[arg(long, default_value_t = 1024, value_parser = value_parser!(u32).range(32..=100_000))]
    pub points: u32,
    /// The readings of the corruptions.
    #[arg(long, value_enum, default_value_t = Reading::Paper)]
    pub variants: Reading,
    /// The axis that points up in the picture.
    #[arg(long, value_enum, default_value_t = Up::Z)]
    pub up: Up,
    /// Where the eye is, in degrees around that axis.
    #[arg(long, default_value_t = 215.0, allow_negative_numbers = true)]
    pub yaw: f64,
    /// Leave out points with NaN or infinite coordinates instead of refusing the file.
    #[arg(long)]
    pub drop_nan: bool,
}

/// Where the paper's text and the reference code differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Reading {
    /// The paper's text.
    Paper,
    /// The code of ModelNet40-C.
    #[value(name = "modelnet40-c")]
    ModelNet40C,
}

impl From<Reading> for Variants {
    fn from(reading: Reading) -> Self {
        match reading {
            Reading::Paper => Self::paper(),
            Reading::ModelNet40C => Self::modelnet40_c(),
        }
    }
}
