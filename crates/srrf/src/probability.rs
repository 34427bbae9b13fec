//! [`Probability`]: a number in [0, 1].

use std::fmt;

use serde::Serialize;

/// A probability: finite and in [0, 1]. [`fmt::Display`] takes the precision of a number, such as `{:.2}`.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Probability(f64);

impl Probability {
    /// Never.
    pub const ZERO: Self = Self(0.0);
    /// As often as not.
    pub const HALF: Self = Self(0.5);

    /// `None` for NaN, infinity and numbers outside [0, 1].
    pub fn new(value: f64) -> Option<Self> {
        (0.0..=1.0).contains(&value).then_some(Self(value))
    }

    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl fmt::Display for Probability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_but_a_probability() {
        for bad in [f64::NAN, f64::INFINITY, -1e-9, 1.0 + 1e-9] {
            assert_eq!(Probability::new(bad), None);
        }
        let half = Probability::new(0.5).unwrap();
        assert_eq!((half, half.get(), format!("{half:.2}").as_str()), (Probability::HALF, 0.5, "0.50"));
        assert!(Probability::ZERO < half);
        assert_eq!(serde_json::to_value(half).unwrap(), 0.5);
    }
}
