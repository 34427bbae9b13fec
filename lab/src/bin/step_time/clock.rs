//! Times and memory.

use std::time::Instant;

use serde_json::{Map, Value, json};

use srrf_lab::Failure;

use crate::Arguments;

/// Runs `job`, and gives its result and the seconds it took.
fn clock<T>(job: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = job();
    (result, start.elapsed().as_secs_f64())
}

/// Seconds of each repetition after the warm-up.
pub fn timed(
    arguments: &Arguments,
    mut job: impl FnMut() -> Result<(), Failure>,
) -> Result<Vec<f64>, Failure> {
    for _ in 0..arguments.warmup {
        job()?;
    }
    (0..arguments.repeats.max(1))
        .map(|_| {
            let (result, seconds) = clock(&mut job);
            result.map(|()| seconds)
        })
        .collect()
}

/// The middle of the times.
pub fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The middle and the least of the times.
pub fn summary(times: &[f64]) -> Map<String, Value> {
    let least = times.iter().copied().fold(f64::INFINITY, f64::min);
    let mut found = Map::new();
    found.insert("median_s".into(), json!(median(times)));
    found.insert("min_s".into(), json!(least));
    found.insert("repeats".into(), json!(times.len()));
    found
}

/// A line of /proc/self/status in MiB, such as the peak of the resident memory; `None` elsewhere than
/// on Linux. (`getrusage` counts in what the parent process held before it started this one.)
pub fn memory_mib(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    let kib: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib / 1024.0)
}
