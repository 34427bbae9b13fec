//! [`StageClock`]: measures stages, and tells of them.

use std::time::Instant;

use crate::event::{Event, Observed};
use crate::stage::{Stage, StageTime};

/// Measures stages one after the other.
#[derive(Debug)]
pub(crate) struct StageClock<'a> {
    last: Instant,
    times: Vec<StageTime>,
    observed: Observed<'a>,
}

impl<'a> StageClock<'a> {
    /// Starts with stages that were measured before.
    pub fn after(times: Vec<StageTime>, observed: Observed<'a>) -> Self {
        Self { last: Instant::now(), times, observed }
    }

    /// Tells that a stage begins; its time runs since the last lap.
    pub fn begin(&self, stage: Stage) {
        self.observed.tell(Event::Began(stage));
    }

    /// The time since the last lap was this stage's.
    pub fn lap(&mut self, stage: Stage) {
        let time = StageTime { stage, seconds: self.last.elapsed().as_secs_f64() };
        self.times.push(time);
        self.observed.tell(Event::Ended(time));
        self.last = Instant::now();
    }

    /// Whether this stage has had a lap.
    pub fn has(&self, stage: Stage) -> bool {
        self.times.iter().any(|time| time.stage == stage)
    }

    /// The stages so far.
    pub fn into_times(self) -> Vec<StageTime> {
        self.times
    }
}
