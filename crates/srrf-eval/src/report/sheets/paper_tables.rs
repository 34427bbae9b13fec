//! The paper's tables, its own numbers beside ours.

use srrf_corrupt::{CorruptionKind, Family};

use super::is_oracle;
use crate::metrics::Scores;
use crate::protocol::CLEAN;
use crate::report::paper;
use crate::report::sheet::{Cell, Sheet};
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary};

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

const CLEAN_NOTE: &str = "\
Degrees; translations in the unit of the clouds. The paper has no such table. In bold the best beside the oracle, \
which fits a pose to perfect correspondences.";

/// Numbers where less is better in [`PAPER_HEAD`], then recall.
const PAPER_BEST: [(usize, bool); 8] =
    [(2, false), (3, false), (4, false), (5, false), (6, false), (7, false), (8, false), (9, true)];

/// Tables 1 to 3 with clean pairs before them. `suffix` tells the tables of several models apart.
pub(crate) fn paper_tables(summary: &Summary, suffix: &str) -> Vec<Sheet> {
    let mut sheets = Vec::new();
    let key = |name: &str| format!("{name}{suffix}");
    let clean = ("clean", "Clean pairs", vec![CLEAN]);
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
            sheet.mark_best(first, &PAPER_BEST, |row| !is_oracle(&row[1]));
        }
        if !sheet.rows.is_empty() {
            sheets.push(sheet);
        }
    }
    sheets
}

fn paper_row(corruption: &str, method: &TableRow, ours: Option<&Scores>) -> Vec<Cell> {
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
        sheet.mark_best(first, &PAPER_BEST, |row| !is_oracle(&row[1]));
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sheets::tests::summary;

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
            Cell::Best(summary().get("cutout", SeverityKey::Mean, &TableRow::ICP).unwrap().scores.rmse_r, 2)
        );
        assert_eq!((&table.rows[2][1], &table.rows[2][3]), (&"pointnetlk".into(), &Cell::None));
        assert!(table.rows.iter().all(|r| r.len() == table.head.len()));
    }
}
