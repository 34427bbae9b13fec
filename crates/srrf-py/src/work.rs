//! Work without the interpreter's lock: on threads of the call's own, with an ear for Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::refusal::{Fault, Refusal};

/// How long a signal such as Ctrl-C may wait.
const PATIENCE: Duration = Duration::from_millis(50);
/// Most pools that are kept for the next call.
const KEPT: usize = 8;
/// Most threads that can be asked for.
const MOST_THREADS: usize = 4096;

/// The pools of one process that nobody uses. Threads do not survive a fork, so that a child begins with none.
struct Idle {
    process: u32,
    pools: Mutex<Vec<(usize, ThreadPool)>>,
}

/// Never freed: a child must not touch the pools of its parent, not even to drop them.
static IDLE: AtomicPtr<Idle> = AtomicPtr::new(std::ptr::null_mut());

fn idle() -> &'static Idle {
    let process = process::id();
    loop {
        let known = IDLE.load(Ordering::Acquire);
        // SAFETY: what is stored comes from `Box::into_raw` and is never freed.
        if let Some(idle) = unsafe { known.as_ref() }
            && idle.process == process
        {
            return idle;
        }
        let fresh = Box::into_raw(Box::new(Idle { process, pools: Mutex::new(Vec::new()) }));
        if IDLE.compare_exchange(known, fresh, Ordering::AcqRel, Ordering::Acquire).is_err() {
            // SAFETY: another thread was first, and nobody has seen this one.
            drop(unsafe { Box::from_raw(fresh) });
        }
    }
}

/// Number of threads that `asked` stands for: all cores where nothing was asked.
///
/// # Errors
/// [`Refusal`] for none and for very many.
pub fn threads(asked: Option<i64>) -> Result<usize, Refusal> {
    let Some(asked) = asked else {
        return Ok(thread::available_parallelism().map_or(1, usize::from));
    };
    usize::try_from(asked).ok().filter(|n| (1..=MOST_THREADS).contains(n)).ok_or_else(|| {
        Refusal::new(
            Fault::Option,
            format!("num_threads is {asked}: expected a whole number from 1 to {MOST_THREADS}, or None for all cores"),
        )
    })
}

fn pool(threads: usize) -> Result<ThreadPool, Refusal> {
    let mut pools = idle().pools.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(at) = pools.iter().position(|(size, _)| *size == threads) {
        return Ok(pools.swap_remove(at).1);
    }
    drop(pools);
    ThreadPoolBuilder::new().num_threads(threads).thread_name(|n| format!("srrf-{n}")).build().map_err(|e| {
        Refusal::new(
            Fault::Internal,
            format!("cannot start {threads} threads: {e}; pass a smaller num_threads"),
        )
    })
}

fn give_back(threads: usize, pool: ThreadPool) {
    let mut pools = idle().pools.lock().unwrap_or_else(PoisonError::into_inner);
    if pools.len() < KEPT {
        pools.push((threads, pool));
    }
}

/// Runs `work` on `threads` threads without the interpreter's lock, and answers what it answers. Each call has threads of
/// its own, so that calls from several Python threads never wait for each other.
///
/// Signals are heard meanwhile. Where their handler raises, as that of Ctrl-C does, the call ends at once; the flag that
/// `work` holds is set then, and what is left of it ends in the background at its next look at the flag.
///
/// # Errors
/// What the handler raises; the [`Refusal`] of `work`; [`Fault::Internal`] where it panics.
pub fn run<T, F>(py: Python<'_>, threads: usize, work: F) -> PyResult<T>
where
    T: Send + 'static,
    F: FnOnce(&Arc<AtomicBool>) -> Result<T, Refusal> + Send + 'static,
{
    let pool = pool(threads)?;
    let stop = Arc::new(AtomicBool::new(false));
    let (answer, answers) = mpsc::sync_channel(1);
    let answers = Mutex::new(answers);
    let flag = Arc::clone(&stop);
    pool.spawn(move || {
        // What the work was given is not looked at again after a panic.
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&flag)));
        let _ = answer.send(outcome);
    });
    loop {
        match py.detach(|| answers.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(PATIENCE)) {
            Ok(outcome) => {
                give_back(threads, pool);
                let outcome = outcome.unwrap_or_else(|panic| {
                    let what = panic.downcast_ref::<String>().map(String::as_str);
                    let what = what.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic");
                    Err(Refusal::new(
                        Fault::Internal,
                        format!("a fault of the library, please report it: {what}"),
                    ))
                });
                return Ok(outcome?);
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    stop.store(true, Ordering::Relaxed);
                    return Err(raised);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Refusal::new(Fault::Internal, "a worker thread has gone").into());
            }
        }
    }
}
