//! [`MapPage`]: many scans in one frame, with the graph of pairs that holds them, as a whole HTML file.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::html::escape;

const SCRIPT: &str = include_str!("map_page.js");
const STYLE: &str = include_str!("map_page.css");
/// Refuses every request, so that a page cannot reach the network whatever it contains.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

/// Points of all scans together that a page draws.
pub const MAP_POINTS: usize = 240_000;

/// A scan on the page.
#[derive(Debug, Clone)]
pub struct MapScan {
    /// Its name.
    pub name: String,
    /// Number of its map, from 0; maps are shown one at a time.
    pub component: usize,
    /// Points in the frame of the map.
    pub points: Vec<[f64; 3]>,
    /// How well its points lie on the others', unit of the points; none where it lies on none.
    pub residual: Option<f64>,
    /// What is known of it: label and text.
    pub facts: Vec<(String, String)>,
}

/// A pair that was registered.
#[derive(Debug, Clone)]
pub struct MapLink {
    /// Numbers of the two scans.
    pub scans: (usize, usize),
    /// Whether it holds the map.
    pub holds: bool,
    /// Whether it contradicts the map.
    pub contradicts: bool,
    /// What is known of it: label and text.
    pub facts: Vec<(String, String)>,
}

/// One self-contained HTML file that shows a map.
#[derive(Debug, Clone, Default)]
pub struct MapPage {
    /// The title.
    pub title: String,
    /// Figures of the whole: label and text.
    pub facts: Vec<(String, String)>,
    /// What a reader should know, one sentence each.
    pub warnings: Vec<String>,
    /// The scans.
    pub scans: Vec<MapScan>,
    /// The pairs.
    pub links: Vec<MapLink>,
}

#[derive(Serialize)]
struct EncodedScan<'a> {
    name: &'a str,
    component: usize,
    count: usize,
    residual: Option<f64>,
    facts: &'a [(String, String)],
    /// Mean of the points about the middle of the component.
    centre: [f32; 3],
    /// `f32` x y z of each point about the middle of the component, little-endian, in base64.
    points: String,
}

#[derive(Serialize)]
struct EncodedLink<'a> {
    a: usize,
    b: usize,
    holds: bool,
    contradicts: bool,
    facts: &'a [(String, String)],
}

#[derive(Serialize)]
struct EncodedMap<'a> {
    scans: Vec<EncodedScan<'a>>,
    links: Vec<EncodedLink<'a>>,
}

impl MapPage {
    /// The file's text.
    pub fn to_html(&self) -> String {
        let each = (MAP_POINTS / self.scans.len().max(1)).max(64);
        let middles = self.middles();
        let scans = self.scans.iter().map(|scan| encoded(scan, &middles[scan.component], each)).collect();
        let links = self
            .links
            .iter()
            .map(|l| EncodedLink {
                a: l.scans.0,
                b: l.scans.1,
                holds: l.holds,
                contradicts: l.contradicts,
                facts: &l.facts,
            })
            .collect();
        // Strings and numbers only, so this cannot fail; a page without data says so itself.
        let data = serde_json::to_string(&EncodedMap { scans, links }).unwrap_or_default();
        let list = |facts: &[(String, String)]| -> String {
            facts.iter().map(|(l, t)| format!("<dt>{}</dt><dd>{}</dd>", escape(l), escape(t))).collect()
        };
        let warnings: String =
            self.warnings.iter().map(|w| format!("<p class=\"warning\">{}</p>", escape(w))).collect();
        let rows: String = self
            .scans
            .iter()
            .map(|s| format!("<tr><td>{}</td><td><dl>{}</dl></td></tr>", escape(&s.name), list(&s.facts)))
            .collect();
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n\
             <body>\n<header><h1>{title}</h1>{warnings}<dl>{facts}</dl></header>\n<main id=\"map\"></main>\n\
             <noscript><p>The 3D view needs JavaScript.</p><table>{rows}</table></noscript>\n\
             <script type=\"application/json\" id=\"data\">{data}</script>\n<script>{SCRIPT}</script>\n</body>\n</html>\n",
            title = escape(&self.title),
            facts = list(&self.facts),
            // No string of the data can end the element.
            data = data.replace('<', "\\u003c"),
        )
    }

    /// The middle of the box of each component.
    fn middles(&self) -> Vec<[f64; 3]> {
        let count = self.scans.iter().map(|s| s.component + 1).max().unwrap_or(0);
        let mut boxes = vec![([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]); count];
        for scan in &self.scans {
            let (low, high) = &mut boxes[scan.component];
            for p in &scan.points {
                for c in 0..3 {
                    low[c] = low[c].min(p[c]);
                    high[c] = high[c].max(p[c]);
                }
            }
        }
        boxes.iter().map(|(low, high)| std::array::from_fn(|c| 0.5 * low[c] + 0.5 * high[c])).collect()
    }
}

fn encoded<'a>(scan: &'a MapScan, middle: &[f64; 3], most: usize) -> EncodedScan<'a> {
    let step = scan.points.len().div_ceil(most).max(1);
    let local = |p: &[f64; 3]| -> [f32; 3] { std::array::from_fn(|c| (p[c] - middle[c]) as f32) };
    let mut bytes = Vec::new();
    let mut sum = [0.0; 3];
    for p in scan.points.iter().step_by(step) {
        let p = local(p);
        (0..3).for_each(|c| sum[c] += f64::from(p[c]));
        p.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    let count = bytes.len() / 12;
    EncodedScan {
        name: &scan.name,
        component: scan.component,
        count: scan.points.len(),
        residual: scan.residual.filter(|r| r.is_finite()),
        facts: &scan.facts,
        centre: sum.map(|s| (s / count.max(1) as f64) as f32),
        points: STANDARD.encode(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> MapPage {
        let evil = "</script><script>alert(1)</script>".to_owned();
        let scan = |name: &str, component, x: f64| MapScan {
            name: name.into(),
            component,
            points: vec![[x, 0.0, 1.0], [x + 2.0, 4.0, 1.0]],
            residual: Some(f64::NAN),
            facts: vec![("Probability".into(), "98 %".into())],
        };
        MapPage {
            title: "A <map>".into(),
            facts: vec![("Scans".into(), "2".into())],
            warnings: vec!["One scan is alone.".into()],
            scans: vec![scan("a.ply", 0, 5e5), scan(&evil, 1, 0.0)],
            links: vec![MapLink { scans: (0, 1), holds: false, contradicts: true, facts: Vec::new() }],
        }
    }

    #[test]
    fn one_file_without_any_address_and_names_cannot_break_out() {
        let html = page().to_html();
        assert!(html.contains("<title>A &lt;map&gt;</title>") && html.contains("One scan is alone."));
        for address in ["http:", "https:", "src=\"", "url(", "@import"] {
            assert!(!html.contains(address), "{address}");
        }
        assert!(!html.contains("<script>alert"));
        assert_eq!(html.matches("</script>").count(), 2);
    }

    #[test]
    fn points_are_about_the_middle_of_their_map() {
        let html = page().to_html();
        let data = html.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
        let data: serde_json::Value = serde_json::from_str(data).unwrap();
        let bytes = STANDARD.decode(data["scans"][0]["points"].as_str().unwrap()).unwrap();
        let numbers: Vec<f32> = bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(numbers, [-1.0, -2.0, 0.0, 1.0, 2.0, 0.0]);
        assert_eq!(
            (data["scans"][0]["residual"].is_null(), data["links"][0]["contradicts"].as_bool()),
            (true, Some(true))
        );
    }
}
