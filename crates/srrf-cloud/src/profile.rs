//! Where the time goes: named stages, timed when a program is asked to (`--profile`).
//!
//! Off, a stage costs one read of a flag. Stages nest; each thread has its own nesting, and the times of all
//! threads are added.

use std::cell::RefCell;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

static ON: AtomicBool = AtomicBool::new(false);
static TIMES: Mutex<Vec<StageTotal>> = Mutex::new(Vec::new());

thread_local! {
    /// Stages that this thread is in, the outermost first.
    static PATH: RefCell<Vec<&'static str>> = const { RefCell::new(Vec::new()) };
}

/// The time of one stage.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageTotal {
    /// Names of the stages around it, the outermost first, and its own.
    pub path: Vec<&'static str>,
    /// How often it ran to its end.
    pub calls: u64,
    /// Time of all calls, over all threads.
    pub time: Duration,
}

/// Starts to time stages, in all threads.
pub fn start() {
    ON.store(true, Ordering::Relaxed);
}

/// Whether stages are timed.
pub fn is_on() -> bool {
    ON.load(Ordering::Relaxed)
}

/// Runs `job` as the stage `name`.
pub fn stage<T>(name: &'static str, job: impl FnOnce() -> T) -> T {
    if !is_on() {
        return job();
    }
    let place = enter(name);
    let begun = Instant::now();
    let result = job();
    let time = begun.elapsed();
    PATH.with_borrow_mut(Vec::pop);
    if let Some(entry) = TIMES.lock().unwrap_or_else(PoisonError::into_inner).get_mut(place) {
        entry.calls += 1;
        entry.time += time;
    }
    result
}

/// The place of the stage among all.
fn enter(name: &'static str) -> usize {
    PATH.with_borrow_mut(|path| {
        path.push(name);
        let mut times = TIMES.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = times.iter().position(|entry| entry.path == *path) {
            return place;
        }
        times.push(StageTotal { path: path.clone(), calls: 0, time: Duration::ZERO });
        times.len() - 1
    })
}

/// What was timed so far.
pub fn report() -> Report {
    Report(TIMES.lock().unwrap_or_else(PoisonError::into_inner).clone())
}

/// Times of all stages, to be printed.
#[derive(Debug, Clone)]
pub struct Report(pub Vec<StageTotal>);

impl Report {
    /// Writes the stages inside `parent` in the order of their first call, each followed by its own.
    fn inside(&self, f: &mut fmt::Formatter<'_>, parent: &[&'static str], whole: f64) -> fmt::Result {
        for entry in self.0.iter().filter(|e| e.path.split_last().is_some_and(|(_, around)| around == parent))
        {
            let name = entry.path.last().copied().unwrap_or_default();
            let indent = 2 * parent.len();
            let (seconds, calls) = (entry.time.as_secs_f64(), entry.calls);
            writeln!(
                f,
                "{:indent$}{name:<width$} {seconds:>10.3} {calls:>9} {:>10.3} {:>5.1}",
                "",
                1e3 * seconds / calls.max(1) as f64,
                100.0 * seconds / whole,
                width = 28_usize.saturating_sub(indent),
            )?;
            self.inside(f, &entry.path, whole)?;
        }
        Ok(())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outermost = self.0.iter().filter(|e| e.path.len() == 1);
        let whole: f64 = outermost.map(|e| e.time.as_secs_f64()).sum();
        writeln!(f, "{:<28} {:>10} {:>9} {:>10} {:>5}", "stage", "seconds", "calls", "ms a call", "%")?;
        self.inside(f, &[], whole.max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_nest_and_add_up() {
        assert_eq!(stage("off", || 1), 1);
        assert!(report().0.is_empty(), "nothing is timed before the start");
        start();
        let nap = || std::thread::sleep(Duration::from_millis(2));
        let work = || {
            stage("outer", || {
                stage("first", nap);
                stage("second", nap);
                stage("first", nap);
            });
        };
        std::thread::scope(|scope| {
            scope.spawn(work);
            scope.spawn(work);
        });
        let Report(times) = report();
        let of = |path: &[&str]| times.iter().find(|e| e.path == path).cloned().unwrap();
        let (outer, first, second) = (of(&["outer"]), of(&["outer", "first"]), of(&["outer", "second"]));
        assert_eq!((outer.calls, first.calls, second.calls), (2, 4, 2));
        assert!(first.time >= Duration::from_millis(8) && outer.time >= first.time + second.time);
        let text = report().to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[1].starts_with("outer ") && lines[1].ends_with("100.0"), "{text}");
        assert!(lines[2].starts_with("  first ") && lines[3].starts_with("  second "), "{text}");
    }
}
