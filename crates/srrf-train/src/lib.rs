//! Trains the SRRF network: configuration, pairs, schedule, checkpoints, the loop.

pub mod checkpoint;
pub mod config;
pub mod data;
pub mod log;
pub mod resources;
pub mod run;
pub mod schedule;
pub mod step;
pub mod validate;
