//! The list of corruptions for the terminal.

use std::fmt::Write;

use crate::corruptions::CorruptionKind;

/// One line for each corruption: its name, what it does, and what grows with the severity.
pub fn list() -> String {
    let mut text =
        format!("{:20} {:52} severities 1 to 5\n", "corruption", "what it does to 1,024 points of radius 1");
    for kind in CorruptionKind::ALL {
        let card = kind.card();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{kind:20} {:52} {}", card.summary, card.strength);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corruption_has_its_line() {
        let text = list();
        assert_eq!(text.lines().count(), 13);
        for (line, kind) in text.lines().skip(1).zip(CorruptionKind::ALL) {
            assert!(line.starts_with(kind.name()), "{line}");
        }
        assert!(text.contains("points 22 25 29 34 51"), "{text}");
    }
}
