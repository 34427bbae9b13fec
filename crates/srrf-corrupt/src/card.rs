//! [`Card`]: what the registry knows of a corruption.

use std::fmt;

use crate::corruption::Corruption;
use crate::variants::Variants;

/// Points of the clouds for which counts of corruptions are stated. For other clouds they grow in
/// proportion, so that a severity always means the same share of the cloud.
pub const REFERENCE_POINTS: usize = 1024;

/// The paper's three families of corruptions: its figures 2 to 4 and tables 1 to 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// Regions are denser or sparser than the rest.
    Density,
    /// Points are displaced or added at random.
    Noise,
    /// The whole shape is deformed.
    Transformation,
}

impl Family {
    /// In the paper's order.
    pub const ALL: [Self; 3] = [Self::Density, Self::Noise, Self::Transformation];

    /// In lower case, as in the paper.
    pub fn name(self) -> &'static str {
        match self {
            Self::Density => "density",
            Self::Noise => "noise",
            Self::Transformation => "transformation",
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What the registry knows of a corruption; each is stated in the corruption's own file.
#[derive(Debug)]
pub struct Card {
    /// The paper's name in snake case, which is also the name of the file.
    pub name: &'static str,
    /// The paper's family.
    pub family: Family,
    /// What it does to a cloud of [`REFERENCE_POINTS`] points, in half a line.
    pub summary: &'static str,
    /// What grows with the severity.
    pub strength: Strength,
    /// Makes it, in the readings of the paper that are asked for.
    pub build: fn(&Variants) -> Box<dyn Corruption>,
}

/// What grows with the severity, one entry for each of the severities 1 to 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Strength {
    /// A length or a coefficient of this name.
    Value(&'static str, [f64; 5]),
    /// A number of this name.
    Count(&'static str, [usize; 5]),
    /// One point of so many.
    OneOf([usize; 5]),
}

impl fmt::Display for Strength {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, values) = match self {
            Self::Value(name, values) => (*name, values.map(|v| v.to_string())),
            Self::Count(name, counts) => (*name, counts.map(|n| n.to_string())),
            Self::OneOf(divisors) => ("points", divisors.map(|d| (REFERENCE_POINTS / d).to_string())),
        };
        write!(f, "{name} {}", values.join(" "))
    }
}
