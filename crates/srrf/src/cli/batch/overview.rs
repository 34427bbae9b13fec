//! An overview of a batch in HTML: a row a pair, and a page for each.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::row::BatchRow;
use super::shard::hash;
use super::store::in_words;

/// The name of the page of a pair; by its id alone, so that shards can share a folder.
pub fn page_name(id: &str) -> String {
    format!("pair-{:016x}.html", hash(id))
}

/// The overview in a folder of pages.
pub fn index_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

const HEAD: &str = r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Pairs</title><style>
body{font:15px system-ui,sans-serif;margin:1.5rem;color-scheme:light dark}
pre{overflow-x:auto}table{border-collapse:collapse}
th,td{padding:.25rem .7rem;text-align:left;border-bottom:1px solid #8884}td.n{text-align:right;font-variant-numeric:tabular-nums}
tr.abstain{background:#fc03}tr.failed{background:#f003}
</style></head><body>
"#;

/// The page: `digest` in front, then the table. Rows link to the pages that are there.
pub struct Overview {
    html: String,
    folder: PathBuf,
    columns: Vec<String>,
}

impl Overview {
    /// Begins it; `columns` are those of the list.
    pub fn new(folder: &Path, digest: &str, columns: Vec<String>) -> Self {
        let mut html = HEAD.to_owned();
        let _ = write!(html, "<pre>{}</pre>\n<table><tr>", escaped(digest));
        let fixed = ["pair", "verdict", "probability", "near", "RMSE", "seconds"];
        for name in fixed.into_iter().chain(columns.iter().map(String::as_str)) {
            let _ = write!(html, "<th>{}</th>", escaped(name));
        }
        html.push_str("</tr>\n");
        Self { html, folder: folder.to_owned(), columns }
    }

    /// One more row.
    pub fn add(&mut self, row: &BatchRow) {
        let page = page_name(row.id());
        let id = escaped(row.id());
        let linked =
            if self.folder.join(&page).is_file() { format!("<a href=\"{page}\">{id}</a>") } else { id };
        let (class, verdict) = match (row.error(), row.abstain()) {
            (Some(error), _) => ("failed", escaped(error)),
            (None, Some(true)) => ("abstain", "abstain".to_owned()),
            _ => ("", "probably right".to_owned()),
        };
        let _ = write!(self.html, "<tr class=\"{class}\"><td>{linked}</td><td>{verdict}</td>");
        let percent =
            |way: &[&str]| row.number(way).map_or_else(String::new, |n| format!("{:.0} %", 100.0 * n));
        let rmse = row.number(&["evidence", "inlier_rmse"]).map_or_else(String::new, |n| format!("{n:.4}"));
        let seconds = row.seconds().map_or_else(String::new, |n| format!("{n:.2}"));
        for figure in [percent(&["probability"]), percent(&["evidence", "fitness"]), rmse, seconds] {
            let _ = write!(self.html, "<td class=\"n\">{figure}</td>");
        }
        for name in &self.columns {
            let _ = write!(self.html, "<td>{}</td>", escaped(&in_words(row.column(name))));
        }
        self.html.push_str("</tr>\n");
    }

    /// The end.
    pub fn finish(mut self) -> String {
        self.html.push_str("</table></body></html>\n");
        self.html
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::super::row::testing::{answered, failed};
    use super::*;

    #[test]
    fn rows_link_to_pages_that_are_there() {
        let folder = tempfile::tempdir().unwrap();
        let there = answered("<a>", 1.0, 0.93);
        std::fs::write(folder.path().join(page_name(there.id())), "x").unwrap();
        let mut overview = Overview::new(folder.path(), "2 pairs & more", vec!["site".into()]);
        overview.add(&there);
        overview.add(&failed("b"));
        overview.add(&answered("c", 1.0, 0.2));
        let html = overview.finish();
        let name = page_name("<a> -> t");
        assert!(html.contains(&format!("<a href=\"{name}\">&lt;a&gt; -&gt; t</a></td><td>probably right</td><td class=\"n\">93 %</td>")), "{html}");
        assert!(
            html.contains("<tr class=\"failed\"><td>b -&gt; t</td><td>no &quot;pose&quot;</td>"),
            "{html}"
        );
        assert!(html.contains("<tr class=\"abstain\">") && html.contains("<pre>2 pairs &amp; more</pre>"));
        assert!(html.contains("<td>ü, 1</td></tr>") && html.matches("<tr").count() == 4);
    }
}
