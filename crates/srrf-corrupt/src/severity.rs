//! [`Severity`]: how strong a corruption is.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// A severity from 1 (weak) to 5 (strong), the five levels of ModelNet40-C.
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

    /// The number, 1 to 5.
    pub fn get(self) -> u8 {
        self.0
    }

    /// The entry of a table with one column for each severity.
    pub fn of<T: Copy>(self, table: &[T; 5]) -> T {
        table[usize::from(self.0) - 1]
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
    fn one_to_five() {
        assert_eq!(Severity::try_from(0), Err(SeverityOutOfRange("0".into())));
        assert_eq!("300".parse::<Severity>(), Err(SeverityOutOfRange("300".into())));
        assert!(Severity::try_from(9).unwrap_err().to_string().contains("severity 9"));
        let table = [10, 20, 30, 40, 50];
        for (i, severity) in Severity::ALL.into_iter().enumerate() {
            assert_eq!(Severity::try_from(severity.get()), Ok(severity));
            assert_eq!(severity.of(&table), table[i]);
        }
        assert!(serde_json::from_str::<Severity>("6").is_err());
        assert_eq!(serde_json::from_str::<Severity>("3").unwrap().get(), 3);
    }
}
