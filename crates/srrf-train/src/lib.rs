//! Trains the SRRF network and the learned baselines: configuration, pairs, schedule, checkpoints, the
//! loop. [`network`] is the seam between the loop and what it trains.

pub mod ahead;
pub mod baseline;
pub mod checkpoint;
pub mod cli;
pub mod config;
pub mod data;
pub mod log;
pub mod network;
pub mod optimizer;
pub mod resources;
pub mod rows;
pub mod run;
pub mod schedule;
pub mod srrf;
mod start;
pub mod step;
pub mod validate;
