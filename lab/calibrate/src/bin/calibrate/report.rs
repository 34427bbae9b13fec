//! Reliability tables.

use std::fmt::Write;

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use srrf_eval::{CertaintyScores, Claim};

use crate::Example;
use crate::pairs::Group;

/// From which probability on a pose is answered.
const ANSWERED: f64 = 0.5;
/// Draws behind [`chance_error`].
const DRAWS: usize = 1000;

/// The calibration error that perfect probabilities would show on so few pairs: the mean over draws in which each pose is
/// right with its probability.
fn chance_error(claims: &[Claim]) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut drawn = claims.to_vec();
    let errors = (0..DRAWS).filter_map(|_| {
        drawn.iter_mut().for_each(|claim| claim.right = rng.random_bool(claim.probability.clamp(0.0, 1.0)));
        Some(CertaintyScores::of(&drawn)?.calibration_error)
    });
    errors.sum::<f64>() / DRAWS as f64
}

/// One row: pairs, right, mean probability, answered, right of the answered, answered of the right, Brier score, calibration error,
/// and what perfect probabilities would have of it. Nothing without pairs.
fn row(name: &str, claims: &[Claim]) -> String {
    let Some(scores) = CertaintyScores::of(claims) else { return String::new() };
    let percent =
        |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.1}", 100.0 * share));
    let answered_right = scores.right_of_answered.map_or(0.0, |right| right * scores.answered);
    let mean = claims.iter().map(|claim| claim.probability).sum::<f64>() / claims.len() as f64;
    format!(
        "| {name} | {} | {} | {mean:.2} | {} | {} | {} | {:.3} | {:.3} | {:.3} |\n",
        scores.pairs,
        percent(Some(scores.right)),
        percent(Some(scores.answered)),
        percent(scores.right_of_answered),
        percent((scores.right > 0.0).then(|| answered_right / scores.right)),
        scores.brier,
        scores.calibration_error,
        chance_error(claims),
    )
}

const HEAD: &str = "| pairs | number | right % | mean probability | answered % | right of answered % | answered of right % | Brier score | calibration error | by chance |\n\
                    |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";

/// The tables of these examples, whose probabilities `says` gives.
pub fn tables(examples: &[&Example], says: impl Fn(&Example) -> f64) -> String {
    let said = |keep: &dyn Fn(&Example) -> bool| -> Vec<Claim> {
        let claim = |example: &&&Example| {
            let probability = says(example);
            Claim { probability, abstain: probability < ANSWERED, right: example.right }
        };
        examples.iter().filter(|e| keep(e)).map(|e| claim(&e)).collect()
    };
    let mut out = String::from(HEAD);
    out += &row("all", &said(&|_| true));
    let groups = [Group::Corrupted, Group::Partial, Group::Meshes, Group::Few, Group::Scaled, Group::Scans];
    for group in groups {
        out += &row(&group.to_string(), &said(&|e| e.group == group));
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
    out += "\n| probability | pairs | mean probability | right |\n|---|--:|--:|--:|\n";
    let bins = CertaintyScores::of(&said(&|_| true)).into_iter().flat_map(|scores| scores.bins);
    for (number, bin) in bins.enumerate().filter(|(_, bin)| bin.pairs > 0) {
        let (low, high, pairs) = (number as f64 / 10.0, (number + 1) as f64 / 10.0, bin.pairs as f64);
        let (mean, right) = (bin.probability / pairs, bin.right as f64 / pairs);
        let _ = writeln!(out, "| {low:.1} to {high:.1} | {} | {mean:.2} | {right:.2} |", bin.pairs);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perfect_probabilities_show_less_of_an_error_on_more_pairs() {
        let claim = |probability, right| Claim { probability, abstain: false, right };
        let said = |count: usize| -> Vec<Claim> {
            (0..count).map(|i| claim((i % 10) as f64 / 10.0 + 0.05, false)).collect()
        };
        let (few, many) = (chance_error(&said(100)), chance_error(&said(10_000)));
        // Ten of 100 pairs in each bin: a mean distance of about 0.1; a hundred times the pairs, a tenth of it.
        assert!((0.07..0.13).contains(&few) && (8.0..12.0).contains(&(few / many)), "{few} {many}");
        assert_eq!(chance_error(&[claim(1.0, true), claim(0.0, false)]), 0.0);
    }
}
