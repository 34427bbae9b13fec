//! The page of a map.

use srrf_align::{EdgeVerdict, Map, MapEdge, PlacedScan, Scans};
use srrf_args::Failure;
use srrf_args::words::{counted, length};
use srrf_view::{MAP_POINTS, MapLink, MapPage, MapScan};

use super::align_scans::ScanFiles;

/// The page.
///
/// # Errors
/// [`Failure`] for scans that cannot be read again.
pub fn page(map: &Map, scans: &ScanFiles) -> Result<String, Failure> {
    let each = (MAP_POINTS / map.scans.len().max(1)).max(64);
    let mut shown = Vec::with_capacity(map.scans.len());
    for (number, placed) in map.scans.iter().enumerate() {
        let cloud = scans.cloud(number)?;
        let step = cloud.len().div_ceil(each).max(1);
        let points = cloud.points().iter().step_by(step).map(|p| placed.map_from_scan.apply(p)).collect();
        shown.push(MapScan {
            name: scans.name(number),
            component: placed.component,
            points,
            residual: placed.residual,
            facts: scan_facts(placed),
        });
    }
    let links = map
        .edges
        .iter()
        .map(|e| MapLink {
            scans: (e.source, e.target),
            holds: e.verdict == EdgeVerdict::Holds,
            contradicts: e.verdict == EdgeVerdict::Contradicts,
            facts: edge_facts(e),
        })
        .collect();
    let page = MapPage {
        title: format!("Map of {}", counted(map.scans.len(), "scan")),
        facts: map_facts(map),
        warnings: warnings(map, scans),
        scans: shown,
        links,
    };
    Ok(page.to_html())
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn fact(label: &str, text: String) -> (String, String) {
    (label.to_owned(), text)
}

fn map_facts(map: &Map) -> Vec<(String, String)> {
    let mut facts = vec![
        fact("Maps", format!("{}", map.components.iter().filter(|c| c.len() > 1).count())),
        fact("Pairs", format!("{} of {} registered", map.choice.tried, map.choice.possible)),
    ];
    if let Some(worst) = &map.worst_loop {
        facts.push(fact("Worst loop", format!("{:.3}°, {}", worst.angle_deg, length(worst.displacement, 3))));
    }
    if let Some(residual) = map.residual {
        facts.push(fact("Residual", length(residual, 3)));
    }
    facts
}

fn warnings(map: &Map, scans: &ScanFiles) -> Vec<String> {
    let mut all = Vec::new();
    let several = map.components.iter().filter(|c| c.len() > 1).count();
    if several > 1 {
        all.push(format!("The scans make {several} maps: nothing is known of how these lie to each other."));
    }
    for (number, scan) in map.scans.iter().enumerate().filter(|(_, s)| s.abstain) {
        let alone = map.components[scan.component].len() == 1;
        let why = if alone { "nothing holds it" } else { "too little holds it: do not rely on its pose" };
        all.push(format!("{}: {why}.", scans.name(number)));
    }
    all
}

fn scan_facts(s: &PlacedScan) -> Vec<(String, String)> {
    let mut facts =
        vec![fact("Probability", percent(s.probability)), fact("Held by", counted(s.held_by.len(), "pair"))];
    if s.abstain {
        facts.push(fact("Verdict", "abstain".into()));
    }
    if let Some(spread) = s.spread {
        facts.push(fact("Spread", length(spread, 3)));
    }
    if let Some(residual) = s.residual {
        facts.push(fact("Residual", length(residual, 3)));
    }
    if !s.undetermined.is_empty() {
        facts.push(fact("Undetermined", counted(s.undetermined.len(), "motion")));
    }
    facts
}

fn edge_facts(e: &MapEdge) -> Vec<(String, String)> {
    let mut facts = vec![
        fact("Verdict", e.verdict.to_string()),
        fact("Probability", format!("{}; after the loops {}", percent(e.probability), percent(e.posterior))),
        fact("Overlap", format!("{}, {}", percent(e.overlap[0]), percent(e.overlap[1]))),
        fact("Tried for", e.reason.to_string()),
    ];
    if let Some(share) = e.seen_through {
        facts.push(fact("Seen through", percent(share)));
    }
    if let (Some(degrees), Some(off)) = (e.off_deg, e.off) {
        facts.push(fact("Off the map", format!("{degrees:.3}°, {}", length(off, 3))));
    }
    facts
}
