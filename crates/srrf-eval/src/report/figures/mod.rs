//! The pictures of the report.

mod canvas;
mod skeleton;

pub(crate) use skeleton::{agreement, samplings, weights};

use canvas::{BLUE, GREEN, Grid, RED, View, thinned};
use srrf_cloud::Rigid;
use srrf_corrupt::Severity;

use crate::EvalError;
use crate::answers::RunOutcome;
use crate::pairs::PairSource;
use crate::quantities::QUANTITIES;
use crate::report::curves;
use crate::report::document::Picture;
use crate::rows::TableRow;
use crate::summary::Summary;

/// Points drawn of each cloud.
const DRAWN: usize = 220;

/// Most lines of a panel that can be told apart.
const MOST_CURVES: usize = 8;

/// Rows that curves show, the most important first.
const CURVES: [TableRow; 13] = [
    TableRow::Oracle,
    TableRow::ICP,
    TableRow::SRRF,
    TableRow::SRRF_REFINE,
    TableRow::SRRF_REGISTER,
    TableRow::RGM,
    TableRow::DCP,
    TableRow::FPFH_RANSAC,
    TableRow::method("panet"),
    TableRow::method("equi-gspr"),
    TableRow::method("pointnetlk"),
    TableRow::SRRF_DENSE,
    TableRow::SRRF_SKELETON,
];

/// Error against severity, one picture for each principal quantity.
///
/// # Errors
/// [`EvalError::Picture`] with the drawing library's reason.
pub(crate) fn severity_curves(summary: &Summary) -> Result<Vec<Picture>, EvalError> {
    let methods = summary.methods();
    let shown: Vec<TableRow> =
        CURVES.into_iter().filter(|m| methods.contains(&m)).take(MOST_CURVES).collect();
    let mut summary = summary.clone();
    summary.rows.retain(|row| shown.contains(&row.method));
    let mut figures = Vec::new();
    for quantity in QUANTITIES.iter().filter(|q| q.principal) {
        let file = format!("severity-{}.svg", quantity.key.replace('_', "-"));
        let svg = curves::svg(quantity, &summary)
            .map_err(|problem| EvalError::Picture { path: file.clone().into(), problem })?;
        let caption = format!("{} against severity", quantity.title);
        figures.extend(svg.map(|svg| Picture { file, caption, svg }));
    }
    Ok(figures)
}

/// The corruptions at severities 1, 3 and 5 on one shape: the paper's figures 2 to 4.
///
/// # Errors
/// [`EvalError`] where a pair cannot be made.
pub(crate) fn corruption_sheet(pairs: &dyn PairSource, item: usize) -> Result<Option<Picture>, EvalError> {
    let shown = [Severity::ALL[0], Severity::ALL[2], Severity::ALL[4]].map(Severity::get);
    let groups = pairs.groups();
    let clean = pairs.pair(0, item)?.pair;
    let view = View::of(clean.source.points());
    let mut names: Vec<&str> = Vec::new();
    let mut panels = Vec::new();
    for (index, group) in groups.iter().enumerate() {
        let Some(column) = shown.iter().position(|s| *s == group.severity) else { continue };
        if !names.contains(&group.corruption.as_str()) {
            names.push(&group.corruption);
        }
        panels.push((index, names.len() - 1, column));
    }
    if names.is_empty() {
        return Ok(None);
    }
    let half = names.len().div_ceil(2);
    let mut grid = Grid::new(6, half);
    for (index, row, column) in panels {
        let pair = pairs.pair(index, item)?.pair;
        let (column, row) = (column + 3 * (row / half), row % half);
        grid.panel(column, row, &format!("{}, s = {}", groups[index].corruption, groups[index].severity));
        grid.dots(&view, &thinned(pair.source.points(), 2 * DRAWN), BLUE, 1.4);
    }
    Ok(Some(Picture {
        file: "corruptions.svg".into(),
        caption: format!("The corruptions at severities 1, 3 and 5 on {} (figures 2 to 4)", clean.id),
        svg: grid.svg(),
    }))
}

/// One pair of each corruption at severity 3 as given, and as the rows `shown` register it.
///
/// # Errors
/// [`EvalError`] where a pair cannot be made.
pub(crate) fn registrations(
    pairs: &dyn PairSource,
    outcome: &RunOutcome,
    shown: &[TableRow],
) -> Result<Option<Picture>, EvalError> {
    let rows: Vec<usize> = shown.iter().filter_map(|s| outcome.rows.iter().position(|r| r == s)).collect();
    let groups: Vec<usize> =
        (0..outcome.groups.len()).filter(|&g| [0, 3].contains(&outcome.groups[g].severity)).collect();
    if rows.is_empty() || groups.is_empty() {
        return Ok(None);
    }
    let (half, columns) = (groups.len().div_ceil(2), rows.len() + 1);
    let mut grid = Grid::new(2 * columns, half);
    for (place, &group) in groups.iter().enumerate() {
        // Another shape in each row.
        let count = outcome.groups[group].pairs;
        let item = (place * 7 + 3) % count;
        let Some(record) = outcome.records.iter().find(|r| r.group == group && r.item == item) else {
            continue;
        };
        let pair = pairs.pair(group, item)?.pair;
        let (left, row) = (columns * (place / half), place % half);
        let all = [pair.source.points(), pair.target.points()].concat();
        panel(
            &mut grid,
            [left, row],
            &View::of(&all),
            &pair,
            &Rigid::identity(),
            &outcome.groups[group].corruption,
        );
        for (at, &method) in rows.iter().enumerate() {
            let answer = &record.answers[method];
            let pose = answer.pose.unwrap_or_else(Rigid::identity);
            let title = format!("{}: {:.1} deg", outcome.rows[method], answer.error.rotation_deg);
            let moved = pair.source.transformed(&pose);
            let view = View::of(&[moved.points(), pair.target.points()].concat());
            panel(&mut grid, [left + 1 + at, row], &view, &pair, &pose, &title);
        }
    }
    Ok(Some(Picture {
        file: "registrations.svg".into(),
        caption: format!(
            "A pair of each corruption at severity 3, as given and as {} left it: source blue, target green, moved \
             source red; the angle is the rotation error",
            shown.iter().map(TableRow::to_string).collect::<Vec<_>>().join(", ")
        ),
        svg: grid.svg(),
    }))
}

/// Source and target under a pose; the source is blue where it has not been moved.
fn panel(
    grid: &mut Grid,
    [column, row]: [usize; 2],
    view: &View,
    pair: &srrf_corrupt::Pair,
    pose: &Rigid,
    title: &str,
) {
    let colour = if *pose == Rigid::identity() { BLUE } else { RED };
    grid.panel(column, row, title);
    grid.dots(view, &thinned(pair.target.points(), DRAWN), GREEN, 1.6);
    grid.dots(view, &thinned(pair.source.transformed(pose).points(), DRAWN), colour, 1.6);
}

/// What a row makes of the pairs of each group of table 4: the paper's figure 9.
///
/// # Errors
/// [`EvalError`] where a pair cannot be made.
pub(crate) fn sampled_registrations(
    pairs: &dyn PairSource,
    outcome: &RunOutcome,
    row: &TableRow,
    item: usize,
) -> Result<Option<Picture>, EvalError> {
    let Some(method) = outcome.rows.iter().position(|r| r == row) else { return Ok(None) };
    let mut grid = Grid::new(4, outcome.groups.len().div_ceil(4));
    for (group, named) in outcome.groups.iter().enumerate() {
        let Some(record) = outcome.records.iter().find(|r| r.group == group && r.item == item) else {
            continue;
        };
        let pair = pairs.pair(group, item)?.pair;
        let pose = record.answers[method].pose.unwrap_or_else(Rigid::identity);
        let view = View::of(&[pair.source.points(), pair.target.points()].concat());
        grid.panel(group % 4, group / 4, &named.corruption);
        grid.dots(&view, &thinned(pair.source.points(), DRAWN), BLUE, 2.2);
        grid.dots(&view, &thinned(pair.target.points(), DRAWN), GREEN, 2.6);
        grid.dots(&view, &thinned(pair.source.transformed(&pose).points(), DRAWN), RED, 1.6);
    }
    Ok(Some(Picture {
        file: "sampled-registrations.svg".into(),
        caption: format!(
            "{row} on samples (figure 9): source blue, target green, source under the pose found red"
        ),
        svg: grid.svg(),
    }))
}

#[cfg(test)]
mod tests {
    use srrf_corrupt::{CorruptionKind, PairConfig};

    use super::*;
    use crate::data;
    use crate::protocol::{Protocol, SynthesizedPairs};
    use crate::run::Run;

    #[test]
    fn every_panel_is_drawn() {
        let protocol = Protocol {
            clean: true,
            corruptions: vec![CorruptionKind::Cutout, CorruptionKind::Uniform],
            mixtures: vec![],
            severities: Severity::ALL.to_vec(),
            shapes: 3,
            seed: 3,
            pair: PairConfig { points: 65, ..PairConfig::default() },
            crop: None,
            dcp_poses: false,
            spread: false,
        };
        let pairs = SynthesizedPairs::new(data::procedural(3).unwrap(), protocol).unwrap();
        let run = Run {
            pairs: &pairs,
            methods: &[],
            transforms: vec![],
            rows: vec![TableRow::Oracle],
            threads: 1,
            cache: None,
        };
        let outcome = run.execute(&mut |_, _| {}).unwrap();
        // Two corruptions at three severities.
        let sheet = corruption_sheet(&pairs, 1).unwrap().unwrap();
        assert_eq!(sheet.svg.matches("<path").count(), 6);
        // Clean and two corruptions, as given and by the oracle; two clouds each.
        let drawn = registrations(&pairs, &outcome, &[TableRow::Oracle, TableRow::DCP]).unwrap().unwrap();
        assert_eq!(drawn.svg.matches("<path").count(), 3 * 2 * 2);
        assert!(drawn.svg.contains("oracle: 0.0 deg"), "exact on clean pairs");
        assert!(registrations(&pairs, &outcome, &[TableRow::DCP]).unwrap().is_none());
        let curves = severity_curves(&Summary::of(&outcome).unwrap()).unwrap();
        assert_eq!(curves[0].file, "severity-rmse-r.svg");
    }
}
