//! [`Document`]: the report, before it is a page or a file of text.

use super::sheet::Sheet;

/// The whole report.
pub(crate) struct Document {
    /// Its heading.
    pub title: String,
    /// Where the numbers come from: name and value of each fact.
    pub facts: Vec<(String, String)>,
    /// Its sections.
    pub sections: Vec<Section>,
}

/// A section of the report.
#[derive(Default)]
pub(crate) struct Section {
    /// Its name in addresses.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// Paragraphs.
    pub text: Vec<String>,
    /// A list, after the paragraphs.
    pub list: Vec<String>,
    /// Tables.
    pub sheets: Vec<Sheet>,
    /// Pictures.
    pub figures: Vec<Figure>,
    /// HTML for the page alone, as it is.
    pub html: String,
}

/// A picture.
pub(crate) struct Figure {
    /// Name of its file.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// The picture.
    pub svg: String,
}

impl Section {
    /// An empty section.
    pub fn new(id: &str, title: &str) -> Self {
        Self { id: id.into(), title: title.into(), ..Self::default() }
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty() && self.sheets.is_empty() && self.figures.is_empty() && self.html.is_empty()
    }
}

impl Document {
    /// As Markdown; pictures are links to their files.
    pub fn markdown(&self) -> String {
        let mut text = format!("# {}\n\n", self.title);
        for (name, value) in &self.facts {
            text += &format!("- {name}: {value}\n");
        }
        for section in self.sections.iter().filter(|s| s.html.is_empty() || !s.sheets.is_empty()) {
            text += &format!("\n## {}\n\n", section.title);
            for paragraph in &section.text {
                text += &format!("{paragraph}\n\n");
            }
            for line in &section.list {
                text += &format!("- {line}\n");
            }
            if !section.list.is_empty() {
                text.push('\n');
            }
            for figure in &section.figures {
                text += &format!("![{}]({})\n\n", figure.caption, figure.file);
            }
            for sheet in &section.sheets {
                text += &format!("{}\n", sheet.markdown());
            }
        }
        text
    }

    /// All tables.
    pub fn sheets(&self) -> impl Iterator<Item = &Sheet> {
        self.sections.iter().flat_map(|s| &s.sheets)
    }

    /// All pictures.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.sections.iter().flat_map(|s| &s.figures)
    }
}
