//! [`SharedTargets`]: targets that many pairs have in common are read and prepared once.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use srrf::Target;
use srrf_args::files::Input;

/// Most targets that are kept at one time.
const KEPT: usize = 32;

/// A target that is ready, with what was read.
#[derive(Debug)]
pub struct ReadyTarget {
    pub input: Input,
    /// None for a mesh, whose points are drawn for each source.
    pub target: Option<Target>,
}

/// Ready, or in words why not.
type Made = Result<ReadyTarget, String>;

#[derive(Debug, Default)]
struct Slot {
    /// Pairs that still want it.
    left: usize,
    /// When it was wanted last.
    wanted: u64,
    made: Option<Arc<OnceLock<Made>>>,
}

/// Targets by name, each made by the first pair that wants it, and dropped after the last.
#[derive(Debug, Default)]
pub struct SharedTargets(Mutex<(u64, HashMap<String, Slot>)>);

impl SharedTargets {
    /// For pairs that want these targets.
    pub fn new<'a>(wanted: impl Iterator<Item = &'a str>) -> Self {
        let mut slots: HashMap<String, Slot> = HashMap::new();
        for name in wanted {
            slots.entry(name.to_owned()).or_default().left += 1;
        }
        Self(Mutex::new((0, slots)))
    }

    /// Does `work` with a target, which `make` makes where it is not there. Others who want it wait meanwhile.
    ///
    /// # Errors
    /// Those of `make` and of `work`.
    pub fn with<T>(
        &self,
        name: &str,
        make: impl FnOnce() -> Made,
        work: impl FnOnce(&ReadyTarget) -> Result<T, String>,
    ) -> Result<T, String> {
        let cell = self.cell(name);
        let done = match cell.get_or_init(make) {
            Ok(ready) => work(ready),
            Err(problem) => Err(problem.clone()),
        };
        let mut locked = self.lock();
        if let Some(slot) = locked.1.get_mut(name) {
            slot.left = slot.left.saturating_sub(1);
            if slot.left == 0 {
                slot.made = None;
            }
        }
        done
    }

    fn cell(&self, name: &str) -> Arc<OnceLock<Made>> {
        let mut locked = self.lock();
        let (clock, slots) = &mut *locked;
        *clock += 1;
        let slot = slots.entry(name.to_owned()).or_default();
        slot.wanted = *clock;
        if let Some(made) = &slot.made {
            return made.clone();
        }
        let made: Arc<OnceLock<Made>> = Arc::default();
        slot.made = Some(made.clone());
        let held = slots.iter().filter(|(_, slot)| slot.made.is_some());
        if held.clone().count() > KEPT
            && let Some(oldest) = held.min_by_key(|(_, slot)| slot.wanted).map(|(name, _)| name.clone())
            && let Some(slot) = slots.get_mut(&oldest)
        {
            slot.made = None; // who works with it has it still
        }
        made
    }

    fn lock(&self) -> MutexGuard<'_, (u64, HashMap<String, Slot>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_are_found_once_and_told_to_all() {
        let shared = SharedTargets::new(["a", "b", "a"].into_iter());
        let mut made = 0;
        for _ in 0..2 {
            let answer = shared.with(
                "a",
                || {
                    made += 1;
                    Err("gone".to_owned())
                },
                |_| Ok(()),
            );
            assert_eq!(answer, Err("gone".to_owned()));
        }
        assert_eq!(made, 1);
        assert!(shared.lock().1["a"].made.is_none(), "nobody wants it any more");
        for i in 0..2 * KEPT {
            shared.cell(&i.to_string());
        }
        assert_eq!(shared.lock().1.values().filter(|slot| slot.made.is_some()).count(), KEPT);
        assert!(shared.lock().1["0"].made.is_none() && shared.lock().1["63"].made.is_some());
    }
}
