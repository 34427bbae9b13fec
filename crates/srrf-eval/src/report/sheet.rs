//! [`Sheet`]: one table of the report, as Markdown, CSV and HTML.

use std::fmt::Write;

use srrf_args::words::visible;

use crate::rows::TableRow;

/// A cell of a [`Sheet`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Cell {
    /// Words.
    Text(String),
    /// A number with the digits to print.
    Number(f64, usize),
    /// The best number of its kind.
    Best(f64, usize),
    /// Nothing is known.
    None,
}

impl Cell {
    /// A number, where there is one.
    pub fn number(value: Option<f64>, digits: usize) -> Self {
        value.filter(|v| v.is_finite()).map_or(Self::None, |v| Self::Number(v, digits))
    }

    /// The value of a number.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Number(value, _) | Self::Best(value, _) => Some(*value),
            Self::Text(_) | Self::None => None,
        }
    }

    /// The cell as it is printed.
    pub fn printed(&self) -> String {
        match self {
            Self::Text(text) => visible(text).into_owned(),
            Self::Number(value, digits) | Self::Best(value, digits) => format!("{value:.digits$}"),
            Self::None => "-".into(),
        }
    }
}

impl From<&TableRow> for Cell {
    fn from(row: &TableRow) -> Self {
        Self::Text(row.to_string())
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// Marks the best of several numbers, and what prints like it.
fn mark_best(mut cells: Vec<&mut Cell>, more_is_better: bool) {
    let better = |a: f64, b: f64| if more_is_better { a > b } else { a < b };
    let numbers: Vec<f64> = cells.iter().filter_map(|cell| cell.value()).collect();
    let Some(best) = numbers.iter().copied().reduce(|a, b| if better(b, a) { b } else { a }) else { return };
    for cell in cells.iter_mut().filter(|_| numbers.len() > 1) {
        if let Cell::Number(value, digits) = **cell
            && format!("{value:.digits$}") == format!("{best:.digits$}")
        {
            **cell = Cell::Best(value, digits);
        }
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sheet {
    /// Name of its file, and of its place in the page.
    pub key: String,
    /// Its heading.
    pub title: String,
    /// What to know before reading it, a paragraph; may be empty.
    pub note: String,
    /// Headings of the columns.
    pub head: Vec<String>,
    /// The rows, each as long as the head.
    pub rows: Vec<Vec<Cell>>,
}

impl Sheet {
    /// An empty table.
    pub fn new(key: &str, title: &str, note: &str, head: &[&str]) -> Self {
        let head = head.iter().map(|h| (*h).to_owned()).collect();
        Self { key: key.into(), title: title.into(), note: note.into(), head, rows: Vec::new() }
    }

    /// Marks the best number of each of `columns` among the rows `from..` for which `competes` holds;
    /// the flag of a column says whether more is better. What prints alike is equally good.
    pub fn mark_best(&mut self, from: usize, columns: &[(usize, bool)], competes: impl Fn(&[Cell]) -> bool) {
        for &(column, more_is_better) in columns {
            let rows = self.rows[from..].iter_mut().filter(|row| competes(row));
            mark_best(rows.map(|row| &mut row[column]).collect(), more_is_better);
        }
    }

    /// Marks the best number of the row `row` among the columns for which `competes` holds.
    pub fn mark_best_of_row(&mut self, row: usize, more_is_better: bool, competes: impl Fn(usize) -> bool) {
        let cells = self.rows[row].iter_mut().enumerate().filter(|(column, _)| competes(*column));
        mark_best(cells.map(|(_, cell)| cell).collect(), more_is_better);
    }

    /// As Markdown, under a heading of this level; a plain line where it is 0.
    pub fn markdown(&self, level: usize) -> String {
        let mut lines = vec![self.head.iter().map(|head| plain_markdown(head)).collect::<Vec<_>>()];
        for row in &self.rows {
            let bold = |cell: &Cell| match cell {
                Cell::Best(..) => format!("**{}**", cell.printed()),
                Cell::Text(words) => plain_markdown(words),
                _ => cell.printed(),
            };
            lines.push(row.iter().map(bold).collect());
        }
        let note = if self.note.is_empty() { String::new() } else { format!("{}\n\n", self.note) };
        let marks = format!("{} ", "#".repeat(level));
        format!("{}{}\n\n{note}{}", marks.trim_start(), self.title, aligned(&lines))
    }

    /// As CSV, numbers in full.
    pub fn csv(&self) -> String {
        let quoted = |text: &str| {
            let text = visible(text);
            // What a spreadsheet would run as a formula.
            let formula = if text.starts_with(['=', '+', '-', '@', '\t']) { "'" } else { "" };
            if text.contains([',', '"', '\n']) {
                format!("\"{formula}{}\"", text.replace('"', "\"\""))
            } else {
                format!("{formula}{text}")
            }
        };
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let mut text = line(self.head.iter().map(|h| quoted(h)).collect());
        for row in &self.rows {
            let cell = |cell: &Cell| match cell {
                Cell::Text(words) => quoted(words),
                Cell::Number(value, _) | Cell::Best(value, _) => value.to_string(),
                Cell::None => String::new(),
            };
            text += &line(row.iter().map(cell).collect());
        }
        text
    }

    /// Whether a column holds numbers: some, and no words.
    fn is_numeric(&self, column: usize) -> bool {
        let cells = || self.rows.iter().filter_map(|row| row.get(column));
        cells().any(|cell| cell.value().is_some()) && !cells().any(|cell| matches!(cell, Cell::Text(_)))
    }

    /// As HTML; the page's script makes the headings sort the rows.
    pub fn html(&self) -> String {
        let mut html =
            format!("<section class=\"sheet\" id=\"{}\"><h3>{}</h3>", escape(&self.key), escape(&self.title));
        if !self.note.is_empty() {
            html += &format!("<p>{}</p>", escape(&self.note));
        }
        html += "<div class=\"scroll\"><table><thead><tr>";
        let classes: Vec<&str> = (0..self.head.len())
            .map(|column| if self.is_numeric(column) { " class=\"number\"" } else { "" })
            .collect();
        for (head, class) in self.head.iter().zip(&classes) {
            html +=
                &format!("<th scope=\"col\"{class}><button type=\"button\">{}</button></th>", escape(head));
        }
        html += "</tr></thead><tbody>\n";
        for row in &self.rows {
            html += "<tr>";
            for (cell, class) in row.iter().zip(&classes) {
                let printed = escape(&cell.printed());
                // Writing to a String cannot fail.
                let _ = match cell {
                    Cell::Text(_) => write!(html, "<td{class}>{printed}</td>"),
                    Cell::Number(value, _) => write!(html, "<td{class} data-v=\"{value}\">{printed}</td>"),
                    Cell::Best(value, _) => {
                        write!(html, "<td{class} data-v=\"{value}\"><b>{printed}</b></td>")
                    }
                    Cell::None => write!(html, "<td{class} data-v=\"\">{printed}</td>"),
                };
            }
            html += "</tr>\n";
        }
        html + "</tbody></table></div></section>\n"
    }
}

/// A Markdown table whose columns line up in plain text too. The first line is the header; columns
/// of numbers are set to the right.
fn aligned(lines: &[Vec<String>]) -> String {
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

/// Text that others wrote, as a cell of a Markdown table: no end of the cell or the line, no link, picture or tag.
fn plain_markdown(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in visible(text).chars() {
        match c {
            '\n' | '\t' => plain.push(' '),
            '<' => plain.push_str("&lt;"),
            '|' | '[' | '`' => plain.extend(['\\', c]),
            _ => plain.push(c),
        }
    }
    plain
}

/// Text for HTML, in elements and quoted attributes.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Sheet {
        let mut sheet = Sheet::new("k", "A <title>", "Read \"this\".", &["method", "error", "recall"]);
        for (name, error, recall) in
            [("oracle", 0.5, 1.0), ("a", 2.001, 0.7), ("b", 2.0, 0.9), ("c", 3.0, 0.1)]
        {
            sheet.rows.push(vec![name.into(), Cell::Number(error, 2), Cell::Number(recall, 1)]);
        }
        sheet.rows.push(vec!["d, not run".into(), Cell::None, Cell::number(Some(f64::NAN), 1)]);
        sheet.mark_best(0, &[(1, false), (2, true)], |row| row[0] != "oracle".into());
        sheet
    }

    #[test]
    fn the_best_is_bold_and_what_prints_alike_too() {
        let text = sheet().markdown(3);
        assert_eq!(text.matches("**2.00**").count(), 2, "{text}");
        assert_eq!(text.matches("**").count(), 2 * 3, "{text}");
        assert!(text.contains("**0.9**") && text.contains("Read \"this\"."), "{text}");
    }

    #[test]
    fn names_that_others_gave_are_text_only() {
        let mut sheet = Sheet::new("k", "t", "", &["method"]);
        for name in ["=1+1", "@x", "-2", "a|b", "![x](http://e)", "<script>", "\u{1b}[31mred", "two\nlines"] {
            sheet.rows.push(vec![name.into()]);
        }
        let csv = sheet.csv();
        assert!(csv.starts_with("method\n'=1+1\n'@x\n'-2\na|b\n"), "{csv}");
        let text = sheet.markdown(0);
        for wanted in ["| a\\|b ", "!\\[x](http://e)", "&lt;script>", "two lines"] {
            assert!(text.contains(wanted), "{wanted}: {text}");
        }
        assert!([&csv, &text, &sheet.html()].iter().all(|t| !t.contains('\u{1b}')), "{text}");
    }

    #[test]
    fn csv_keeps_all_digits_and_html_escapes() {
        let csv = sheet().csv();
        assert!(csv.contains("\na,2.001,0.7\n") && csv.contains("\"d, not run\",,\n"), "{csv}");
        let html = sheet().html();
        assert!(html.contains("A &lt;title&gt;") && html.contains("data-v=\"2.001\"><b>2.00</b>"), "{html}");
        assert_eq!(html.matches("<tr>").count(), 6);
        let heads: Vec<&str> = html.matches("<th scope=\"col\" class=\"number\">").collect();
        assert_eq!(heads.len(), 2, "the heads of numbers, not that of the names: {html}");
    }
}
