//! Experiments side by side.

use super::is_oracle;
use crate::quantities::{QUANTITIES, Quantity};
use crate::report::sheet::{Cell, Sheet};
use crate::summary::{SeverityKey, Summary};

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
        sheet.mark_best(first, &all, |row| !is_oracle(&row[1]));
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}
