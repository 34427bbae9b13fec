//! Small pictures of clouds as SVG: orthographic views, a few bytes a point.

use std::fmt::Write;

/// Side of a panel, in pixels.
pub(crate) const SIDE: f64 = 150.0;
/// Height of the line of text above a panel.
const LINE: f64 = 16.0;

/// Colour of a source cloud or skeleton as it was given (Okabe and Ito 2008, as all below).
pub(crate) const BLUE: &str = "#0072b2";
/// Colour of a target.
pub(crate) const GREEN: &str = "#009e73";
/// Colour of a source as a pose moved it, and of skeletons.
pub(crate) const RED: &str = "#d55e00";
/// Colour of what is beside the point.
pub(crate) const GREY: &str = "#9a9a9a";

/// What a panel shows of space: the centre, and the length from it to the edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View {
    centre: [f64; 3],
    reach: f64,
}

impl View {
    /// Centred on the mean of `points`, wide enough for all of them.
    pub fn of(points: &[[f64; 3]]) -> Self {
        let count = points.len().max(1) as f64;
        let centre = std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / count);
        let distance = |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>().sqrt();
        Self { centre, reach: points.iter().map(distance).fold(1e-9, f64::max) * 1.05 }
    }

    /// Pixels in a panel, by an orthographic view from above and aside, y up.
    fn pixel(&self, p: &[f64; 3]) -> [f64; 2] {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|c| (p[c] - self.centre[c]) / self.reach);
        let (turn, tilt) = (35f64.to_radians(), 20f64.to_radians());
        let right = x * turn.cos() + z * turn.sin();
        let towards = z * turn.cos() - x * turn.sin();
        let up = y * tilt.cos() - towards * tilt.sin();
        [SIDE / 2.0 * (1.0 + right), SIDE / 2.0 * (1.0 - up)]
    }

    fn scaled(&self, length: f64) -> f64 {
        SIDE / 2.0 * length / self.reach
    }
}

/// A picture of panels in a grid, each with a line of text above.
pub(crate) struct Grid {
    columns: usize,
    rows: usize,
    body: String,
    origin: [f64; 2],
}

impl Grid {
    /// An empty picture.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self { columns, rows, body: String::new(), origin: [0.0; 2] }
    }

    /// Goes on in this panel, under this text.
    pub fn panel(&mut self, column: usize, row: usize, title: &str) {
        self.origin = [SIDE * column as f64, (SIDE + LINE) * row as f64];
        let [x, y] = self.origin;
        let title = crate::report::sheet::escape(title);
        // Writing to a String cannot fail; so below.
        let _ = write!(self.body, "<text x=\"{:.0}\" y=\"{:.0}\">{title}</text>", x + 4.0, y + 12.0);
    }

    /// Points as dots of this width.
    pub fn dots(&mut self, view: &View, points: &[[f64; 3]], colour: &str, width: f64) {
        let _ = write!(self.body, "<path stroke=\"{colour}\" stroke-width=\"{width}\" d=\"");
        for p in points {
            let [x, y] = self.at(view, p);
            let _ = write!(self.body, "M{x:.0} {y:.0}h.1");
        }
        self.body += "\"/>";
    }

    /// A straight line.
    pub fn line(&mut self, view: &View, [a, b]: [&[f64; 3]; 2], colour: &str, opacity: f64) {
        let ([x, y], [u, v]) = (self.at(view, a), self.at(view, b));
        let _ = write!(
            self.body,
            "<path stroke=\"{colour}\" stroke-opacity=\"{opacity:.2}\" d=\"M{x:.1} {y:.1}L{u:.1} {v:.1}\"/>"
        );
    }

    /// A circle of this radius in space.
    pub fn circle(&mut self, view: &View, centre: &[f64; 3], radius: f64, colour: &str) {
        let [x, y] = self.at(view, centre);
        let _ = write!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" fill=\"none\" stroke=\"{colour}\" stroke-opacity=\".5\"/>",
            view.scaled(radius)
        );
    }

    /// The picture.
    pub fn svg(self) -> String {
        let (width, height) = (SIDE * self.columns as f64, (SIDE + LINE) * self.rows as f64);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" stroke-linecap=\"round\">\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <g font-family=\"sans-serif\" font-size=\"11\" fill=\"#222\">{}</g></svg>\n",
            self.body
        )
    }

    fn at(&self, view: &View, p: &[f64; 3]) -> [f64; 2] {
        let [x, y] = view.pixel(p);
        [self.origin[0] + x, self.origin[1] + LINE + y]
    }
}

/// At most `count` of the points, evenly through the list.
pub(crate) fn thinned(points: &[[f64; 3]], count: usize) -> Vec<[f64; 3]> {
    let count = count.min(points.len());
    (0..count).map(|i| points[i * points.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stay_in_their_panel_and_up_is_up() {
        let points: Vec<[f64; 3]> =
            (0..97).map(|i| [f64::from(i).sin(), f64::from(i).cos(), 7.0 + 0.01 * f64::from(i)]).collect();
        let view = View::of(&points);
        for p in &points {
            assert!(view.pixel(p).iter().all(|v| (0.0..=SIDE).contains(v)));
        }
        let [low, high] = [[0.0, 0.0, 7.0], [0.0, 0.5, 7.0]].map(|p| view.pixel(&p)[1]);
        assert!(high < low, "y points up, pixels down");
        let mut grid = Grid::new(2, 1);
        grid.panel(1, 0, "a < b");
        grid.dots(&view, &thinned(&points, 13), RED, 2.0);
        grid.circle(&view, &points[0], 0.2, BLUE);
        grid.line(&view, [&points[0], &points[1]], GREEN, 0.5);
        let svg = grid.svg();
        assert!(svg.contains("a &lt; b") && svg.contains("viewBox=\"0 0 300 166\""), "{svg}");
        assert_eq!(svg.matches('M').count(), 13 + 1);
    }
}
