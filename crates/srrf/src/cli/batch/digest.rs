//! [`Digest`]: what many results come to.

use std::fmt::Write;

use serde_json::Value;

use super::row::BatchRow;
use srrf_args::words::{count, counted};

/// Rows of each list of extremes.
const EXTREMES: usize = 5;
/// Bins of the probability.
const BINS: usize = 10;

/// What the pairs of one bin of probability come to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Bin {
    pairs: usize,
    /// Sum of the probabilities: so many should be right.
    expected: f64,
    /// Pairs that say whether they are right, in a column `right` of the list.
    known: usize,
    right: usize,
}

/// Counts, times, reliability and extremes of results, row by row.
#[derive(Debug, Clone, Default)]
pub struct Digest {
    pub pairs: usize,
    pub abstained: usize,
    pub failed: usize,
    seconds: Vec<f64>,
    bins: [Bin; BINS],
    /// Longest first.
    slowest: Vec<(f64, String)>,
    /// Least probable first.
    doubtful: Vec<(f64, String)>,
    errors: Vec<(String, String)>,
}

impl Digest {
    /// One more row.
    pub fn add(&mut self, row: &BatchRow) {
        self.pairs += 1;
        if let Some(error) = row.error() {
            self.failed += 1;
            if self.errors.len() < EXTREMES {
                self.errors.push((row.id().to_owned(), error.to_owned()));
            }
        }
        self.abstained += usize::from(row.abstain() == Some(true));
        if let Some(seconds) = row.seconds() {
            self.seconds.push(seconds);
            keep(&mut self.slowest, -seconds, row.id());
        }
        if let Some(probability) = row.number(&["probability"]) {
            keep(&mut self.doubtful, probability, row.id());
            let bin = &mut self.bins[((probability * BINS as f64) as usize).min(BINS - 1)];
            bin.pairs += 1;
            bin.expected += probability;
            if let Some(right) = row.column("right").and_then(truth) {
                bin.known += 1;
                bin.right += usize::from(right);
            }
        }
    }

    /// The counts in one line.
    pub fn counts(&self) -> String {
        format!(
            "{}: {} probably right, {} abstained, {} without a pose",
            counted(self.pairs, "pair"),
            count(self.pairs - self.abstained - self.failed),
            count(self.abstained),
            count(self.failed)
        )
    }

    /// All of it, for people.
    pub fn text(&self) -> String {
        let mut out = self.counts();
        let mut line = |text: String| {
            // Writing to a string cannot fail.
            let _ = write!(out, "\n{text}");
        };
        if !self.seconds.is_empty() {
            let mut sorted = self.seconds.clone();
            sorted.sort_by(f64::total_cmp);
            let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
            let all: f64 = sorted.iter().sum();
            line(format!(
                "seconds a pair: {:.3} in the middle, {:.3} for 95 %, {:.3} at most, {all:.1} in all",
                at(0.5),
                at(0.95),
                at(1.0)
            ));
        }
        if self.bins.iter().any(|bin| bin.pairs > 0) {
            line(format!("{:12} {:>9} {:>15} {:>9}", "probability", "pairs", "expected right", "right"));
            for (i, bin) in self.bins.iter().enumerate().rev().filter(|(_, bin)| bin.pairs > 0) {
                let range = format!("{:.1} to {:.1}", i as f64 / BINS as f64, (i + 1) as f64 / BINS as f64);
                let right = if bin.known == 0 {
                    "-".into()
                } else {
                    format!("{} of {}", count(bin.right), count(bin.known))
                };
                line(format!("{range:12} {:>9} {:>15.1} {right:>9}", count(bin.pairs), bin.expected));
            }
        }
        if !self.slowest.is_empty() {
            line("slowest".into());
            self.slowest.iter().for_each(|(seconds, id)| line(format!("  {:8.3} s  {id}", -seconds)));
        }
        if !self.doubtful.is_empty() {
            line("least probable".into());
            self.doubtful.iter().for_each(|(p, id)| line(format!("  {:8.1} %  {id}", 100.0 * p)));
        }
        if !self.errors.is_empty() {
            line(format!("without a pose, {} of {}", self.errors.len(), count(self.failed)));
            self.errors.iter().for_each(|(id, error)| line(format!("  {id}: {error}")));
        }
        out
    }
}

/// Whether a value says yes or no.
fn truth(value: &Value) -> Option<bool> {
    match value {
        Value::Bool(truth) => Some(*truth),
        Value::Number(number) => Some(number.as_f64()? != 0.0),
        Value::String(text) => match text.to_ascii_lowercase().as_str() {
            "1" | "true" | "yes" => Some(true),
            "0" | "false" | "no" => Some(false),
            _ => None,
        },
        _ => None,
    }
}

/// Keeps the smallest.
fn keep(list: &mut Vec<(f64, String)>, value: f64, id: &str) {
    let place = list.partition_point(|(known, _)| *known <= value);
    if place < EXTREMES {
        list.insert(place, (value, id.to_owned()));
        list.truncate(EXTREMES);
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::row::testing::{answered, failed};
    use super::*;

    #[test]
    fn figures_of_many_rows() {
        let mut digest = Digest::default();
        for (i, probability) in [0.95, 0.91, 0.2, 1.0, 0.55, 0.7, 0.8].into_iter().enumerate() {
            let mut row = answered(&format!("s{i}"), 0.0, probability);
            row.0.insert("seconds".into(), json!({ "a": i, "b": 0.5 }));
            row.0.insert("columns".into(), json!({ "right": if i == 1 { "no" } else { "yes" } }));
            digest.add(&row);
        }
        digest.add(&failed("x"));
        assert_eq!(digest.counts(), "8 pairs: 6 probably right, 1 abstained, 1 without a pose");
        let text = digest.text();
        let has = |words: &str| assert!(text.contains(words), "{words}\n{text}");
        has("seconds a pair: 3.500 in the middle, 5.500 for 95 %, 6.500 at most, 24.5 in all");
        has("0.9 to 1.0           3             2.9    2 of 3");
        has("slowest\n     6.500 s  s6 -> t\n     5.500 s  s5 -> t\n");
        has("least probable\n      20.0 %  s2 -> t\n      55.0 %  s4 -> t\n");
        has("without a pose, 1 of 1\n  x -> t: no \"pose\"");
        assert_eq!(Digest::default().text(), "0 pairs: 0 probably right, 0 abstained, 0 without a pose");
    }
}
