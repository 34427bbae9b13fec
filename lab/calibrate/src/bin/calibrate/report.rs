//! Reliability tables.

use std::fmt::Write;

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

use crate::Example;
use crate::pairs::Group;

/// A probability, and whether the pose was right.
type Said = (f64, bool);

/// Expected calibration error in ten bins.
fn calibration_error(pairs: &[Said]) -> f64 {
    let n = pairs.len().max(1) as f64;
    (0..10)
        .map(|bin| {
            let inside: Vec<_> = pairs.iter().filter(|(p, _)| ((p * 10.0) as usize).min(9) == bin).collect();
            let probability: f64 = inside.iter().map(|(p, _)| p).sum();
            let right = inside.iter().filter(|(_, r)| *r).count() as f64;
            (probability - right).abs() / n
        })
        .sum()
}

/// Draws behind [`chance_error`].
const DRAWS: usize = 1000;

/// The calibration error that perfect probabilities would show on so few pairs: the mean over draws in which each pose is
/// right with its probability.
fn chance_error(pairs: &[Said]) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut drawn = pairs.to_vec();
    let errors = (0..DRAWS).map(|_| {
        drawn.iter_mut().for_each(|(p, right)| *right = rng.random_bool(p.clamp(0.0, 1.0)));
        calibration_error(&drawn)
    });
    errors.sum::<f64>() / DRAWS as f64
}

fn brier(pairs: &[Said]) -> f64 {
    let squares = pairs.iter().map(|(p, r)| (p - f64::from(u8::from(*r))).powi(2)).sum::<f64>();
    squares / pairs.len().max(1) as f64
}

/// One row: pairs, right, mean probability, answered, right of the answered, answered of the right, Brier score, calibration error,
/// and what perfect probabilities would have of it.
fn row(name: &str, pairs: &[Said]) -> String {
    let n = pairs.len() as f64;
    let percent = |some: usize, of: usize| match of {
        0 => "-".to_owned(),
        _ => format!("{:.1}", 100.0 * some as f64 / of as f64),
    };
    let right = pairs.iter().filter(|(_, r)| *r).count();
    let answered: Vec<_> = pairs.iter().filter(|(p, _)| *p >= 0.5).collect();
    let both = answered.iter().filter(|(_, r)| *r).count();
    let mean = pairs.iter().map(|(p, _)| p).sum::<f64>() / n;
    format!(
        "| {name} | {} | {} | {mean:.2} | {} | {} | {} | {:.3} | {:.3} | {:.3} |\n",
        pairs.len(),
        percent(right, pairs.len()),
        percent(answered.len(), pairs.len()),
        percent(both, answered.len()),
        percent(both, right),
        brier(pairs),
        calibration_error(pairs),
        chance_error(pairs),
    )
}

const HEAD: &str = "| pairs | number | right % | mean probability | answered % | right of answered % | answered of right % | Brier score | calibration error | by chance |\n\
                    |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";

/// The tables of these examples, whose probabilities `says` gives.
pub fn tables(examples: &[&Example], says: impl Fn(&Example) -> f64) -> String {
    let said = |keep: &dyn Fn(&Example) -> bool| -> Vec<Said> {
        examples.iter().filter(|e| keep(e)).map(|e| (says(e), e.right)).collect()
    };
    let mut out = String::from(HEAD);
    out += &row("all", &said(&|_| true));
    let groups = [Group::Corrupted, Group::Partial, Group::Meshes, Group::Few, Group::Scaled, Group::Scans];
    for group in groups {
        let of = said(&|e| e.group == group);
        if !of.is_empty() {
            out += &row(&group.to_string(), &of);
        }
    }
    for method in ["auto", "given", "fpfh-ransac"] {
        out += &row(&format!("`--method {method}`"), &said(&|e| e.method == method));
    }
    let mut kinds: Vec<(Group, &str)> = examples.iter().map(|e| (e.group, e.kind.as_str())).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let _ = write!(out, "\nBy kind:\n\n{HEAD}");
    for (group, kind) in kinds.into_iter().filter(|(g, _)| !matches!(g, Group::Scaled)) {
        out += &row(&format!("{group}: {kind}"), &said(&|e| e.group == group && e.kind == kind));
    }
    let all = said(&|_| true);
    out += "\n| probability | pairs | mean probability | right |\n|---|--:|--:|--:|\n";
    for bin in 0..10 {
        let inside: Vec<_> = all.iter().filter(|(p, _)| ((p * 10.0) as usize).min(9) == bin).collect();
        if inside.is_empty() {
            continue;
        }
        let k = inside.len() as f64;
        let mean = inside.iter().map(|(p, _)| p).sum::<f64>() / k;
        let right = inside.iter().filter(|(_, r)| *r).count() as f64 / k;
        let (low, high) = (f64::from(bin as u8) / 10.0, f64::from(bin as u8 + 1) / 10.0);
        let _ = writeln!(out, "| {low:.1} to {high:.1} | {} | {mean:.2} | {right:.2} |", inside.len());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perfect_probabilities_show_less_of_an_error_on_more_pairs() {
        let said = |count: usize| -> Vec<Said> {
            (0..count).map(|i| ((i % 10) as f64 / 10.0 + 0.05, false)).collect()
        };
        let (few, many) = (chance_error(&said(100)), chance_error(&said(10_000)));
        // Ten of 100 pairs in each bin: a mean distance of about 0.1; a hundred times the pairs, a tenth of it.
        assert!((0.07..0.13).contains(&few) && (8.0..12.0).contains(&(few / many)), "{few} {many}");
        assert_eq!(chance_error(&[(1.0, true), (0.0, false)]), 0.0);
    }
}
