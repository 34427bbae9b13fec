//! The tables, made from the summaries.

use srrf_corrupt::{CorruptionKind, Family};

use super::paper;
use super::plan::MIDDLE;
use super::sheet::{Cell, Sheet};
use crate::chamfer::SkeletonAgreement;
use crate::methods::ORACLE;
use crate::metrics::Scores;
use crate::quantities::{QUANTITIES, Quantity};
use crate::summary::{SeverityKey, Summary, SummaryRow};

/// The paper's tables 1 to 3, one for each family. Upsampling, which it left out, stands with the noise.
const PAPER_TABLES: [(&str, &str, Family); 3] = [
    ("table1", "Table 1: density", Family::Density),
    ("table2", "Table 2: noise", Family::Noise),
    ("table3", "Table 3: transformation", Family::Transformation),
];

/// The corruptions of a family in the order of the paper's table, then those that it left out.
fn in_the_order_of_the_paper(family: Family) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = CorruptionKind::of_family(family).map(CorruptionKind::name).collect();
    names.sort_by_key(|name| {
        paper::rows().iter().position(|row| row.corruption == *name).unwrap_or(usize::MAX)
    });
    names
}

const PAPER_HEAD: [&str; 14] = [
    "corruption",
    "method",
    "MSE(R)",
    "RMSE(R)",
    "MAE(R)",
    "MSE(t)",
    "RMSE(t)",
    "MAE(t)",
    "median R",
    "recall %",
    "paper: RMSE(R)",
    "paper: MAE(R)",
    "paper: RMSE(t)",
    "paper: MAE(t)",
];

const PAPER_NOTE: &str = "\
Mean of the severities 1 to 5. Degrees; translations in the unit of the clouds. The last four columns are the \
paper's own numbers (its MSE is the square of its RMSE); its severities, and much else, are not known, so they \
are no target. In bold the best of ours beside the oracle, which fits a pose to perfect correspondences.";

const RANKING_NOTE: &str = "\
Mean of the severities; the last line is the mean of the corruptions. In bold the best beside the oracle, which fits \
a pose to perfect correspondences.";

const CLEAN_NOTE: &str = "\
Degrees; translations in the unit of the clouds. The paper has no such table. In bold the best beside the oracle, \
which fits a pose to perfect correspondences.";

/// Numbers where less is better in [`PAPER_HEAD`], then recall.
const PAPER_BEST: [(usize, bool); 8] =
    [(2, false), (3, false), (4, false), (5, false), (6, false), (7, false), (8, false), (9, true)];

/// The rotation errors at a glance: a line for each corruption, a column for each method, then the mean of the
/// corruptions.
pub(crate) fn rankings(summary: &Summary) -> Vec<Sheet> {
    let methods = summary.methods();
    let head: Vec<&str> = ["corruption"].into_iter().chain(methods.iter().copied()).collect();
    let sheet = |quantity: &Quantity| {
        let mut sheet = Sheet::new(&format!("ranking-{}", quantity.key), quantity.title, RANKING_NOTE, &head);
        let value = |row: &SummaryRow| quantity.shown(&row.scores);
        let line = |name: &str, values: Vec<Option<f64>>| -> Vec<Cell> {
            let numbers = values.into_iter().map(|v| Cell::number(v, quantity.digits));
            [name.into()].into_iter().chain(numbers).collect()
        };
        for corruption in summary.corruptions() {
            let cell = |method: &&str| summary.get(corruption, SeverityKey::Mean, method).and_then(value);
            sheet.rows.push(line(corruption, methods.iter().map(cell).collect()));
        }
        let means: Vec<Option<f64>> = methods.iter().map(|m| summary.over_corruptions(m, value)).collect();
        if means.iter().any(Option::is_some) {
            sheet.rows.push(line("mean of corruptions", means));
        }
        for row in 0..sheet.rows.len() {
            sheet.mark_best_of_row(row, quantity.more_is_better, |column| {
                column > 0 && methods[column - 1] != ORACLE
            });
        }
        sheet
    };
    let shown = QUANTITIES.iter().filter(|q| ["rmse_r", "mae_r"].contains(&q.key));
    shown.map(sheet).filter(|s| !s.rows.is_empty()).collect()
}

/// Tables 1 to 3 with clean pairs before them. `suffix` tells the tables of several models apart.
pub(crate) fn paper_tables(summary: &Summary, suffix: &str) -> Vec<Sheet> {
    let mut sheets = Vec::new();
    let key = |name: &str| format!("{name}{suffix}");
    let clean = ("clean", "Clean pairs", vec!["clean"]);
    let tables = PAPER_TABLES.iter().map(|(k, t, family)| (*k, *t, in_the_order_of_the_paper(*family)));
    for (name, title, corruptions) in std::iter::once(clean).chain(tables) {
        let note = if name == "clean" { CLEAN_NOTE } else { PAPER_NOTE };
        let mut sheet = Sheet::new(&key(name), title, note, &PAPER_HEAD);
        for corruption in corruptions {
            let first = sheet.rows.len();
            let ours = summary.methods();
            for method in &ours {
                let Some(row) = summary.get(corruption, SeverityKey::Mean, method) else { continue };
                sheet.rows.push(paper_row(corruption, method, Some(&row.scores)));
            }
            if sheet.rows.len() > first {
                // What the paper compares with and this run lacks keeps its place.
                let missing = paper::METHODS.iter().filter(|m| !ours.contains(m));
                let there = missing.filter(|m| paper::find(corruption, m).is_some());
                sheet.rows.extend(there.map(|m| paper_row(corruption, m, None)));
            }
            sheet.mark_best(first, &PAPER_BEST, |row| row[1] != ORACLE.into());
        }
        if !sheet.rows.is_empty() {
            sheets.push(sheet);
        }
    }
    sheets
}

fn paper_row(corruption: &str, method: &str, ours: Option<&Scores>) -> Vec<Cell> {
    let values = ours.map(paper::values);
    let paper = paper::find(corruption, method).map(|row| row.values);
    let digits = [2, 2, 2, 6, 4, 4];
    let mut row: Vec<Cell> = vec![corruption.into(), method.into()];
    row.extend((0..6).map(|i| Cell::number(values.map(|v| v[i]), digits[i])));
    row.push(Cell::number(ours.map(|s| s.median_rot_deg), 2));
    row.push(Cell::number(ours.map(|s| 100.0 * s.recall), 1));
    row.extend([1, 2, 4, 5].map(|i| Cell::number(paper.map(|v| v[i]), digits[i])));
    row
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
        let mut cells: Vec<Cell> = vec![row.corruption.as_str().into(), row.method.as_str().into()];
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

/// One experiment of an ablation: a heading for its columns, its summary, the severity to take.
pub(crate) struct Column<'a> {
    /// Heading.
    pub name: &'a str,
    /// Where its numbers are.
    pub summary: &'a Summary,
    /// Which.
    pub severity: SeverityKey,
}

/// Compares experiments on the same shapes: RMSE(R), median and recall of each, side by side.
pub(crate) fn compare(key: &str, title: &str, note: &str, columns: &[Column<'_>]) -> Option<Sheet> {
    let last = columns.last()?.summary;
    let mut head = vec!["corruption".to_owned(), "method".to_owned()];
    let quantities: Vec<&Quantity> = ["rmse_r", "median_rot_deg", "recall"]
        .iter()
        .filter_map(|key| QUANTITIES.iter().find(|q| q.key == *key))
        .collect();
    for name in ["RMSE(R)", "median R", "recall %"] {
        head.extend(columns.iter().map(|c| format!("{name}, {}", c.name)));
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let mut sheet = Sheet::new(key, title, note, &head);
    for corruption in last.corruptions() {
        let first = sheet.rows.len();
        for method in last.methods() {
            let mut cells: Vec<Cell> = vec![corruption.into(), method.into()];
            for quantity in &quantities {
                for column in columns {
                    // Clean pairs have no severity.
                    let keys = [column.severity, SeverityKey::One(0)];
                    let row = keys.iter().find_map(|&k| column.summary.get(corruption, k, method));
                    cells.push(Cell::number(row.and_then(|r| quantity.shown(&r.scores)), quantity.digits));
                }
            }
            sheet.rows.push(cells);
        }
        let all: Vec<(usize, bool)> =
            (2..head.len()).map(|c| (c, quantities[(c - 2) / columns.len()].more_is_better)).collect();
        sheet.mark_best(first, &all, |row| row[1] != ORACLE.into());
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}

/// All six numbers of a run without severities: table 4, and the variants of the integration.
pub(crate) fn plain(key: &str, title: &str, note: &str, summary: &Summary) -> Sheet {
    let head = [
        "pairs", "method", "MSE(R)", "RMSE(R)", "MAE(R)", "MSE(t)", "RMSE(t)", "MAE(t)", "median R",
        "recall %",
    ];
    let mut sheet = Sheet::new(key, title, note, &head);
    for group in summary.corruptions() {
        let first = sheet.rows.len();
        for method in summary.methods() {
            let Some(row) = summary.get(group, SeverityKey::Mean, method) else { continue };
            let mut cells = paper_row(group, method, Some(&row.scores));
            cells.truncate(head.len());
            sheet.rows.push(cells);
        }
        sheet.mark_best(first, &PAPER_BEST, |row| row[1] != ORACLE.into());
    }
    sheet
}

/// Table 5: the Chamfer distance between the skeletons of a pair, with and without the loss.
pub(crate) fn skeletons(with: &Summary, without: Option<&Summary>) -> Option<Sheet> {
    let [paper_without, paper_with] = paper::SKELETON_CHAMFER;
    let note = format!(
        "Severity 3. Between the skeleton of the source, moved by the true pose, and that of the target: mean squared \
         distance to the nearest point, both ways added, x 10^4; the sum of the distances; the spread (rms distance from \
         the mean), which a collapse would bring to 0. The paper: {paper_without} without and {paper_with} with \
         the loss, a ratio of {:.3}, in a unit that it does not say; only the ratio can be compared.",
        paper_with / paper_without
    );
    let head = [
        "corruption",
        "Chamfer, with",
        "Chamfer, without",
        "ratio",
        "sum, with",
        "sum, without",
        "spread, with",
        "spread, without",
    ];
    let mut sheet =
        Sheet::new("table5", "Table 5: skeletons and the distribution distance loss", &note, &head);
    let mut corrupted = Vec::new();
    for corruption in with.corruptions() {
        // The severity that every network is scored at; clean pairs have none.
        let agreement = |summary: &Summary| {
            let middle = summary.get(corruption, SeverityKey::One(MIDDLE.get()), "srrf");
            middle.or_else(|| summary.get(corruption, SeverityKey::Mean, "srrf"))?.skeletons
        };
        let (Some(a), b) = (agreement(with), without.and_then(agreement)) else { continue };
        sheet.rows.push(agreement_row(corruption, &a, b.as_ref()));
        if corruption != "clean" {
            corrupted.push((a, b));
        }
    }
    let (a, b): (Vec<_>, Vec<_>) = corrupted.into_iter().unzip();
    if let (Some(with), true) = (SkeletonAgreement::mean(&a), a.len() > 1) {
        let b: Option<Vec<_>> = b.into_iter().collect();
        let without = b.and_then(|b| SkeletonAgreement::mean(&b));
        sheet.rows.push(agreement_row("mean of the corruptions", &with, without.as_ref()));
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}

/// A row of table 5.
fn agreement_row(corruption: &str, a: &SkeletonAgreement, b: Option<&SkeletonAgreement>) -> Vec<Cell> {
    vec![
        corruption.into(),
        Cell::Number(1e4 * a.chamfer, 3),
        Cell::number(b.map(|b| 1e4 * b.chamfer), 3),
        Cell::number(b.map(|b| a.chamfer / b.chamfer), 3),
        Cell::Number(a.chamfer_sum, 3),
        Cell::number(b.map(|b| b.chamfer_sum), 3),
        Cell::Number(a.spread, 3),
        Cell::number(b.map(|b| b.spread), 3),
    ]
}

/// Mean time of a pair, pairs and failures of each method.
pub(crate) fn costs(summary: &Summary) -> Sheet {
    let note = "Time of one pair on one thread, as measured when the answer was computed; other work on the \
                machine counts.";
    let mut sheet =
        Sheet::new("costs", "Time and failures", note, &["method", "pairs", "failed", "ms per pair"]);
    for method in summary.methods() {
        let rows: Vec<&SummaryRow> =
            summary.rows.iter().filter(|r| r.method == method && r.severity != SeverityKey::Mean).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    fn summary() -> Summary {
        let mut outcome = outcome();
        outcome.rows = vec!["icp".into(), "srrf".into()];
        Summary::of(&outcome).unwrap()
    }

    #[test]
    fn the_papers_numbers_stand_beside_ours() {
        let sheets = paper_tables(&summary(), "-x");
        assert_eq!(sheets.iter().map(|s| s.key.as_str()).collect::<Vec<_>>(), ["clean-x", "table1-x"]);
        let table = &sheets[1];
        // Two rows of ours, and the five methods that this run lacks.
        assert_eq!(table.rows.len(), 7);
        assert_eq!(table.rows[0][..2], ["cutout".into(), "icp".into()]);
        assert_eq!(table.rows[0][10], Cell::Number(12.012830, 2));
        // Mean of the severities 1 and 3 of the made-up outcome; the best of ours is marked.
        assert_eq!(
            table.rows[0][3],
            Cell::Best(summary().get("cutout", SeverityKey::Mean, "icp").unwrap().scores.rmse_r, 2)
        );
        assert_eq!((&table.rows[2][1], &table.rows[2][3]), (&"pointnetlk".into(), &Cell::None));
        assert!(table.rows.iter().all(|r| r.len() == table.head.len()));
    }

    #[test]
    fn rankings_have_a_column_for_each_method_and_mark_the_best_of_a_line() {
        let sheets = rankings(&summary());
        assert_eq!(
            sheets.iter().map(|s| s.key.as_str()).collect::<Vec<_>>(),
            ["ranking-rmse_r", "ranking-mae_r"]
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
        let table5 = skeletons(&summary, Some(&summary)).unwrap();
        assert_eq!(table5.rows[0][0], "clean".into());
        assert_eq!(table5.rows[1][3], Cell::Number(1.0, 3), "the ratio with itself");
        assert!(table5.note.contains("0.475"));
        let all = by_severity.iter().chain([&compared, &table5]);
        assert!(all.flat_map(|s| s.rows.iter().map(|r| r.len() == s.head.len())).all(|ok| ok));
        assert_eq!(costs(&summary).rows[0][3].value().unwrap(), 500.0);
        assert_eq!(symmetry(&summary).unwrap().rows.len(), 4);
    }
}
