//! Severity curves as SVG: a panel for each corruption, a line for each method.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::protocol::CLEAN;
use crate::quantities::Quantity;
use crate::rows::TableRow;
use crate::summary::{SeverityKey, Summary};

/// Colours that people with any colour vision can tell apart (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0x99, 0x99, 0x99),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0x00, 0x72, 0xB2),
];

const PANEL: (u32, u32) = (260, 200);
const LEGEND_HEIGHT: u32 = 56;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws `quantity` against severity, where severity 0 stands for clean pairs. `None` where no
/// corruption has a severity.
///
/// # Errors
/// The drawing library's reason, in words.
pub(crate) fn svg(quantity: &Quantity, summary: &Summary) -> Result<Option<String>, String> {
    let severities = summary.severities();
    let corruptions: Vec<&str> = summary
        .corruptions()
        .into_iter()
        .filter(|c| {
            summary.rows.iter().any(|r| r.corruption == *c && matches!(r.severity, SeverityKey::One(1..)))
        })
        .collect();
    let (Some(&last), false) = (severities.last(), corruptions.is_empty()) else { return Ok(None) };
    let columns = corruptions.len().min(4);
    let rows = corruptions.len().div_ceil(columns);
    // The legend needs some width even above a single panel.
    let width = (PANEL.0 * columns as u32).max(560);
    let size = (width, LEGEND_HEIGHT + PANEL.1 * rows as u32);

    let clean = summary.corruptions().contains(&CLEAN);
    let first = if clean { 0 } else { severities[0] };
    let curve = |corruption: &str, method: &TableRow| -> Vec<(f64, f64)> {
        let clean = clean.then_some((CLEAN, 0));
        let points = clean.into_iter().chain(severities.iter().map(|&s| (corruption, s)));
        points
            .filter_map(|(corruption, severity)| {
                let row = summary.get(corruption, SeverityKey::One(severity), method)?;
                Some((f64::from(severity), quantity.shown(&row.scores)?))
            })
            .collect()
    };
    let highest = corruptions
        .iter()
        .flat_map(|c| summary.methods().into_iter().flat_map(move |m| curve(c, m)).collect::<Vec<_>>())
        .map(|(_, y)| y)
        .fold(0.0, f64::max);
    let top = if highest > 0.0 { highest * 1.08 } else { 1.0 };
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let (legend, panels) = root.split_vertically(LEGEND_HEIGHT);
        let title = format!("{} against severity{}", quantity.title, if clean { " (0: clean)" } else { "" });
        draw_legend(&legend, &title, &summary.methods()).map_err(|e| e.to_string())?;
        for (panel, corruption) in panels.split_evenly((rows, columns)).iter().zip(&corruptions) {
            let curves: Vec<_> = summary.methods().iter().map(|m| curve(corruption, m)).collect();
            let span = (f64::from(first) - 0.2)..(f64::from(last) + 0.2);
            draw_panel(panel, corruption, span, top, &curves).map_err(|e| e.to_string())?;
        }
        root.present().map_err(|e| e.to_string())?;
    }
    Ok(Some(text))
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw_legend(area: &Area<'_>, title: &str, methods: &[&TableRow]) -> Drawn {
    let text = |size: i32| ("sans-serif", size).into_font().color(&BLACK);
    area.draw(&Text::new(title.to_owned(), (12, 8), text(16)))?;
    let mut x = 12;
    for (index, method) in methods.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        area.draw(&PathElement::new(vec![(x, 40), (x + 18, 40)], colour.stroke_width(2)))?;
        area.draw(&Circle::new((x + 9, 40), 3, colour.filled()))?;
        area.draw(&Text::new(method.to_string(), (x + 23, 34), text(13)))?;
        x += 36 + 7 * method.to_string().chars().count() as i32;
    }
    Ok(())
}

fn draw_panel(
    area: &Area<'_>,
    title: &str,
    span: std::ops::Range<f64>,
    top: f64,
    curves: &[Vec<(f64, f64)>],
) -> Drawn {
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(title, ("sans-serif", 14))
        .x_label_area_size(20)
        .y_label_area_size(38)
        .build_cartesian_2d(span, 0.0..top)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(0xE4, 0xE4, 0xE4))
        .x_labels(6)
        .y_labels(5)
        .x_label_formatter(&|x| if x.fract().abs() < 1e-9 { format!("{x:.0}") } else { String::new() })
        .label_style(("sans-serif", 11))
        .draw()?;
    for (index, points) in curves.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, colour.filled())))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantities::QUANTITIES;
    use crate::summary::tests::outcome;

    #[test]
    fn one_panel_a_corruption_and_one_line_a_method() {
        let summary = Summary::of(&outcome()).unwrap();
        let text = svg(&QUANTITIES[0], &summary).unwrap().unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        assert_eq!(text.matches("cutout").count(), 1);
        // Two methods, at severities 0 (clean), 1 and 3, and two dots of the legend.
        assert_eq!(text.matches("<circle").count(), 2 * 3 + 2);
    }

    #[test]
    fn no_severities_no_curves() {
        let mut summary = Summary::of(&outcome()).unwrap();
        summary.rows.retain(|r| r.corruption == "clean");
        assert_eq!(svg(&QUANTITIES[0], &summary).unwrap(), None);
    }
}
