//! [`Event`]: what a registration is doing, told while it does it.

use std::fmt;

use crate::probability::Probability;
use crate::stage::{Stage, StageTime};

/// A message of a running registration.
///
/// They come in this order: [`Began`](Event::Began) and [`Ended`](Event::Ended) for each stage, in pairs; before the stages of a
/// round of starts its [`Round`](Event::Round), after them [`Judged`](Event::Judged) where there is a pose by then.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// A stage begins.
    Began(Stage),
    /// A stage has ended.
    Ended(StageTime),
    /// A scale is tried.
    Scale {
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        of: usize,
    },
    /// A round of starts begins; later rounds are made only where those before them leave doubt.
    Round {
        /// Its number, from 1.
        number: usize,
        /// How many there can be.
        of: usize,
    },
    /// The best pose after a round has been judged.
    Judged {
        /// The number of the round, from 1.
        round: usize,
        /// That the pose is right.
        probability: Probability,
        /// Whether no other round is needed.
        sure: bool,
    },
}

/// Is told what a registration does; every `Fn(Event) + Sync` is one. It is called on the thread that registers and should return
/// at once.
pub trait Observer: Sync {
    /// Takes a message.
    fn observe(&self, event: Event);
}

impl<F: Fn(Event) + Sync> Observer for F {
    fn observe(&self, event: Event) {
        self(event);
    }
}

/// An observer, if there is one.
#[derive(Clone, Copy, Default)]
pub struct Observed<'a>(Option<&'a dyn Observer>);

impl<'a> Observed<'a> {
    /// By this observer.
    pub fn by(observer: &'a dyn Observer) -> Self {
        Self(Some(observer))
    }

    /// Tells the observer.
    pub(crate) fn tell(self, event: Event) {
        if let Some(observer) = self.0 {
            observer.observe(event);
        }
    }
}

impl fmt::Debug for Observed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Observed" } else { "not observed" })
    }
}
