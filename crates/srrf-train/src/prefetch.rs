//! Prefetching: threads make items by number, a few more than are asked for, so that a device that
//! computes elsewhere never waits for the pairs of its next step.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Items made ahead, by number.
pub struct Prefetch<T> {
    state: Mutex<PrefetchState<T>>,
    changed: Condvar,
}

struct PrefetchState<T> {
    /// The number that the next free thread makes.
    next: usize,
    /// Items may be made up to here.
    end: usize,
    /// What is made; nothing where making it panicked.
    ready: BTreeMap<usize, Option<T>>,
    closed: bool,
}

impl<T: Send> Prefetch<T> {
    /// Items from number `first` on, at most `depth` more than were taken.
    pub fn new(first: usize, depth: usize) -> Self {
        let state = PrefetchState { next: first, end: first + depth, ready: BTreeMap::new(), closed: false };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Makes items until [`Prefetch::close`]: what each of the threads does.
    pub fn work(&self, make: impl Fn(usize) -> T) {
        loop {
            let mut state = self.lock();
            while !state.closed && state.next >= state.end {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
            if state.closed {
                return;
            }
            let number = state.next;
            state.next += 1;
            drop(state);
            let made = catch_unwind(AssertUnwindSafe(|| make(number))).ok();
            self.lock().ready.insert(number, made);
            self.changed.notify_all();
        }
    }

    /// Item `number`, once it is made; each can be taken once. None where making it panicked, or after
    /// [`Prefetch::close`].
    pub fn take(&self, number: usize) -> Option<T> {
        let mut state = self.lock();
        loop {
            if let Some(made) = state.ready.remove(&number) {
                state.end += 1;
                self.changed.notify_all();
                return made;
            }
            if state.closed {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends the work; every thread leaves after the item it is at.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, PrefetchState<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Closes when it goes out of scope, also on the way of an error.
pub struct Closing<'a, T: Send>(pub &'a Prefetch<T>);

impl<T: Send> Drop for Closing<'_, T> {
    fn drop(&mut self) {
        self.0.close();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn items_come_by_number_and_not_too_early() {
        const DEPTH: usize = 3;
        let (ahead, most) = (Prefetch::new(5, DEPTH), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            let _closing = Closing(&ahead);
            for _ in 0..4 {
                scope.spawn(|| {
                    ahead.work(|i| {
                        most.fetch_max(i, Ordering::Relaxed);
                        i * i
                    });
                });
            }
            // Within the depth the order is the taker's.
            for (taken, i) in [6, 5, 7, 9, 8, 10].into_iter().enumerate() {
                assert_eq!(ahead.take(i), Some(i * i));
                assert!(most.load(Ordering::Relaxed) < 5 + taken + 1 + DEPTH);
            }
        });
        assert_eq!(ahead.take(1000), None, "closed");
    }

    #[test]
    fn a_panic_is_an_empty_item() {
        let ahead = Prefetch::new(0, 2);
        std::thread::scope(|scope| {
            let _closing = Closing(&ahead);
            scope.spawn(|| ahead.work(|i| if i == 1 { std::panic::resume_unwind(Box::new(())) } else { i }));
            assert_eq!((ahead.take(0), ahead.take(1), ahead.take(2)), (Some(0), None, Some(2)));
        });
    }
}
