//! How much memory the machine has, and bytes in words.

use std::fs;
use std::sync::OnceLock;

/// What is taken for half of a machine that does not say.
const UNKNOWN: u64 = 8 << 30;

/// Half of the memory of the machine, or of the container that the process runs in.
pub(super) fn half_of_the_machine() -> u64 {
    static HALF: OnceLock<u64> = OnceLock::new();
    *HALF.get_or_init(|| {
        let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| total(&text));
        let containers = ["/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"];
        let container = containers.iter().find_map(|path| fs::read_to_string(path).ok()?.trim().parse().ok());
        machine.into_iter().chain(container).min().map_or(UNKNOWN, |bytes: u64| bytes / 2)
    })
}

/// The line `MemTotal` of `/proc/meminfo`, in bytes.
fn total(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Such as `1.5 GB`.
pub(super) fn in_words(bytes: u64) -> String {
    let units = ["kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes as f64;
    let mut name = "bytes";
    for unit in units {
        if value < 1000.0 {
            break;
        }
        (value, name) = (value / 1000.0, unit);
    }
    if name == "bytes" { format!("{bytes} bytes") } else { format!("{value:.1} {name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_linux() {
        assert_eq!(total("MemFree: 1 kB\nMemTotal:       24000000 kB\n"), Some(24_576_000_000));
        assert_eq!(total(""), None);
        assert!(half_of_the_machine() > 0);
    }

    #[test]
    fn bytes_in_words() {
        assert_eq!((in_words(999), in_words(1000)), ("999 bytes".into(), "1.0 kB".into()));
        assert_eq!(in_words(3_210_000_000), "3.2 GB");
    }
}
