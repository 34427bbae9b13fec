//! [`Memo`]: values that are computed once for each key.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The last few values, by key, shared between threads.
///
/// Nothing is computed under the lock, so that a value may itself be computed in parallel: two threads that ask at the
/// same time both compute, and both get the value of the first to finish. Values follow from their keys, so that no
/// answer depends on what is kept.
#[derive(Debug)]
pub(crate) struct Memo<K, V> {
    kept: Mutex<Vec<(K, Arc<V>)>>,
    most: usize,
}

impl<K: PartialEq, V> Memo<K, V> {
    /// Keeps up to `most` values, the newest.
    pub fn new(most: usize) -> Self {
        Self { kept: Mutex::new(Vec::new()), most }
    }

    /// The value of a key, if it is kept.
    pub fn find(&self, key: &K) -> Option<Arc<V>> {
        find(&self.kept(), key)
    }

    /// Keeps a value, unless one came first; the one that is kept.
    pub fn keep(&self, key: K, value: V) -> Arc<V> {
        let mut kept = self.kept();
        if let Some(first) = find(&kept, &key) {
            return first;
        }
        if kept.len() >= self.most.max(1) {
            kept.remove(0);
        }
        let value = Arc::new(value);
        kept.push((key, Arc::clone(&value)));
        value
    }

    /// The value of a key, made where it is not kept.
    ///
    /// # Errors
    /// Those of `make`; nothing is kept then.
    pub fn get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        match self.find(&key) {
            Some(value) => Ok(value),
            None => Ok(self.keep(key, make()?)),
        }
    }

    fn kept(&self) -> MutexGuard<'_, Vec<(K, Arc<V>)>> {
        // A thread that panicked left a whole list behind.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn find<K: PartialEq, V>(kept: &[(K, Arc<V>)], key: &K) -> Option<Arc<V>> {
    kept.iter().find(|(known, _)| known == key).map(|(_, value)| Arc::clone(value))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn makes_each_value_once_and_forgets_the_oldest() {
        let memo = Memo::new(2);
        let mut made = Vec::new();
        for key in [1, 2, 1, 3, 2, 1] {
            let value = memo.get(key, || -> Result<i32, Infallible> {
                made.push(key);
                Ok(10 * key)
            });
            assert_eq!(*value.unwrap(), 10 * key);
        }
        assert_eq!(made, [1, 2, 3, 1], "1 was forgotten when 3 came");
        assert_eq!(memo.find(&2), None);
    }

    #[test]
    fn the_first_value_stays_and_errors_leave_nothing() {
        let memo = Memo::new(2);
        assert_eq!(memo.get(1, || Err("no")), Err("no"));
        assert_eq!((*memo.keep(1, "first"), *memo.keep(1, "second")), ("first", "first"));
    }
}
