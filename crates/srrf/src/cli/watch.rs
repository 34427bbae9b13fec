//! [`Watch`]: what the library does, as signs of life.

use std::sync::Mutex;

use srrf::{Event, Observer, Stage};
use srrf_args::Progress;

/// Shows the stages of a registration.
pub struct Watch<'a> {
    progress: &'a Progress,
    /// The round that is being made, and how many there can be.
    round: Mutex<Option<(usize, usize)>>,
}

impl<'a> Watch<'a> {
    /// On these signs of life.
    pub fn new(progress: &'a Progress) -> Self {
        Self { progress, round: Mutex::new(None) }
    }
}

impl Observer for Watch<'_> {
    fn observe(&self, event: Event) {
        let Ok(mut round) = self.round.lock() else { return };
        match event {
            Event::Round { number, of } => *round = Some((number, of)),
            Event::Began(stage) => self.progress.step(match *round {
                Some((number, of)) => format!("round {number} of at most {of}: {}", doing(stage)),
                None => doing(stage),
            }),
            Event::Scale { number, of } => self.progress.step(format!("trying scale {number} of {of}")),
            _ => {}
        }
    }
}

/// What is done in a stage.
fn doing(stage: Stage) -> String {
    match stage {
        Stage::Open => "reading files, loading the network".into(),
        Stage::PrepareTarget => "preparing the target".into(),
        Stage::PrepareSource => "preparing the source".into(),
        Stage::Refine | Stage::RefineWider | Stage::RefineAgain => "ranking and refining".into(),
        looks => format!("looking for poses ({looks})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_in_words() {
        assert_eq!(doing(Stage::PrepareTarget), "preparing the target");
        assert_eq!(doing(Stage::FpfhRansac), "looking for poses (fpfh-ransac)");
        assert_eq!(doing(Stage::RefineAgain), "ranking and refining");
    }
}
