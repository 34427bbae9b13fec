//! [`Severity`]: how strong a corruption is.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A severity from 1 (weak) to 5 (strong), the five levels of ModelNet40-C; and, for measuring how
/// methods do beyond what they were trained on, [`Severity::BEYOND`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub struct Severity(u8);

/// A number that is not a severity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("severity {0} does not exist: severities are 1, 2, 3, 4 and 5")]
pub struct SeverityOutOfRange(pub String);

impl Severity {
    /// All severities, weakest first.
    pub const ALL: [Self; 5] = [Self(1), Self(2), Self(3), Self(4), Self(5)];

    /// Severities 6 and 7, ours: every parameter goes on from severity 5 by the step from 4 to 5. They
    /// are not among [`Severity::ALL`], and no text and no configuration gives them. Corruptions that a
    /// step would take beyond what is possible stay as they are at 5 (`upsampling` copies every point
    /// there).
    pub const BEYOND: [Self; 2] = [Self(6), Self(7)];

    /// The number, 1 to 5, or that of [`Severity::BEYOND`].
    pub fn get(self) -> u8 {
        self.0
    }

    /// The entry of a table with one column for each severity; beyond its end the last entry and as
    /// many of the last step.
    pub fn of<T: Stepped>(self, table: &[T; 5]) -> T {
        match self.beyond() {
            0 => table[usize::from(self.0) - 1],
            steps => table[4].step(table[3], steps),
        }
    }

    /// The share `1 / divisor` of a table of divisors, whose steps beyond the end are those of the
    /// share; at most 1.
    pub(crate) fn share_of(self, divisors: &[usize; 5]) -> f64 {
        self.of(&divisors.map(|d| 1.0 / d as f64)).min(1.0)
    }

    /// Steps beyond severity 5.
    pub(crate) fn beyond(self) -> u8 {
        self.0.saturating_sub(5)
    }
}

/// A parameter whose table can be gone on with.
pub trait Stepped: Copy {
    /// `self + steps (self - before)`, not below zero.
    fn step(self, before: Self, steps: u8) -> Self;
}

impl Stepped for f64 {
    fn step(self, before: Self, steps: u8) -> Self {
        (self + f64::from(steps) * (self - before)).max(0.0)
    }
}

impl Stepped for usize {
    fn step(self, before: Self, steps: u8) -> Self {
        let steps = Self::from(steps);
        (self + steps * self).saturating_sub(steps * before)
    }
}

impl TryFrom<u8> for Severity {
    type Error = SeverityOutOfRange;

    fn try_from(value: u8) -> Result<Self, Self::Error> {
        if (1..=5).contains(&value) { Ok(Self(value)) } else { Err(SeverityOutOfRange(value.to_string())) }
    }
}

impl FromStr for Severity {
    type Err = SeverityOutOfRange;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse::<u8>()
            .ok()
            .and_then(|n| n.try_into().ok())
            .ok_or_else(|| SeverityOutOfRange(text.to_owned()))
    }
}

impl From<Severity> for u8 {
    fn from(severity: Severity) -> Self {
        severity.0
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_go_on_by_their_last_step() {
        let [six, seven] = Severity::BEYOND;
        assert_eq!((six.of(&[1usize, 2, 3, 5, 8]), seven.of(&[1usize, 2, 3, 5, 8])), (11, 14));
        assert_eq!(seven.of(&[9usize, 8, 7, 6, 1]), 0);
        assert!((seven.of(&[0.1, 0.2, 0.3, 0.4, 0.45]) - 0.55).abs() < 1e-12);
        // One of 15 and one of 10 points: steps of one of 30.
        assert!((six.share_of(&[30, 25, 20, 15, 10]) - 4.0 / 30.0).abs() < 1e-12);
        assert_eq!(six.share_of(&[5, 4, 3, 2, 1]), 1.0);
        assert!(Severity::try_from(6).is_err() && "7".parse::<Severity>().is_err());
        assert!(serde_json::from_str::<Severity>(&serde_json::to_string(&six).unwrap()).is_err());
    }

    #[test]
    fn one_to_five() {
        assert_eq!(Severity::try_from(0), Err(SeverityOutOfRange("0".into())));
        assert_eq!("300".parse::<Severity>(), Err(SeverityOutOfRange("300".into())));
        assert!(Severity::try_from(9).unwrap_err().to_string().contains("severity 9"));
        let table: [usize; 5] = [10, 20, 30, 40, 50];
        for (i, severity) in Severity::ALL.into_iter().enumerate() {
            assert_eq!(Severity::try_from(severity.get()), Ok(severity));
            assert_eq!(severity.of(&table), table[i]);
        }
        assert!(serde_json::from_str::<Severity>("6").is_err());
        assert_eq!(serde_json::from_str::<Severity>("3").unwrap().get(), 3);
    }
}
