//! [`LengthUnit`]: what coordinates are counted in.

use std::fmt;
use std::str::FromStr;

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Micrometre.
    Micrometre,
    /// Millimetre.
    Millimetre,
    /// Centimetre.
    Centimetre,
    /// Metre.
    Metre,
    /// Kilometre.
    Kilometre,
    /// Inch, 25.4 mm.
    Inch,
    /// International foot, 304.8 mm.
    Foot,
    /// United States survey foot, 1200/3937 m.
    UsSurveyFoot,
}

/// No such unit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no unit `{0}`; there are um, mm, cm, m, km, in, ft and us-ft")]
pub struct UnitError(String);

impl LengthUnit {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Micrometre,
        Self::Millimetre,
        Self::Centimetre,
        Self::Metre,
        Self::Kilometre,
        Self::Inch,
        Self::Foot,
        Self::UsSurveyFoot,
    ];

    /// Its short name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Micrometre => "um",
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Metre => "m",
            Self::Kilometre => "km",
            Self::Inch => "in",
            Self::Foot => "ft",
            Self::UsSurveyFoot => "us-ft",
        }
    }

    /// Its length in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Micrometre => 1e-6,
            Self::Millimetre => 1e-3,
            Self::Centimetre => 1e-2,
            Self::Metre => 1.0,
            Self::Kilometre => 1e3,
            Self::Inch => 0.0254,
            Self::Foot => 0.3048,
            Self::UsSurveyFoot => 1200.0 / 3937.0,
        }
    }

    /// How many `other` it is long: what coordinates in this unit are multiplied by.
    pub fn in_units_of(self, other: Self) -> f64 {
        // Of exact fractions where there are any, so that a millimetre is a thousandth and no digit less.
        match (self, other) {
            (a, b) if a == b => 1.0,
            (a, b) if a.metres() < b.metres() => 1.0 / (b.metres() / a.metres()),
            (a, b) => a.metres() / b.metres(),
        }
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Also long names and the plural.
impl FromStr for LengthUnit {
    type Err = UnitError;

    fn from_str(text: &str) -> Result<Self, UnitError> {
        Ok(match text.trim().to_ascii_lowercase().as_str() {
            "um" | "µm" | "micrometre" | "micrometres" | "micrometer" | "micrometers" | "micron"
            | "microns" => Self::Micrometre,
            "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Self::Millimetre,
            "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => Self::Centimetre,
            "m" | "metre" | "metres" | "meter" | "meters" => Self::Metre,
            "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => Self::Kilometre,
            "in" | "inch" | "inches" => Self::Inch,
            "ft" | "foot" | "feet" => Self::Foot,
            "us-ft" | "usft" | "us-foot" | "us-feet" | "ftus" => Self::UsSurveyFoot,
            _ => return Err(UnitError(text.to_owned())),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_each_other() {
        let of = |a: LengthUnit, b: LengthUnit| a.in_units_of(b);
        assert_eq!(of(LengthUnit::Millimetre, LengthUnit::Metre), 0.001);
        assert_eq!(of(LengthUnit::Metre, LengthUnit::Millimetre), 1000.0);
        assert_eq!(of(LengthUnit::Inch, LengthUnit::Inch), 1.0);
        for (a, b, factor) in [
            (LengthUnit::Inch, LengthUnit::Millimetre, 25.4),
            (LengthUnit::Foot, LengthUnit::Millimetre, 304.8),
            (LengthUnit::Foot, LengthUnit::Inch, 12.0),
            (LengthUnit::UsSurveyFoot, LengthUnit::Foot, 1.000_002),
            (LengthUnit::Kilometre, LengthUnit::Micrometre, 1e9),
        ] {
            assert!((of(a, b) / factor - 1.0).abs() < 1e-9, "{a} in {b}: {}", of(a, b));
            assert!((of(a, b) * of(b, a) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn names_come_back() {
        for unit in LengthUnit::ALL {
            assert_eq!(unit.to_string().parse(), Ok(unit));
        }
        assert_eq!("Inches".parse(), Ok(LengthUnit::Inch));
        let error = "yard".parse::<LengthUnit>().unwrap_err().to_string();
        assert_eq!(error, "no unit `yard`; there are um, mm, cm, m, km, in, ft and us-ft");
    }
}
