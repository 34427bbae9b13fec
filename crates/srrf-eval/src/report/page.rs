//! The report as one HTML file that needs no network.

use srrf_view::viewer_script;

use super::document::{Document, Section};
use super::sheet::escape;

/// Refuses every request, so that the page cannot reach the network whatever it contains.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

/// Heading of the facts.
const ORIGIN: &str = "Where the numbers come from";

/// The page. The viewer's script is in it only where a section has a view.
pub(crate) fn html(document: &Document) -> String {
    let title = escape(&document.title);
    let links: String = document
        .sections
        .iter()
        .map(|s| format!("<a href=\"#{}\">{}</a>", escape(&s.id), escape(&s.title)))
        .collect();
    let facts: String = document
        .facts
        .iter()
        .map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(value)))
        .collect();
    let sections: String = document.sections.iter().map(section).collect();
    let viewer = if document.sections.iter().any(|s| !s.html.is_empty()) { viewer_script() } else { "" };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1></header>\n<nav aria-label=\"Sections\">{links}<a href=\"#origin\">{ORIGIN}</a></nav>\n\
         <main>{sections}<section id=\"origin\"><h2>{ORIGIN}</h2><dl>{facts}</dl></section></main>\n<script>{script}</script>\n<script>{viewer}</script>\n</body>\n</html>\n",
        style = include_str!("../../web/report.css"),
        script = include_str!("../../web/report.js"),
    )
}

fn section(section: &Section) -> String {
    let text: String = section.text.iter().map(|p| format!("<p>{}</p>", escape(p))).collect();
    let items: String = section.list.iter().map(|l| format!("<li>{}</li>", escape(l))).collect();
    let list = if items.is_empty() { items } else { format!("<ul>{items}</ul>") };
    let figures: String = section
        .figures
        .iter()
        .map(|f| {
            format!(
                "<figure><div class=\"scroll picture\" role=\"img\" aria-label=\"{caption}\">{}</div>\
                 <figcaption>{caption}</figcaption></figure>",
                f.svg,
                caption = escape(&f.caption),
            )
        })
        .collect();
    let sheets: String = section.sheets.iter().map(super::sheet::Sheet::html).collect();
    format!(
        "<section id=\"{}\"><h2>{}</h2>{text}{list}{}{figures}{sheets}</section>\n",
        escape(&section.id),
        escape(&section.title),
        section.html
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::Picture;
    use crate::report::sheet::Sheet;

    #[test]
    fn one_file_without_any_address_or_breakout() {
        let evil = "</script><script>alert(1)</script>\"&";
        let mut part = Section::new("part", evil);
        part.text.push(evil.into());
        part.list.push(evil.into());
        part.figures.push(Picture { file: "a.svg".into(), caption: evil.into(), svg: "<svg></svg>".into() });
        let mut sheet = Sheet::new("t", evil, evil, &[evil]);
        sheet.rows.push(vec![evil.into()]);
        part.sheets.push(sheet);
        let document =
            Document { title: evil.into(), facts: vec![(evil.into(), evil.into())], sections: vec![part] };
        let page = html(&document);
        assert!(!page.contains("<script>alert"), "{page}");
        assert_eq!(page.matches("<script>").count(), page.matches("</script>").count());
        for address in ["http:", "https:", "src=\"", "url(", "@import"] {
            assert!(!page.contains(address), "{address}");
        }
        assert!(!page.contains("three.js"), "no view, no viewer");
        let place = |what: &str| page.find(what).unwrap();
        assert!(place("<table>") < place("<dl>"), "results come first, where they come from last");
        let text = document.markdown();
        assert!(text.starts_with("# ") && text.contains("](a.svg)") && text.contains("\n- "), "{text}");
    }
}
