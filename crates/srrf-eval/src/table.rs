//! Tables in Markdown (for people) and CSV (for programs).

use std::fmt::Write;

use crate::methods::ORACLE;
use crate::metrics::Scores;
use crate::quantities::{QUANTITIES, Quantity};
use crate::summary::{SeverityKey, Summary, SummaryRow};
use crate::synthesized::CLEAN;

/// The tables for the screen: the principal quantities, means over severities.
pub(crate) fn screen(summary: &Summary) -> String {
    let shown = QUANTITIES.iter().filter(|q| q.principal && q.key != "median_rot_deg");
    shown.map(|q| section("", q, summary, |row| Some(&row.scores))).collect::<Vec<_>>().join("\n")
}

/// `table.md`: `head` (lines of text), then every quantity, then the severities.
pub(crate) fn markdown(summary: &Summary, head: &str) -> String {
    let mut text = format!("# Registration of corrupted pairs\n\n{head}\n{NOTES}\n");
    let present = |q: &&Quantity| summary.rows.iter().any(|r| (q.value)(&r.scores).is_some());
    for quantity in QUANTITIES.iter().filter(present) {
        text += &section("## ", quantity, summary, |row| Some(&row.scores));
        text.push('\n');
    }
    let differs = |row: &SummaryRow| row.no_symmetric.is_some_and(|s| s.pairs != row.scores.pairs);
    if summary.rows.iter().any(differs) {
        text += "# Without the classes that are symmetric about an axis\n\n";
        for quantity in QUANTITIES.iter().filter(|q| q.principal) {
            text += &section("## ", quantity, summary, |row| row.no_symmetric.as_ref());
            text.push('\n');
        }
    }
    if summary.severities().len() > 1 {
        text += "# By severity\n\n";
        for quantity in QUANTITIES.iter().filter(|q| q.principal) {
            text += &by_severity(quantity, summary);
            text.push('\n');
        }
    }
    text += &skeletons(summary);
    text += "# Time and failures\n\n";
    text += &costs(summary);
    text
}

const NOTES: &str = "\
Values of a corruption are the plain mean of the values at its severities. Rotation RMSE and MAE are over \
the three Euler angles of R = Rx(a) Ry(b) Rz(c) (DCP's convention), translation RMSE and MAE over the three \
components; RMSE and MAE come from one array of errors. A pair on which a method fails counts with the \
error of the identity, and never as recalled. `oracle` fits a pose to the true correspondences: the floor \
for least squares on matches. The best method beside it is in bold.
";

/// One quantity: a line for each corruption, a column for each method, then the mean of the corruptions.
fn section(
    marks: &str,
    quantity: &Quantity,
    summary: &Summary,
    scores: fn(&SummaryRow) -> Option<&Scores>,
) -> String {
    let (corruptions, methods) = (summary.corruptions(), summary.methods());
    let cell = |corruption: &str, method: &str| {
        summary.get(corruption, SeverityKey::Mean, method).and_then(scores).and_then(quantity.value)
    };
    let mut lines = vec![header("", &methods)];
    for corruption in &corruptions {
        let values: Vec<Option<f64>> = methods.iter().map(|m| cell(corruption, m)).collect();
        lines.push(line(corruption, quantity, &methods, &values));
    }
    let mean = |method: &&str| summary.over_corruptions(method, |row| scores(row).and_then(quantity.value));
    let means: Vec<Option<f64>> = methods.iter().map(mean).collect();
    if means.iter().any(Option::is_some) {
        let name = if corruptions.contains(&CLEAN) { "mean of corruptions" } else { "mean" };
        lines.push(line(name, quantity, &methods, &means));
    }
    format!("{marks}{}\n\n{}", quantity.title, aligned(&lines))
}

/// One quantity: a line for each corruption and method, a column for each severity.
fn by_severity(quantity: &Quantity, summary: &Summary) -> String {
    let severities = summary.severities();
    let names: Vec<String> = severities.iter().map(|s| format!("s = {s}")).collect();
    let mut lines = vec![["corruption", "method"].map(str::to_owned).to_vec()];
    lines[0].extend(names);
    lines[0].push("mean".into());
    for corruption in summary.corruptions() {
        for method in summary.methods() {
            let keys = severities.iter().map(|&s| SeverityKey::One(s)).chain([SeverityKey::Mean]);
            let cells: Vec<String> = keys
                .map(|key| quantity.format(summary.get(corruption, key, method).map(|r| &r.scores)))
                .collect();
            if cells[..severities.len()].iter().all(|c| c == "-") {
                continue; // clean pairs have no severities
            }
            lines.push([vec![corruption.to_owned(), method.to_owned()], cells].concat());
        }
    }
    format!("## {}\n\n{}", quantity.title, aligned(&lines))
}

/// Agreement of the skeletons of each method that makes them; empty where none does.
fn skeletons(summary: &Summary) -> String {
    let head = ["corruption", "method", "Chamfer x 10^4", "sum of distances", "spread"];
    let mut lines = vec![head.map(str::to_owned).to_vec()];
    for row in summary.rows.iter().filter(|r| r.severity == SeverityKey::Mean) {
        if let Some(s) = row.skeletons {
            let (corruption, method) = (row.corruption.clone(), row.method.clone());
            let numbers = [format!("{:.3}", 1e4 * s.chamfer), format!("{:.3}", s.chamfer_sum)];
            lines.push(
                [vec![corruption, method], numbers.to_vec(), vec![format!("{:.3}", s.spread)]].concat(),
            );
        }
    }
    if lines.len() == 1 {
        return String::new();
    }
    format!("# Skeletons\n\n{SKELETON_NOTES}\n{}\n", aligned(&lines))
}

const SKELETON_NOTES: &str = "\
Between the source's skeleton, moved by the true pose, and the target's: the mean squared distance to the \
nearest point, both ways added; the plain sum of those distances; and the spread (root mean square distance \
from the mean) of both skeletons, which a collapse would bring to 0.
";

/// Pairs, failures and time of each method over the whole run.
fn costs(summary: &Summary) -> String {
    let mut lines = vec![["method", "pairs", "failed", "ms per pair"].map(str::to_owned).to_vec()];
    for method in summary.methods() {
        let rows: Vec<&SummaryRow> =
            summary.rows.iter().filter(|r| r.method == method && r.severity != SeverityKey::Mean).collect();
        let sum = |count: fn(&Scores) -> usize| rows.iter().map(|r| count(&r.scores)).sum::<usize>();
        let seconds: Option<Vec<f64>> =
            rows.iter().map(|r| Some(r.seconds_per_pair? * r.scores.pairs as f64)).collect();
        let pairs = sum(|s| s.pairs);
        let time = seconds
            .map_or("-".into(), |s| format!("{:.2}", 1e3 * s.iter().sum::<f64>() / pairs.max(1) as f64));
        lines.push(vec![method.to_owned(), pairs.to_string(), sum(|s| s.failed).to_string(), time]);
    }
    aligned(&lines)
}

fn header(corner: &str, methods: &[&str]) -> Vec<String> {
    [corner].iter().chain(methods).map(|m| (*m).to_owned()).collect()
}

/// A line of values, the best of which (the oracle aside) is in bold.
fn line(name: &str, quantity: &Quantity, methods: &[&str], values: &[Option<f64>]) -> Vec<String> {
    let format = |value: f64| format!("{:.*}", quantity.digits, value * quantity.scale);
    let better = |a: f64, b: f64| if quantity.more_is_better { a > b } else { a < b };
    let contenders = || methods.iter().zip(values).filter(|(m, _)| **m != ORACLE).filter_map(|(_, v)| *v);
    let best = contenders().reduce(|a, b| if better(b, a) { b } else { a });
    let mark_best = contenders().count() > 1;
    let cells = methods.iter().zip(values).map(|(method, value)| match value {
        // What prints alike is equally good.
        Some(v) if mark_best && *method != ORACLE && best.is_some_and(|b| format(b) == format(*v)) => {
            format!("**{}**", format(*v))
        }
        Some(v) => format(*v),
        None => "-".into(),
    });
    [name.to_owned()].into_iter().chain(cells).collect()
}

/// A Markdown table whose columns line up in plain text too. The first line is the header; columns
/// of numbers are set to the right.
pub(crate) fn aligned(lines: &[Vec<String>]) -> String {
    let columns = lines[0].len();
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0).max(3);
    let numeric =
        |c: usize| lines[1..].iter().all(|l| l[c].trim_matches('*').parse::<f64>().is_ok() || l[c] == "-");
    let mut text = String::new();
    for (index, cells) in lines.iter().enumerate() {
        for (c, cell) in cells.iter().enumerate() {
            let pad = " ".repeat(width(c) - cell.chars().count());
            let (left, right) = if numeric(c) { (pad.as_str(), "") } else { ("", pad.as_str()) };
            // Writing to a String cannot fail.
            let _ = write!(text, "| {left}{cell}{right} ");
        }
        text += "|\n";
        if index == 0 {
            for c in 0..columns {
                let rule = "-".repeat(width(c) + 1);
                text += &if numeric(c) { format!("|{rule}:") } else { format!("|-{rule}") };
            }
            text += "|\n";
        }
    }
    text
}

/// How to read a value from [`Scores`].
type Value = fn(&Scores) -> Option<f64>;

/// `table.csv`: one line for each row of the summary; fields that do not apply are empty.
pub(crate) fn csv(summary: &Summary) -> String {
    let fields: [(&str, Value); 14] = [
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
    let quoted = |name: &str| {
        if name.contains([',', '"', '\n']) {
            format!("\"{}\"", name.replace('"', "\"\""))
        } else {
            name.into()
        }
    };
    let number = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
    let names: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
    let mut text = format!("corruption,severity,method,{},seconds_per_pair", names.join(","));
    names.iter().for_each(|name| text += &format!(",no_symmetric_{name}"));
    text.push('\n');
    for row in &summary.rows {
        let mut cells = vec![quoted(&row.corruption), row.severity.to_string(), quoted(&row.method)];
        cells.extend(fields.iter().map(|(_, value)| number(value(&row.scores))));
        cells.push(number(row.seconds_per_pair));
        cells.extend(fields.iter().map(|(_, value)| number(row.no_symmetric.as_ref().and_then(value))));
        text += &cells.join(",");
        text.push('\n');
    }
    text
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
        let text = section("", &QUANTITIES[0], &summary(), |row| Some(&row.scores));
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
