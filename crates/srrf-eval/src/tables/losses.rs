//! A plain list of where the network loses, read off the summary.

use crate::methods::is_ours;
use crate::quantities::{QUANTITIES, Quantity};
use crate::report::paper;
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary};

/// Sentences, one for each loss that shows in the printed digits; empty where the run lacks `srrf`.
pub(crate) fn losses(summary: &Summary) -> Vec<String> {
    let mut found = Vec::new();
    for ours in [TableRow::SRRF, TableRow::SRRF_REFINE, TableRow::SRRF_REGISTER] {
        for quantity in QUANTITIES.iter().filter(|q| ["rmse_r", "median_rot_deg", "recall"].contains(&q.key))
        {
            for corruption in summary.corruptions() {
                found.extend(against_others(summary, quantity, corruption, &ours));
            }
        }
    }
    let Some(rmse) = QUANTITIES.iter().find(|q| q.key == "rmse_r") else { return found };
    for corruption in summary.corruptions() {
        found.extend(against_itself(summary, rmse, corruption));
    }
    let above: Vec<String> = summary
        .corruptions()
        .into_iter()
        .filter_map(|corruption| {
            let ours = summary.get(corruption, SeverityKey::Mean, &TableRow::SRRF)?.scores.rmse_r;
            let paper = paper::find(corruption, &TableRow::SRRF)?.values[1];
            (ours > paper).then(|| format!("{corruption} ({ours:.2} against {paper:.2})"))
        })
        .collect();
    if !above.is_empty() {
        found.push(format!(
            "RMSE(R) of srrf is above the paper's own, whose severities are not known, for {}.",
            above.join(", ")
        ));
    }
    found
}

/// A sentence where another method is better than `ours`.
fn against_others(
    summary: &Summary,
    quantity: &Quantity,
    corruption: &str,
    ours: &TableRow,
) -> Option<String> {
    let value =
        |method: &TableRow| quantity.shown(&summary.get(corruption, SeverityKey::Mean, method)?.scores);
    let mine = value(ours)?;
    let printed = |v: f64| format!("{v:.*}", quantity.digits);
    let better =
        |v: f64| printed(v) != printed(mine) && if quantity.more_is_better { v > mine } else { v < mine };
    let others = summary.methods().into_iter().filter(|m| **m != TableRow::Oracle && !is_ours(m));
    let ahead: Vec<String> = others
        .filter_map(|m| value(m).filter(|v| better(*v)).map(|v| format!("{m} ({})", printed(v))))
        .collect();
    let name = match quantity.key {
        "rmse_r" => "RMSE(R)",
        "recall" => "recall, percent,",
        _ => "median rotation error",
    };
    (!ahead.is_empty())
        .then(|| format!("{corruption}: {name} of {ours} is {}, behind {}.", printed(mine), ahead.join(", ")))
}

/// Sentences where a branch beats the fusion, or refinement makes it worse.
fn against_itself(summary: &Summary, quantity: &Quantity, corruption: &str) -> Vec<String> {
    let value = |method: &TableRow| Some(summary.get(corruption, SeverityKey::Mean, method)?.scores.rmse_r);
    let printed = |v: f64| format!("{v:.*}", quantity.digits);
    let Some(fused) = value(&TableRow::SRRF) else { return Vec::new() };
    let mut found = Vec::new();
    for (other, what) in [
        (TableRow::SRRF_DENSE, "the dense branch alone"),
        (TableRow::SRRF_SKELETON, "the skeleton branch alone"),
    ] {
        if let Some(v) = value(&other).filter(|v| *v < fused && printed(*v) != printed(fused)) {
            found.push(format!(
                "{corruption}: {what} ({}) is ahead of the fusion ({}) in RMSE(R).",
                printed(v),
                printed(fused)
            ));
        }
    }
    if let Some(v) = value(&TableRow::SRRF_REFINE).filter(|v| *v > fused && printed(*v) != printed(fused)) {
        found.push(format!(
            "{corruption}: refinement raises RMSE(R) from {} to {}.",
            printed(fused),
            printed(v)
        ));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    #[test]
    fn only_losses_are_listed() {
        // The second method of the made-up outcome has ten times the error of the first, but not on
        // clean pairs, where both are exact.
        let named = |rows: [TableRow; 2]| {
            let mut outcome = outcome();
            outcome.rows = rows.to_vec();
            losses(&Summary::of(&outcome).unwrap())
        };
        let behind = named([TableRow::ICP, TableRow::SRRF]);
        assert!(behind.iter().any(|l| l.starts_with("cutout: RMSE(R) of srrf is 18.26, behind icp (1.83)")));
        assert!(!behind.iter().any(|l| l.starts_with("clean")), "{behind:?}");
        assert!(behind.last().unwrap().contains("cutout (18.26 against 2.86)"));
        assert!(named([TableRow::SRRF, TableRow::ICP]).is_empty());
        let refined = named([TableRow::SRRF, TableRow::SRRF_REFINE]);
        assert!(
            refined.iter().any(|l| l.contains("refinement raises RMSE(R) from 1.83 to 18.26")),
            "{refined:?}"
        );
        assert!(
            named([TableRow::SRRF_DENSE, TableRow::SRRF])
                .iter()
                .any(|l| l.contains("the dense branch alone (1.83)"))
        );
    }
}
