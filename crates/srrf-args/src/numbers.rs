//! Numbers and lists on the command line, checked while they are parsed: a message names the flag and the range.

use std::fmt::Display;
use std::str::FromStr;

use crate::words::grouped;

/// A whole number from `least` to `most`, of the type of the field: clap compares the two when it runs, not the
/// compiler.
pub fn whole<T>(least: T, most: T) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: FromStr + PartialOrd + Copy + Display,
{
    move |text| {
        text.parse().ok().filter(|n| (least..=most).contains(n)).ok_or_else(|| {
            let [least, most] = [least, most].map(|n| grouped(&n.to_string()));
            format!("expected a whole number from {least} to {most}")
        })
    }
}

/// A number from `least` to `most`; not NaN.
pub fn real(least: f64, most: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        text.parse().ok().filter(|n| (least..=most).contains(n)).ok_or_else(|| {
            let [least, most] = [least, most].map(|n| grouped(&n.to_string()));
            format!("expected a number from {least} to {most}")
        })
    }
}

/// A size of memory in bytes, such as `500M`, `4G`, `1.5GB` or `2GiB`.
///
/// # Errors
/// What is expected.
pub fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => Some(1.0),
        "k" | "kb" => Some(1e3),
        "m" | "mb" => Some(1e6),
        "g" | "gb" => Some(1e9),
        "t" | "tb" => Some(1e12),
        "kib" => Some(1024.0),
        "mib" => Some(1024.0 * 1024.0),
        "gib" => Some(1024.0 * 1024.0 * 1024.0),
        _ => None,
    };
    let size = factor.and_then(|factor| Some(number.trim().parse::<f64>().ok()? * factor));
    let size = size.filter(|size| (1.0..=1e18).contains(size)).map(|size| size as u64);
    size.ok_or_else(|| "expected a size of memory, such as 500M, 4G or 8GiB".into())
}

/// One entry of a list, whose entries are apart by commas.
///
/// # Errors
/// What is wrong with the entry; for another mark between entries, how to write the list.
pub fn entry<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    let apart = |c: char| c == ';' || c == '|' || c.is_whitespace();
    let text = text.trim();
    if text.contains(apart) {
        let entries: Vec<&str> = text.split(apart).filter(|e| !e.is_empty()).collect();
        return Err(format!("entries of a list are apart by commas: {}", entries.join(",")));
    }
    if text.is_empty() {
        return Err("an entry of the list is empty".into());
    }
    text.parse().map_err(|e: T::Err| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_said() {
        let threads = whole(1u32, 4096);
        assert_eq!((threads("1"), threads("4096")), (Ok(1), Ok(4096)));
        for text in ["0", "4097", "-1", "1.5", "x", "", "99999999999999999999"] {
            assert_eq!(threads(text), Err("expected a whole number from 1 to 4,096".into()), "{text}");
        }
        let minutes = real(0.0, 525_600.0);
        assert_eq!(minutes("0.25"), Ok(0.25));
        for text in ["nan", "1e300", "-1", "inf", "soon"] {
            assert_eq!(minutes(text), Err("expected a number from 0 to 525,600".into()), "{text}");
        }
    }

    #[test]
    fn sizes_of_memory() {
        for (text, size) in
            [("1000", 1000), ("500M", 500_000_000), ("1.5 gb", 1_500_000_000), ("2GiB", 2 << 30)]
        {
            assert_eq!(bytes(text), Ok(size), "{text}");
        }
        for text in ["", "0", "-1G", "4X", "nan", "1e30G", "G"] {
            assert!(bytes(text).unwrap_err().contains("such as 500M"), "{text}");
        }
    }

    #[test]
    fn lists_are_apart_by_commas() {
        assert_eq!(entry::<String>(" icp "), Ok("icp".into()));
        assert_eq!(entry::<u8>("3"), Ok(3));
        for text in ["icp;srrf", "icp; srrf", "icp srrf", "icp|srrf"] {
            assert_eq!(entry::<String>(text), Err("entries of a list are apart by commas: icp,srrf".into()));
        }
        assert_eq!(entry::<String>(""), Err("an entry of the list is empty".into()));
        assert!(entry::<u8>("x").is_err());
    }
}
