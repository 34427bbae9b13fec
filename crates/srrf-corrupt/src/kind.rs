//! What can be asked of a [`CorruptionKind`].

use std::{fmt, str::FromStr};

use crate::card::Family;
use crate::corruption::Corruption;
use crate::corruptions::CorruptionKind;
use crate::variants::Variants;

/// A name that belongs to no corruption.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown corruption `{name}`: choose one of {}", CorruptionKind::ALL.map(CorruptionKind::name).join(", "))]
pub struct UnknownCorruption {
    /// The name that was given.
    pub name: String,
}

impl CorruptionKind {
    /// The paper's name in snake case.
    pub fn name(self) -> &'static str {
        self.card().name
    }

    /// The paper's family.
    pub fn family(self) -> Family {
        self.card().family
    }

    /// The corruptions of a family, in the paper's order.
    pub fn of_family(family: Family) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |kind| kind.family() == family)
    }
}

/// The corruption of this name, in the readings that `variants` chooses.
pub fn corruption(kind: CorruptionKind, variants: &Variants) -> Box<dyn Corruption> {
    (kind.card().build)(variants)
}

impl fmt::Display for CorruptionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for CorruptionKind {
    type Err = UnknownCorruption;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownCorruption { name: name.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        for kind in CorruptionKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
        assert_eq!(
            CorruptionKind::of_family(Family::Density).map(CorruptionKind::name).collect::<Vec<_>>(),
            ["density_inc", "density_dec", "cutout"]
        );
        let all = Family::ALL.into_iter().flat_map(CorruptionKind::of_family);
        assert!(all.eq(CorruptionKind::ALL), "each in one family, families in the paper's order");
        let error = "rain".parse::<CorruptionKind>().unwrap_err().to_string();
        assert!(error.contains("`rain`") && error.contains("density_inc, density_dec"), "{error}");
    }
}
