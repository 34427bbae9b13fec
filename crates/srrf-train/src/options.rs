//! What changes how far and how fast a run goes, not what it computes; and how it ended.

use std::path::PathBuf;
use std::time::Duration;

/// What to do with a checkpoint that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Go on from it.
    Resume,
    /// Start over. The old run is kept until the new one has a checkpoint.
    Restart,
    /// Stop with [`TrainError::Exists`](crate::TrainError::Exists).
    Refuse,
}

/// Options that change how far and how fast a run goes, not what it computes.
pub struct RunOptions {
    /// Folder of the run.
    pub folder: PathBuf,
    /// Worker threads.
    pub threads: usize,
    /// What to do with a checkpoint that is there.
    pub existing: Existing,
    /// Stop after this many steps, counted from the start of the run.
    pub until_step: Option<usize>,
    /// Stop after this time; a step that is not done by then is left out, and made anew by the next session.
    pub time_limit: Option<Duration>,
    /// Where lines about the run go when there is no terminal for the progress bar.
    pub say: fn(&str),
}

/// How a call ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// Steps done since the start of the run.
    pub step: usize,
    /// Steps done in this session.
    pub done: usize,
    /// Whether the run is complete.
    pub complete: bool,
    /// Steps left out.
    pub skipped: usize,
    /// Where the best weights are, if there were any yet.
    pub best: Option<PathBuf>,
}
