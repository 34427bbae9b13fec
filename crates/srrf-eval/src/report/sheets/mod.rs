//! The tables, made from the summaries: one function each.

mod compare;
mod paper_tables;
mod probability;
mod skeletons;

pub(crate) use compare::{Column, compare};
pub(crate) use paper_tables::{paper_tables, plain};
pub(crate) use probability::probability;
pub(crate) use skeletons::{agreement, table5};

use super::sheet::{Cell, Sheet};
use crate::metrics::Scores;
use crate::protocol::CLEAN;
use crate::quantities::{QUANTITIES, Quantity};
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary, SummaryRow};

const RANKING_NOTE: &str = "\
Mean of the severities; the last line is the mean of the corruptions. In bold the best beside the oracle, which fits \
a pose to perfect correspondences.";

/// One quantity at a glance: a line for each corruption, a column for each method, then the mean of the corruptions.
/// `scores` says which of a summary's are taken.
pub(crate) fn ranking(
    quantity: &Quantity,
    summary: &Summary,
    scores: fn(&SummaryRow) -> Option<&Scores>,
) -> Sheet {
    let methods = summary.methods();
    let names: Vec<String> = methods.iter().map(|m| m.to_string()).collect();
    let head: Vec<&str> = ["corruption"].into_iter().chain(names.iter().map(String::as_str)).collect();
    let mut sheet = Sheet::new(&format!("ranking-{}", quantity.key), quantity.title, RANKING_NOTE, &head);
    let value = |row: &SummaryRow| scores(row).and_then(|scores| quantity.shown(scores));
    let line = |name: &str, values: Vec<Option<f64>>| -> Vec<Cell> {
        let numbers = values.into_iter().map(|v| Cell::number(v, quantity.digits));
        [name.into()].into_iter().chain(numbers).collect()
    };
    for corruption in summary.corruptions() {
        let cell = |method: &&TableRow| summary.get(corruption, SeverityKey::Mean, method).and_then(value);
        sheet.rows.push(line(corruption, methods.iter().map(cell).collect()));
    }
    let means: Vec<Option<f64>> = methods.iter().map(|m| summary.over_corruptions(m, value)).collect();
    if means.iter().any(Option::is_some) {
        let name = if summary.corruptions().contains(&CLEAN) { "mean of corruptions" } else { "mean" };
        sheet.rows.push(line(name, means));
    }
    for row in 0..sheet.rows.len() {
        sheet.mark_best_of_row(row, quantity.more_is_better, |column| {
            column > 0 && *methods[column - 1] != TableRow::Oracle
        });
    }
    sheet
}

/// The rotation errors at a glance.
pub(crate) fn rankings(summary: &Summary) -> Vec<Sheet> {
    let shown = QUANTITIES.iter().filter(|q| ["rmse_r", "mae_r", "right"].contains(&q.key));
    let sheets = shown.map(|quantity| ranking(quantity, summary, |row| Some(&row.scores)));
    sheets.filter(|s| !s.rows.is_empty()).collect()
}

/// How to read a value from [`Scores`].
type Value = fn(&Scores) -> f64;

/// With and without the classes that are symmetric about an axis, means over severities.
pub(crate) fn symmetry(summary: &Summary) -> Option<Sheet> {
    let head = [
        "corruption",
        "method",
        "RMSE(R), all",
        "without",
        "MAE(R), all",
        "without",
        "median R, all",
        "without",
        "recall %, all",
        "without",
    ];
    let note = "Shapes with an axis of symmetry have no single right pose. `without` leaves out the classes \
                bottle, bowl, cone, cup, flower_pot, lamp, tent and vase.";
    let mut sheet = Sheet::new("symmetry", "With and without symmetric classes", note, &head);
    for row in summary.rows.iter().filter(|r| r.severity == SeverityKey::Mean) {
        let Some(without) = &row.no_symmetric else { continue };
        let mut cells: Vec<Cell> = vec![row.corruption.as_str().into(), (&row.method).into()];
        let values: [(Value, usize); 4] =
            [(|s| s.rmse_r, 2), (|s| s.mae_r, 2), (|s| s.median_rot_deg, 2), (|s| 100.0 * s.recall, 1)];
        for (value, digits) in values {
            cells.push(Cell::number(Some(value(&row.scores)), digits));
            cells.push(Cell::number(Some(value(without)), digits));
        }
        sheet.rows.push(cells);
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}

/// A table for each principal quantity: a line for each corruption and method, a column for each
/// severity, and the mean.
pub(crate) fn severities(summary: &Summary, key: &str, with_mean: bool) -> Vec<Sheet> {
    let severities = summary.severities();
    let mut head: Vec<String> = vec!["corruption".into(), "method".into()];
    head.extend(severities.iter().map(|s| format!("s = {s}")));
    let mut keys: Vec<SeverityKey> = severities.iter().map(|&s| SeverityKey::One(s)).collect();
    if with_mean {
        head.push("mean".into());
        keys.push(SeverityKey::Mean);
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let sheet = |quantity: &Quantity| {
        let mut sheet = Sheet::new(&format!("{key}-{}", quantity.key), quantity.title, "", &head);
        for corruption in summary.corruptions() {
            for method in summary.methods() {
                let value = |key: &SeverityKey| {
                    let row = summary.get(corruption, *key, method);
                    Cell::number(row.and_then(|r| quantity.shown(&r.scores)), quantity.digits)
                };
                let cells: Vec<Cell> = keys.iter().map(value).collect();
                if cells[..severities.len()].iter().any(|c| *c != Cell::None) {
                    sheet.rows.push([vec![corruption.into(), method.into()], cells].concat());
                }
            }
        }
        sheet
    };
    let principal = QUANTITIES.iter().filter(|q| q.principal);
    principal.map(sheet).filter(|s| !s.rows.is_empty()).collect()
}

/// Mean time of a pair, pairs and failures of each method.
pub(crate) fn costs(summary: &Summary) -> Sheet {
    let note = "Time of one pair on one thread, as measured when the answer was computed; other work on the \
                machine counts.";
    let mut sheet =
        Sheet::new("costs", "Time and failures", note, &["method", "pairs", "failed", "ms per pair"]);
    for method in summary.methods() {
        let rows: Vec<&SummaryRow> =
            summary.rows.iter().filter(|r| r.method == *method && r.severity != SeverityKey::Mean).collect();
        let sum = |count: fn(&Scores) -> usize| rows.iter().map(|r| count(&r.scores)).sum::<usize>() as f64;
        let seconds: Option<f64> =
            rows.iter().map(|r| Some(r.seconds_per_pair? * r.scores.pairs as f64)).sum();
        let pairs = sum(|s| s.pairs);
        sheet.rows.push(vec![
            method.into(),
            Cell::Number(pairs, 0),
            Cell::Number(sum(|s| s.failed), 0),
            Cell::number(seconds.map(|s| 1e3 * s / pairs.max(1.0)), 2),
        ]);
    }
    sheet
}

/// Whether a cell names the oracle, which competes with nobody.
fn is_oracle(cell: &Cell) -> bool {
    *cell == (&TableRow::Oracle).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    pub(super) fn summary() -> Summary {
        let mut outcome = outcome();
        outcome.rows = vec![TableRow::ICP, TableRow::SRRF];
        Summary::of(&outcome).unwrap()
    }

    #[test]
    fn rankings_have_a_column_for_each_method_and_mark_the_best_of_a_line() {
        let sheets = rankings(&summary());
        assert_eq!(
            sheets.iter().map(|s| s.key.as_str()).collect::<Vec<_>>(),
            ["ranking-rmse_r", "ranking-mae_r", "ranking-right"]
        );
        assert_eq!(sheets[0].head, ["corruption", "icp", "srrf"]);
        // Both are exact on clean pairs; one corruption has no mean of several.
        assert_eq!(sheets[0].rows[0], ["clean".into(), Cell::Best(0.0, 2), Cell::Best(0.0, 2)]);
        let [name, Cell::Best(icp, 2), Cell::Number(srrf, 2)] = &sheets[0].rows[1][..] else {
            panic!("{:?}", sheets[0].rows[1])
        };
        assert_eq!((name, sheets[0].rows.len()), (&"cutout".into(), 2));
        assert!((10.0 * icp - srrf).abs() < 1e-9);
    }

    #[test]
    fn severities_comparisons_and_skeletons_are_rectangular() {
        let summary = summary();
        let by_severity = severities(&summary, "s", true);
        assert_eq!(by_severity[0].head, ["corruption", "method", "s = 1", "s = 3", "mean"]);
        assert_eq!(by_severity[0].rows.len(), 2, "clean pairs have no severities");
        let columns = [
            Column { name: "one", summary: &summary, severity: SeverityKey::One(1) },
            Column { name: "three", summary: &summary, severity: SeverityKey::One(3) },
        ];
        let compared = compare("k", "t", "", &columns).unwrap();
        assert_eq!(compared.head.len(), 2 + 3 * 2);
        let row = compared.rows.iter().find(|r| r[0] == "cutout".into() && r[1] == "icp".into()).unwrap();
        assert!((3.0 * row[2].value().unwrap() - row[3].value().unwrap()).abs() < 1e-9, "3 times the error");
        let table5 = table5(&summary, Some(&summary)).unwrap();
        assert_eq!(table5.rows[0][0], "clean".into());
        assert_eq!(table5.rows[1][3], Cell::Number(1.0, 3), "the ratio with itself");
        assert!(table5.note.contains("0.475"));
        let all = by_severity.iter().chain([&compared, &table5]);
        assert!(all.flat_map(|s| s.rows.iter().map(|r| r.len() == s.head.len())).all(|ok| ok));
        assert_eq!(costs(&summary).rows[0][3].value().unwrap(), 500.0);
        assert_eq!(symmetry(&summary).unwrap().rows.len(), 4);
    }
}
