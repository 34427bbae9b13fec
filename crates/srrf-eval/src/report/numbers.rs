//! The numbers of the report by key, as they are printed, so that prose can quote them and be checked.

use std::collections::BTreeMap;

use super::document::Document;
use super::sheet::{Cell, Sheet};
use crate::certainty::CertaintyScores;
use crate::methods::is_ours;
use crate::protocol::CLEAN;
use crate::quantities::QUANTITIES;
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary, SummaryRow};

/// Printed numbers by key.
pub(crate) type Numbers = BTreeMap<String, String>;

/// All numbers: of every table (`table.row.column`), of every method in the main tables
/// (`main.method.corruption.quantity`, with `mean` for the mean of the corruptions), and of the README's table (`readme.row.what`).
pub(crate) fn numbers(document: &Document, main: Option<&Summary>, partial: Option<&Summary>) -> Numbers {
    let mut numbers = Numbers::new();
    for sheet in document.sheets() {
        of_sheet(&mut numbers, sheet);
    }
    if let Some(main) = main {
        of_methods(&mut numbers, main);
        let corruptions: Vec<&str> = main.corruptions().into_iter().filter(|c| *c != CLEAN).collect();
        readme(&mut numbers, "objects", main, &[CLEAN]);
        readme(&mut numbers, "corrupted", main, &corruptions);
    }
    if let Some(partial) = partial {
        readme(&mut numbers, "partial", partial, &[CLEAN]);
    }
    numbers
}

/// Words for a key: lower case, joined by `-`.
fn slug(text: &str) -> String {
    let keep = |c: char| c.is_alphanumeric() || matches!(c, '_' | '+');
    let words: Vec<&str> = text.split(|c: char| !keep(c)).filter(|word| !word.is_empty()).collect();
    words.join("-").to_lowercase()
}

fn of_sheet(numbers: &mut Numbers, sheet: &Sheet) {
    for row in &sheet.rows {
        let words =
            row.iter().take_while(|cell| matches!(cell, Cell::Text(_))).map(|cell| slug(&cell.printed()));
        let name: Vec<String> = [slug(&sheet.key)].into_iter().chain(words).collect();
        for (head, cell) in sheet.head.iter().zip(row).filter(|(_, cell)| cell.value().is_some()) {
            let key = format!("{}.{}", name.join("."), slug(head));
            let taken = numbers.keys().filter(|k| **k == key || k.starts_with(&format!("{key}~"))).count();
            // Two columns of one name are told apart by their order.
            let key = if taken == 0 { key } else { format!("{key}~{}", taken + 1) };
            numbers.insert(key, cell.printed());
        }
    }
}

fn of_methods(numbers: &mut Numbers, main: &Summary) {
    for method in main.methods() {
        for quantity in &QUANTITIES {
            let value = |row: &SummaryRow| quantity.shown(&row.scores);
            let mut put = |corruption: &str, value: Option<f64>| {
                let key = format!("main.{method}.{}.{}", slug(corruption), quantity.key);
                numbers.extend(value.map(|v| (key, format!("{v:.*}", quantity.digits))));
            };
            for corruption in main.corruptions() {
                put(corruption, main.get(corruption, SeverityKey::Mean, method).and_then(value));
            }
            put("mean", main.over_corruptions(method, value));
        }
    }
}

/// A row of the README's table: the product over the pairs of these corruptions, and the best other method.
fn readme(numbers: &mut Numbers, name: &str, summary: &Summary, corruptions: &[&str]) {
    let rows = |method: &TableRow| -> Vec<&SummaryRow> {
        corruptions.iter().filter_map(|c| summary.get(c, SeverityKey::Mean, method)).collect()
    };
    let mean = |method: &TableRow, value: fn(&SummaryRow) -> Option<f64>| -> Option<f64> {
        let values: Vec<f64> = rows(method).into_iter().map(value).collect::<Option<_>>()?;
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let right = |method: &TableRow| mean(method, |row| row.scores.right).map(|share| 100.0 * share);
    let seconds = |method: &TableRow| mean(method, |row| row.seconds_per_pair);
    let mut put = |what: &str, value: Option<String>| {
        numbers.extend(value.map(|value| (format!("readme.{name}.{what}"), value)));
    };
    let percent = |value: Option<f64>| value.map(|v| format!("{v:.1}"));
    let time = |value: Option<f64>| value.map(|v| format!("{v:.2}"));
    let ours = TableRow::SRRF_REGISTER;
    let certainty = CertaintyScores::together(rows(&ours).into_iter().filter_map(|r| r.certainty.as_ref()));
    put("right", percent(right(&ours)));
    put("right_answered", percent(certainty.and_then(|c| Some(100.0 * c.right_of_answered?))));
    put("answered", percent(certainty.map(|c| 100.0 * c.answered)));
    put("seconds", time(seconds(&ours)));
    let peers = summary.methods().into_iter().filter(|m| **m != TableRow::Oracle && !is_ours(m));
    let best = peers.filter_map(|m| Some((m, right(m)?))).reduce(|a, b| if b.1 > a.1 { b } else { a });
    if let Some((peer, share)) = best {
        put("peer", Some(peer.to_string()));
        put("peer_right", percent(Some(share)));
        put("peer_seconds", time(seconds(peer)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::Section;
    use crate::summary::tests::outcome;

    fn summary() -> Summary {
        let mut outcome = outcome();
        outcome.rows = vec![TableRow::ICP, TableRow::SRRF_REGISTER];
        Summary::of(&outcome).unwrap()
    }

    #[test]
    fn keys_of_tables_methods_and_the_readme() {
        let mut section = Section::new("s", "S");
        let mut sheet =
            Sheet::new("table1", "T", "", &["corruption", "method", "RMSE(R)", "recall %", "recall %"]);
        let number = |v| Cell::Number(v, 2);
        sheet.rows.push(vec![
            "mean of corruptions".into(),
            "srrf+refine".into(),
            number(1.234),
            number(2.0),
            number(3.0),
        ]);
        section.sheets.push(sheet);
        let document = Document { title: String::new(), facts: vec![], sections: vec![section] };
        let all = numbers(&document, Some(&summary()), Some(&summary()));
        let is = |key: &str, value: &str| assert_eq!(all.get(key).map(String::as_str), Some(value), "{key}");
        is("table1.mean-of-corruptions.srrf+refine.rmse-r", "1.23");
        is("table1.mean-of-corruptions.srrf+refine.recall", "2.00");
        is("table1.mean-of-corruptions.srrf+refine.recall~2", "3.00");
        is("main.icp.cutout.rmse_r", "1.83");
        is("main.srrf-register.clean.right", "100.0");
        // The product abstains at severity 3 and is wrong on all of cutout; the peer is right.
        is("readme.objects.right_answered", "100.0");
        is("readme.corrupted.right", "0.0");
        is("readme.corrupted.answered", "50.0");
        is("readme.corrupted.peer", "icp");
        is("readme.corrupted.peer_right", "75.0");
        is("readme.partial.seconds", "0.50");
        assert!(!all.contains_key("main.icp.mean.rmse_r"), "one corruption has no mean of several");
    }
}
