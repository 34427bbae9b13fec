//! [`Number`]: a figure shown beside the view.

use serde::Serialize;

/// What a figure speaks for; it is coloured, and marked with a sign for those who see no colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tone {
    /// All is well.
    Good,
    /// Something is wrong, or may well be.
    Bad,
}

/// A figure shown beside the view, or in the row of a pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    pub(crate) label: String,
    pub(crate) value: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    pub(crate) unit: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    pub(crate) help: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tone: Option<Tone>,
}

impl Number {
    /// A figure, shown with 4 significant digits.
    pub fn new(label: impl Into<String>, value: f64) -> Self {
        Self::text(label, significant(value))
    }

    /// A figure that is shown as it is written, such as `"right (97 %)"` or `"4,231 of 35,000"`.
    pub fn text(label: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            value: value.into(),
            unit: String::new(),
            help: String::new(),
            tone: None,
        }
    }

    /// Names the unit, such as `m` or `°`.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Says in a sentence what the figure means.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }

    /// Says what the figure speaks for.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = Some(tone);
        self
    }

    /// Value and unit, for text.
    pub(crate) fn written(&self) -> String {
        with_unit(&self.value, &self.unit)
    }
}

/// `12.3 m`, `45°`, or the number alone.
pub(crate) fn with_unit(value: &str, unit: &str) -> String {
    match unit {
        "" => value.to_owned(),
        "°" | "%" => format!("{value}{unit}"),
        _ => format!("{value} {unit}"),
    }
}

/// 4 significant digits, without trailing zeros: `0.01235`, `12.5`, `12,346`, `1.2e-7`.
pub(crate) fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() { "undefined".to_owned() } else { format!("{value}") };
    }
    let exponent = value.abs().log10().floor();
    if !(-5.0..15.0).contains(&exponent) {
        return format!("{value:.1e}");
    }
    let decimals = (3.0 - exponent).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals > 0 {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let (sign, digits) = text.strip_prefix('-').map_or(("", text.as_str()), |rest| ("-", rest));
    format!("{sign}{}", group_thousands(digits))
}

/// `1,234,567`.
pub(crate) fn count(n: usize) -> String {
    group_thousands(&n.to_string())
}

fn group_thousands(digits: &str) -> String {
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.012_345_6, "0.01235"),
            (-1.5, "-1.5"),
            (99.996, "100"),
            (12_345.6, "12,346"),
            (-1_234_567.0, "-1,234,567"),
            (123.0, "123"),
            (1.2e-7, "1.2e-7"),
            (0.000_02, "0.00002"),
            (f64::NAN, "undefined"),
        ] {
            assert_eq!(significant(value), text);
        }
        assert_eq!(count(2_000_000), "2,000,000");
        assert_eq!(count(12), "12");
        assert_eq!(Number::new("turn", 45.0).unit("°").written(), "45°");
        assert_eq!(Number::new("shift", 0.5).unit("m").written(), "0.5 m");
    }
}
