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
    pub figures: Vec<Picture>,
    /// HTML for the page alone, as it is.
    pub html: String,
}

/// A picture.
pub(crate) struct Picture {
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

    /// Whether it can be read without the page.
    pub fn is_text(&self) -> bool {
        self.html.is_empty() || !self.sheets.is_empty()
    }

    /// As Markdown, without its heading; pictures are links to their files.
    pub fn markdown_body(&self) -> String {
        let mut text = String::new();
        for paragraph in &self.text {
            text += &format!("{paragraph}\n\n");
        }
        for line in &self.list {
            text += &format!("- {line}\n");
        }
        if !self.list.is_empty() {
            text.push('\n');
        }
        for figure in &self.figures {
            text += &format!("![{}]({})\n\n", figure.caption, figure.file);
        }
        for sheet in &self.sheets {
            text += &format!("{}\n", sheet.markdown(3));
        }
        text
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty() && self.sheets.is_empty() && self.figures.is_empty() && self.html.is_empty()
    }
}

impl Document {
    /// As Markdown; pictures are links to their files.
    pub fn markdown(&self) -> String {
        let mut text = format!("# {}\n", self.title);
        for section in self.sections.iter().filter(|section| section.is_text()) {
            text += &format!("\n## {}\n\n{}", section.title, section.markdown_body());
        }
        text += &format!("\n## Where the numbers come from\n\n{}", self.fact_lines());
        text
    }

    /// Where the numbers come from, as a list in Markdown.
    pub fn fact_lines(&self) -> String {
        self.facts.iter().map(|(name, value)| format!("- {name}: {value}\n")).collect()
    }

    /// All tables.
    pub fn sheets(&self) -> impl Iterator<Item = &Sheet> {
        self.sections.iter().flat_map(|s| &s.sheets)
    }

    /// All pictures.
    pub fn figures(&self) -> impl Iterator<Item = &Picture> {
        self.sections.iter().flat_map(|s| &s.figures)
    }
}
