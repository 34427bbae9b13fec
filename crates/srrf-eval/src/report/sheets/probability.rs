//! How well methods know whether they are right.

use crate::certainty::CertaintyScores;
use crate::report::sheet::{Cell, Sheet};
use crate::summary::{SeverityKey, Summary};

const NOTE: &str = "\
A pose is right within 5 degrees and a tenth of the target's radius where the source's centroid lands. `answered`: the \
method does not abstain. Brier score: mean square of probability minus right (0 is perfect, 0.25 is who always says one half). \
Calibration error: mean distance between the probabilities said and the share that is right, in ten bins. All severities \
together.";

/// Brier score, expected calibration error, share answered and share right of those, for each method that says how sure it
/// is: over all pairs first, then by corruption; `None` where no method does.
pub(crate) fn probability(summary: &Summary) -> Option<Sheet> {
    let head = [
        "corruption",
        "method",
        "pairs",
        "right %",
        "answered %",
        "right of answered %",
        "Brier score",
        "calibration error",
    ];
    let mut sheet = Sheet::new("probability", "Probability that the pose is right", NOTE, &head);
    let row = |name: &str, method, scores: &CertaintyScores| -> Vec<Cell> {
        vec![
            name.into(),
            method,
            Cell::Number(scores.pairs as f64, 0),
            Cell::Number(100.0 * scores.right, 1),
            Cell::Number(100.0 * scores.answered, 1),
            Cell::number(scores.right_of_answered.map(|share| 100.0 * share), 1),
            Cell::Number(scores.brier, 4),
            Cell::Number(scores.calibration_error, 4),
        ]
    };
    for method in summary.methods() {
        let all = summary.certainty(method);
        sheet.rows.extend(all.map(|scores| row("all pairs", method.into(), &scores)));
    }
    for found in summary.rows.iter().filter(|r| r.severity == SeverityKey::Mean) {
        let scores = found.certainty.as_ref();
        sheet.rows.extend(scores.map(|scores| row(&found.corruption, (&found.method).into(), scores)));
    }
    (!sheet.rows.is_empty()).then_some(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::TableRow;
    use crate::summary::tests::outcome;

    #[test]
    fn methods_that_say_how_sure_they_are_have_rows_and_no_others() {
        let summary = Summary::of(&outcome()).unwrap();
        let sheet = probability(&summary).unwrap();
        assert_eq!(sheet.rows.len(), 3, "all pairs, clean and cutout, of `b`");
        assert!(
            sheet
                .rows
                .iter()
                .all(|row| row[1] == (&TableRow::method("b")).into() && row.len() == sheet.head.len())
        );
        assert_eq!(sheet.rows[2][5], Cell::Number(0.0, 1), "answered at severity 1, wrongly");
        let mut quiet = summary;
        quiet.rows.retain(|row| row.method == TableRow::method("a"));
        assert_eq!(probability(&quiet), None);
    }
}
