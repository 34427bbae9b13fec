//! [`Page`]: a whole HTML file.

use std::path::{Path, PathBuf};

use srrf_cloud::io::write_atomically;

use crate::html::escape;
use crate::{Pair, viewer_element, viewer_script};

/// Why a page could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The file cannot be written; no part of it remains.
    #[error("cannot write the page {path:?}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// One self-contained HTML file that shows one pair, or several to choose from.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    title: String,
    pairs: Vec<Pair<'a>>,
}

/// Refuses every request, so that a page cannot reach the network whatever it contains.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

const STYLE: &str = "html,body{margin:0;height:100%}body{display:flex;flex-direction:column;font:15px/1.45 \
    system-ui,sans-serif;background:#fff;color:#1b1f24;--sv-height:100%}header{padding:.6rem 1rem;border-bottom:1px \
    solid #8884}h1{font-size:1.05rem;margin:0;font-weight:600;overflow-wrap:anywhere}main{flex:1;min-height:0}\
    @media (max-width:760px){html,body{height:auto}body{--sv-height:auto}}\
    @media (prefers-color-scheme:dark){body{background:#14171c;color:#e6e9ee}}\
    @media print{html,body{height:auto}}";

impl<'a> Page<'a> {
    /// A page without pairs.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), pairs: Vec::new() }
    }

    /// Adds a pair. The first is shown when the page opens.
    #[must_use]
    pub fn pair(mut self, pair: Pair<'a>) -> Self {
        self.pairs.push(pair);
        self
    }

    /// The file's text. Takes time: for each pose the distance of every drawn source point to the
    /// target is computed, on all threads of the current rayon pool.
    pub fn to_html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n\
             <body>\n<header><h1>{title}</h1></header>\n<main>{viewer}</main>\n\
             <script>{script}</script>\n</body>\n</html>\n",
            title = escape(&self.title),
            viewer = viewer_element("view", &self.pairs),
            script = viewer_script(),
        )
    }

    /// Writes the page; the file appears whole or not at all.
    ///
    /// # Errors
    /// [`ViewError::Write`], which names the file.
    pub fn write(&self, path: &Path) -> Result<(), ViewError> {
        let html = self.to_html();
        write_atomically(path, |out| out.write_all(html.as_bytes()))
            .map_err(|source| ViewError::Write { path: path.to_owned(), source })
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::PointCloud;

    use super::*;

    #[test]
    fn one_file_without_any_address() {
        let cloud = PointCloud::new(vec![[1.0, 2.0, 3.0], [4.0, 4.0, 4.0]]).unwrap();
        let page = Page::new("A <title>").pair(Pair::new("p", &cloud, &cloud));
        let html = page.to_html();
        assert!(html.contains("<title>A &lt;title&gt;</title>"));
        let own = html.replace(viewer_script(), "");
        for address in ["http:", "https:", "src=\"", "url(", "@import"] {
            assert!(!own.contains(address), "{address}");
        }
        assert_eq!(html, page.to_html());
    }

    #[test]
    fn writes_or_says_where_it_could_not() {
        let cloud = PointCloud::new(vec![[0.0; 3]]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let page = Page::new("t").pair(Pair::new("p", &cloud, &cloud));
        let path = folder.path().join("page.html");
        page.write(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), page.to_html());
        let error = page.write(&folder.path().join("none/page.html")).unwrap_err();
        assert!(error.to_string().contains("page.html"), "{error}");
    }

    /// More points are never drawn, so this is as large as a page of one pair and 2 poses gets.
    #[test]
    fn the_largest_page_is_small() {
        let points: Vec<[f64; 3]> = (0..130_000u32)
            .map(|i| {
                let s = f64::from(i);
                [(0.1 * s).sin(), (0.37 * s).cos(), s * 1e-6]
            })
            .collect();
        let cloud = PointCloud::new(points).unwrap();
        let mut pair = Pair::new("p", &cloud, &cloud);
        for start in 0..2 {
            pair = pair.pose(crate::Pose::new(format!("start {start}"), srrf_cloud::Rigid::identity()));
        }
        let html = Page::new("t").pair(pair).to_html();
        assert!(html.len() < 6_000_000, "{} bytes", html.len());
        assert!(html.contains("of 130,000 shown"));
    }
}
