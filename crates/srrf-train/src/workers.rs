//! The threads that compute the shards of a batch.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A pool of rayon pools: shards run side by side. On the CPU each pool has one thread: nothing inside a
/// shard is split, so that results do not depend on the number of threads.
pub struct Workers(Vec<rayon::ThreadPool>);

impl Workers {
    /// `threads` workers.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        Self::wide(threads, 1)
    }

    /// `workers` workers, each of which may split what the host does for its shard among `threads`
    /// threads.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub fn wide(workers: usize, threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build();
        (0..workers.max(1)).map(pool).collect::<Result<_, _>>().map(Self)
    }

    /// `job(0) .. job(count - 1)`, in order.
    pub fn map<T: Send>(&self, count: usize, job: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
        let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(count)));
        let work = || loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                break;
            }
            let result = job(i);
            if let Ok(mut done) = done.lock() {
                done.push((i, result));
            }
        };
        std::thread::scope(|scope| {
            for pool in &self.0 {
                scope.spawn(|| pool.install(work));
            }
        });
        let mut done = done.into_inner().ok()?;
        done.sort_by_key(|(i, _)| *i);
        (done.len() == count).then(|| done.into_iter().map(|(_, result)| result).collect())
    }
}
