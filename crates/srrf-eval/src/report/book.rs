//! The results as pages of the book, which nobody edits by hand.

use std::collections::BTreeMap;
use std::path::Path;

use super::document::{Document, Section};
use super::write::file;
use crate::EvalError;

/// First line of every page.
const WARNING: &str = "<!-- Written by `srrf-eval tables --book`: what is changed here by hand is lost. -->";

/// Name of the file of numbers.
const NUMBERS: &str = "numbers.json";

/// Sections that stand on a page of another name: section, page. All others have a page of their own.
const PAGES: [(&str, &str); 2] = [("tables", "results"), ("losses", "results")];

/// Writes the sections of the report as Markdown pages into `folder`, their pictures beside them, and `numbers`, from which
/// other pages quote; gives the names of the files.
///
/// # Errors
/// [`EvalError::Output`] names the file that cannot be written.
pub(crate) fn write(
    folder: &Path,
    document: &Document,
    numbers: &BTreeMap<String, String>,
) -> Result<Vec<String>, EvalError> {
    let mut files = pages(document);
    files.extend(document.figures().map(|figure| (figure.file.clone(), figure.svg.clone())));
    let json = serde_json::to_string_pretty(numbers)
        .map_err(|e| EvalError::Output { path: folder.join(NUMBERS), source: e.into() })?;
    files.push((NUMBERS.into(), json + "\n"));
    files.iter().try_for_each(|(name, content)| file(folder, name, content))?;
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

/// The pages: name of the file, content.
fn pages(document: &Document) -> Vec<(String, String)> {
    let mut pages: Vec<(&str, Vec<&Section>)> = Vec::new();
    for section in document.sections.iter().filter(|section| section.is_text()) {
        let page =
            PAGES.iter().find(|(id, _)| *id == section.id).map_or(section.id.as_str(), |(_, page)| page);
        match pages.iter_mut().find(|(name, _)| *name == page) {
            Some((_, sections)) => sections.push(section),
            None => pages.push((page, vec![section])),
        }
    }
    let facts = document.fact_lines();
    let text = |sections: &[&Section]| {
        // One section gives its title to the page; several stand under the title of the first.
        let first = sections.first().map_or("", |section| section.title.as_str());
        let bodies: Vec<String> = sections
            .iter()
            .enumerate()
            .map(|(at, section)| {
                let title = if at == 0 { String::new() } else { format!("## {}\n\n", section.title) };
                title + &section.markdown_body()
            })
            .collect();
        format!(
            "{WARNING}\n\n# {first}\n\n{}\n<details><summary>Where the numbers come from</summary>\n\n{facts}\n</details>\n",
            bodies.join("\n")
        )
    };
    pages.iter().map(|(name, sections)| (format!("{name}.md"), text(sections))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::document::Picture;
    use crate::report::sheet::{Cell, Sheet};

    fn document() -> Document {
        let mut losses = Section::new("losses", "Losses");
        losses.list.push("One.".into());
        let mut tables = Section::new("tables", "Tables");
        let mut sheet = Sheet::new("t", "A table", "", &["a", "b"]);
        sheet.rows.push(vec!["x".into(), Cell::Number(1.25, 1)]);
        tables.sheets.push(sheet);
        let mut severity = Section::new("severity", "Severities");
        severity.figures.push(Picture { file: "s.svg".into(), caption: "c".into(), svg: "<svg/>".into() });
        let mut views = Section::new("pairs", "Pairs");
        views.html = "<canvas>".into();
        let facts = vec![("Command".into(), "srrf-eval tables".into()), ("Seed".into(), "1".into())];
        Document { title: "Report".into(), facts, sections: vec![losses, tables, severity, views] }
    }

    #[test]
    fn every_page_says_where_it_comes_from_and_views_stay_out() {
        let folder = tempfile::tempdir().unwrap();
        let numbers = BTreeMap::from([("a.b".to_owned(), "1.25".to_owned())]);
        let names = write(folder.path(), &document(), &numbers).unwrap();
        assert_eq!(names, ["results.md", "severity.md", "s.svg", "numbers.json"]);
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        for page in ["results.md", "severity.md"] {
            let text = read(page);
            assert!(text.starts_with(WARNING) && text.contains("- Command: srrf-eval tables"), "{text}");
            assert!(text.contains("- Seed: 1") && !text.contains("<canvas>"), "{text}");
        }
        let results = read("results.md");
        assert!(results.contains("\n# Losses\n") && results.contains("\n## Tables\n"), "{results}");
        assert!(results.contains("### A table") && read("severity.md").contains("![c](s.svg)"));
        let back: BTreeMap<String, String> = serde_json::from_str(&read("numbers.json")).unwrap();
        assert_eq!(back, numbers);
    }
}
