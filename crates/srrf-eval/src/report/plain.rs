//! The tables of the plain run, in Markdown (for people) and CSV (for programs).

use super::sheet::{Cell, Sheet};
use super::sheets;
use crate::metrics::Scores;
use crate::quantities::{QUANTITIES, Quantity};
use crate::summary::{Summary, SummaryRow};

/// The tables for the screen: the principal quantities, means over severities, and how well methods know whether they are
/// right.
pub(crate) fn screen(summary: &Summary) -> String {
    let shown = QUANTITIES.iter().filter(|q| q.principal && q.key != "median_rot_deg");
    let tables = shown.map(|q| bare(sheets::ranking(q, summary, |row| Some(&row.scores))));
    tables.chain(sheets::probability(summary).map(bare)).collect::<Vec<_>>().join("\n")
}

/// A table under its title alone.
fn bare(sheet: Sheet) -> String {
    Sheet { note: String::new(), ..sheet }.markdown(0)
}

/// `table.md`: `head` (lines of text), then every quantity, then the severities.
pub(crate) fn markdown(summary: &Summary, head: &str) -> String {
    let mut parts = vec![format!("# Registration of corrupted pairs\n\n{head}\n{NOTES}")];
    let quantity = |q: &Quantity, scores: fn(&SummaryRow) -> Option<&Scores>| Sheet {
        note: String::new(),
        ..sheets::ranking(q, summary, scores)
    };
    let present = |q: &&Quantity| summary.rows.iter().any(|r| (q.value)(&r.scores).is_some());
    for q in QUANTITIES.iter().filter(present) {
        parts.push(quantity(q, |row| Some(&row.scores)).markdown(2));
    }
    if let Some(sheet) = sheets::probability(summary) {
        parts.push(sheet.markdown(1));
    }
    let differs = |row: &SummaryRow| row.no_symmetric.is_some_and(|s| s.pairs != row.scores.pairs);
    if summary.rows.iter().any(differs) {
        parts.push("# Without the classes that are symmetric about an axis\n".into());
        for q in QUANTITIES.iter().filter(|q| q.principal) {
            parts.push(quantity(q, |row| row.no_symmetric.as_ref()).markdown(2));
        }
    }
    if summary.severities().len() > 1 {
        parts.push("# By severity\n".into());
        parts.extend(sheets::severities(summary, "severity", true).iter().map(|sheet| sheet.markdown(2)));
    }
    if let Some(sheet) = sheets::agreement(summary) {
        parts.push(sheet.markdown(1));
    }
    parts.push(sheets::costs(summary).markdown(1));
    parts.join("\n")
}

const NOTES: &str = "\
Values of a corruption are the plain mean of the values at its severities. Rotation RMSE and MAE are over \
the three Euler angles of R = Rx(a) Ry(b) Rz(c) (DCP's convention), translation RMSE and MAE over the three \
components; RMSE and MAE come from one array of errors. A pair on which a method fails counts with the \
error of the identity, and never as recalled. `oracle` fits a pose to the true correspondences: the floor \
for least squares on matches. The best method beside it is in bold.
";

/// A column of `table.csv`.
type ScoreField = (&'static str, fn(&Scores) -> Option<f64>);

/// `table.csv`: one line for each row of the summary; fields that do not apply are empty.
pub(crate) fn csv(summary: &Summary) -> String {
    let fields: [ScoreField; 14] = [
        ("mse_r", |s| Some(s.mse_r)),
        ("rmse_r", |s| Some(s.rmse_r)),
        ("mae_r", |s| Some(s.mae_r)),
        ("mse_t", |s| Some(s.mse_t)),
        ("rmse_t", |s| Some(s.rmse_t)),
        ("mae_t", |s| Some(s.mae_t)),
        ("mean_rot_deg", |s| Some(s.mean_rot_deg)),
        ("median_rot_deg", |s| Some(s.median_rot_deg)),
        ("mean_trans", |s| Some(s.mean_trans)),
        ("median_trans", |s| Some(s.median_trans)),
        ("recall", |s| Some(s.recall)),
        ("chamfer", |s| s.chamfer),
        ("pairs", |s| Some(s.pairs as f64)),
        ("failed", |s| Some(s.failed as f64)),
    ];
    type Field = fn(&SummaryRow) -> Option<f64>;
    let certain: [(&str, Field); 5] = [
        ("right", |row| row.scores.right),
        ("brier", |row| Some(row.certainty?.brier)),
        ("calibration_error", |row| Some(row.certainty?.calibration_error)),
        ("answered", |row| Some(row.certainty?.answered)),
        ("right_of_answered", |row| row.certainty?.right_of_answered),
    ];
    let names = fields.iter().map(|(name, _)| *name);
    let without: Vec<String> = names.clone().map(|name| format!("no_symmetric_{name}")).collect();
    let head: Vec<&str> = ["corruption", "severity", "method"]
        .into_iter()
        .chain(names)
        .chain(["seconds_per_pair"])
        .chain(without.iter().map(String::as_str))
        .chain(certain.iter().map(|(name, _)| *name))
        .collect();
    let mut sheet = Sheet::new("table", "", "", &head);
    let number = |value: Option<f64>| Cell::number(value, 0);
    for row in &summary.rows {
        let mut cells: Vec<Cell> =
            vec![row.corruption.as_str().into(), Cell::Text(row.severity.to_string()), (&row.method).into()];
        cells.extend(fields.iter().map(|(_, value)| number(value(&row.scores))));
        cells.push(number(row.seconds_per_pair));
        cells.extend(fields.iter().map(|(_, value)| number(row.no_symmetric.as_ref().and_then(value))));
        cells.extend(certain.iter().map(|(_, value)| number(value(row))));
        sheet.rows.push(cells);
    }
    sheet.csv()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    fn summary() -> Summary {
        Summary::of(&outcome()).unwrap()
    }

    #[test]
    fn columns_line_up_and_the_best_is_bold() {
        let text = screen(&summary());
        let text = text.split("\n\nTranslation").next().unwrap();
        let table: Vec<&str> = text.lines().skip(2).collect();
        assert!(table.iter().all(|l| l.chars().count() == table[0].chars().count()), "{text}");
        // sqrt((1 + 4) / 6) at severity 1, three times that at 3: mean 1.83.
        assert!(table[3].contains("cutout") && table[3].contains("**1.83**"), "{text}");
        assert!(table[3].contains(" 18.26 ") && !table[3].contains("**18.26**"), "{text}");
        // Equal values are equally good.
        assert_eq!(table[2].matches("**0.00**").count(), 2, "{text}");
    }

    #[test]
    fn markdown_has_every_part() {
        let text = markdown(&summary(), "- Seed 1\n");
        for part in [
            "- Seed 1",
            "# Without the classes",
            "# By severity",
            "s = 3",
            "# Skeletons",
            "# Time and failures",
            "# Probability that the pose is right",
            "## Right, percent",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
        let skeletons = ["", "cutout", "b", "2.000", "2.000", "0.300", ""];
        assert!(text.lines().any(|l| l.split('|').map(str::trim).eq(skeletons)), "{text}");
        // 3 groups of 2 pairs at 0.5 s.
        assert!(
            text.lines().any(|l| l.split('|').map(str::trim).eq(["", "a", "6", "0", "500.00", ""])),
            "{text}"
        );
    }

    #[test]
    fn csv_is_rectangular() {
        let text = csv(&summary());
        let mut lines = text.lines();
        let columns = lines.next().unwrap().split(',').count();
        assert!(lines.clone().all(|l| l.split(',').count() == columns));
        assert_eq!(lines.count(), summary().rows.len());
    }
}
