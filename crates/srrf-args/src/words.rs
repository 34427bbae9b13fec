//! Words that the programs share: figures, lengths, counts.

use std::borrow::Cow;
use std::fmt::Write;

/// Text with its control characters written out, such as `\u{1b}` for one that would command a terminal; also those that
/// turn the direction of reading. Ends of lines and tabs stay.
pub fn visible(text: &str) -> Cow<'_, str> {
    let turns = |c: char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let hidden = |c: char| (c.is_control() && c != '\n' && c != '\t') || turns(c);
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if hidden(c) {
            // Writing to a string cannot fail.
            let _ = write!(plain, "{}", c.escape_unicode());
        } else {
            plain.push(c);
        }
    }
    Cow::Owned(plain)
}

/// `1,234,567`.
pub fn count(n: usize) -> String {
    grouped(&n.to_string())
}

/// A whole number in digits, with commas between groups of three; other text as it is.
pub fn grouped(digits: &str) -> String {
    if !digits.bytes().all(|b| b.is_ascii_digit()) {
        return digits.to_owned();
    }
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// `1 pair`, `1,234 pairs`.
pub fn counted(n: usize, thing: &str) -> String {
    format!("{} {thing}{}", count(n), if n == 1 { "" } else { "s" })
}

/// `1 point`, `1,234 points`.
pub fn points(n: usize) -> String {
    counted(n, "point")
}

/// A length in `digits` significant digits, without an exponent for everyday sizes.
pub fn length(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..15).contains(&exponent) {
        return format!("{value:.*e}", digits.max(1) as usize - 1);
    }
    let decimals = (digits - 1 - exponent).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// `(x, y, z)`, all with the decimals that `digits` significant digits of `scale` have.
pub fn vector(v: [f64; 3], scale: f64, digits: i32) -> String {
    let exponent = if scale > 0.0 && scale.is_finite() { scale.log10().floor() as i32 } else { 0 };
    let decimals = (digits - 1 - exponent).clamp(0, 12) as usize;
    let text = v.map(|c| format!("{c:.decimals$}"));
    format!("({})", text.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_commands_a_terminal() {
        assert_eq!(visible("a\tb\nµ 1"), "a\tb\nµ 1");
        assert_eq!(
            visible("\u{1b}[2Jred\r\u{7}\u{9b}\u{202e}x"),
            "\\u{1b}[2Jred\\u{d}\\u{7}\\u{9b}\\u{202e}x"
        );
    }

    #[test]
    fn figures() {
        assert_eq!(count(1_234_567), "1,234,567");
        assert_eq!(points(1), "1 point");
        for (value, text) in
            [(0.012_346, "0.01235"), (12.5, "12.5"), (35_947.3, "35947"), (1e-7, "1.000e-7"), (0.0, "0")]
        {
            assert_eq!(length(value, 4), text);
        }
        assert_eq!(vector([500_000.123_456, -2.0, 0.1], 1.3, 4), "(500000.123, -2.000, 0.100)");
        assert_eq!(grouped("-1.5"), "-1.5");
    }
}
