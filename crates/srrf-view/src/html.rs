//! The viewer as a fragment of a page.

use serde::Serialize;

use crate::Pair;
use crate::encode::encode;
use crate::encoded::EncodedPair;

#[derive(Serialize)]
struct ViewerData {
    pairs: Vec<EncodedPair>,
}

/// The element in which [`crate::viewer_script`] shows `pairs`, with their data inside: one pair,
/// or a list to choose from. Without JavaScript it shows the pairs in words.
///
/// `id` must be unique in the page. The height follows the custom property `--sv-height`, by default
/// `min(85vh, 46rem)`; on narrow screens the panel goes below the picture.
///
/// ```
/// # use srrf_cloud::PointCloud;
/// use srrf_view::{Pair, viewer_element, viewer_script};
///
/// # let cloud = PointCloud::new(vec![[0.0; 3], [1.0; 3]])?;
/// let first = viewer_element("first", &[Pair::new("pair 1", &cloud, &cloud)]);
/// let others = viewer_element("others", &[Pair::new("pair 2", &cloud, &cloud), Pair::new("pair 3", &cloud, &cloud)]);
/// let body = format!("<h1>Report</h1>{first}<p>Others:</p>{others}<script>{}</script>", viewer_script());
/// # assert!(body.len() > viewer_script().len());
/// # Ok::<(), srrf_cloud::CloudError>(())
/// ```
pub fn viewer_element(id: &str, pairs: &[Pair<'_>]) -> String {
    let data = ViewerData { pairs: pairs.iter().map(|pair| encode(pair, pairs.len())).collect() };
    let words: String = data
        .pairs
        .iter()
        .map(|pair| {
            let numbers: String = pair
                .numbers
                .iter()
                .map(|n| format!("<li>{}: {}</li>", escape(&n.label), escape(&n.written())))
                .collect();
            let warnings: String =
                pair.warnings.iter().map(|w| format!("<p><strong>{}</strong></p>", escape(w))).collect();
            let (name, text) = (escape(&pair.name), escape(&pair.description));
            format!("<h2>{name}</h2>{warnings}<p>{text}</p><ul>{numbers}</ul>")
        })
        .collect();
    // Strings and numbers only, so this cannot fail; a page without data says so itself.
    let json = serde_json::to_string(&data).unwrap_or_default();
    format!(
        "<section class=\"srrf-view\" id=\"{}\"><noscript><p>The 3D view needs JavaScript.</p>{words}</noscript>\
         <script type=\"application/json\">{}</script></section>",
        escape(id),
        // No string of the data can end the element.
        json.replace('<', "\\u003c")
    )
}

/// Text for HTML, in elements and quoted attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use srrf_cloud::PointCloud;

    use super::*;
    use crate::Number;

    #[test]
    fn names_cannot_break_out() {
        let cloud = PointCloud::new(vec![[1.0, 2.0, 3.0]]).unwrap();
        let evil = "</script><script>alert(1)</script>\"'&";
        let pair = Pair::new(evil, &cloud, &cloud).number(Number::text(evil, evil)).warning(evil).unit(evil);
        let html = viewer_element("v\"><b>", &[pair]);
        assert!(!html.contains("<b>") && !html.contains("<script>"), "{html}");
        assert_eq!(html.matches("</script").count(), 1);
        let json = html.split("application/json\">").nth(1).unwrap().split("</script").next().unwrap();
        let data: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(data["pairs"][0]["name"], evil);
        assert_eq!(data["pairs"][0]["source"]["shown"], 1);
    }
}
