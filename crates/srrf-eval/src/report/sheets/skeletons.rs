//! How well skeletons agree: the paper's table 5, and each method by itself.

use crate::chamfer::SkeletonAgreement;
use crate::protocol::{CLEAN, MIDDLE};
use crate::report::paper;
use crate::report::sheet::{Cell, Sheet};
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary};

/// Table 5: the Chamfer distance between the skeletons of a pair, with and without the loss.
pub(crate) fn table5(with: &Summary, without: Option<&Summary>) -> Option<Sheet> {
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
            let middle = summary.get(corruption, SeverityKey::One(MIDDLE.get()), &TableRow::SRRF);
            middle.or_else(|| summary.get(corruption, SeverityKey::Mean, &TableRow::SRRF))?.skeletons
        };
        let (Some(a), b) = (agreement(with), without.and_then(agreement)) else { continue };
        sheet.rows.push(agreement_row(corruption, &a, b.as_ref()));
        if corruption != CLEAN {
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

/// Agreement of the skeletons of each method that makes them; `None` where none does.
pub(crate) fn agreement(summary: &Summary) -> Option<Sheet> {
    let head = ["corruption", "method", "Chamfer x 10^4", "sum of distances", "spread"];
    let mut sheet = Sheet::new("skeletons", "Skeletons", AGREEMENT_NOTE, &head);
    for row in summary.rows.iter().filter(|r| r.severity == SeverityKey::Mean) {
        let Some(s) = row.skeletons else { continue };
        let numbers = [1e4 * s.chamfer, s.chamfer_sum, s.spread].map(|v| Cell::Number(v, 3));
        sheet.rows.push([&[row.corruption.as_str().into(), (&row.method).into()], &numbers[..]].concat());
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}

const AGREEMENT_NOTE: &str = "\
Between the source's skeleton, moved by the true pose, and the target's: the mean squared distance to the \
nearest point, both ways added; the plain sum of those distances; and the spread (root mean square distance \
from the mean) of both skeletons, which a collapse would bring to 0.";
