//! A map in words, for people.

use srrf_align::Map;
use srrf_args::words::{count, counted, length};

use super::align_scans::ScanFiles;

/// The map in words and figures.
pub fn summary(map: &Map, scans: &ScanFiles, seconds: f64) -> String {
    let mut lines = Vec::new();
    let mut line = |label: &str, text: String| lines.push(format!("{label:12} {text}"));
    line("scans", counted(map.scans.len(), "scan"));
    let several: Vec<_> = map.components.iter().filter(|c| c.len() > 1).collect();
    let alone: Vec<String> =
        map.components.iter().filter(|c| c.len() == 1).map(|c| scans.name(c[0])).collect();
    let sizes: Vec<String> = several.iter().map(|c| count(c.len())).collect();
    line(
        "maps",
        match several.len() {
            0 => "none: nothing joins any two scans".into(),
            1 => format!("one, of {} scans", sizes[0]),
            n => {
                format!("{n}, of {} scans; nothing is known of how they lie to each other", sizes.join(", "))
            }
        },
    );
    if !alone.is_empty() {
        line("alone", format!("{}: {}", counted(alone.len(), "scan"), shortened(&alone)));
    }
    let doubtful: Vec<String> = (0..map.scans.len())
        .filter(|i| map.scans[*i].abstain && map.components[map.scans[*i].component].len() > 1)
        .map(|i| scans.name(i))
        .collect();
    if !doubtful.is_empty() {
        line("abstain", format!("do not rely on {}", shortened(&doubtful)));
    }
    let c = &map.choice;
    let rounds: Vec<String> =
        c.rounds.iter().filter(|r| r.1 > 0).map(|(why, n)| format!("{n} {why}")).collect();
    line("pairs", format!("{} of {} registered ({})", count(c.tried), count(c.possible), rounds.join(", ")));
    let contradicting: Vec<String> = map
        .edges
        .iter()
        .filter(|e| e.verdict == srrf_align::EdgeVerdict::Contradicts)
        .map(|e| format!("{} to {}", scans.name(e.source), scans.name(e.target)))
        .collect();
    if !contradicting.is_empty() {
        line(
            "contradict",
            format!("{} left out: {}", counted(contradicting.len(), "pair"), shortened(&contradicting)),
        );
    }
    if !map.rivals.is_empty() {
        line(
            "alike",
            format!(
                "pairs that contradict the map agree with each other in {}: places look alike, and the scans of that map abstain; give --initial or --sequence",
                counted(map.rivals.len(), "loop")
            ),
        );
    }
    if map.look_alike && map.components.len() > 1 {
        line(
            "look alike",
            "sure pairs contradict each other or what scanners saw, so that none joins maps without a loop: give --initial or --sequence".into(),
        );
    }
    if let Some(worst) = &map.worst_loop {
        let scale = map.residual.unwrap_or(worst.displacement);
        line(
            "worst loop",
            format!(
                "{:.3}°, {}, of {}",
                worst.angle_deg,
                length(worst.displacement.max(scale * 1e-3), 3),
                counted(worst.edges.len(), "pair")
            ),
        );
    }
    if let Some(residual) = map.residual {
        line("residual", format!("{} between matched surfaces, root mean square", length(residual, 3)));
    }
    line("time", format!("{seconds:.1} s"));
    if let Some((small, large, factor)) = scans.far_apart() {
        line(
            "warning",
            format!("{large} is {factor:.0} times as large as {small}: are all scans in one unit?"),
        );
    }
    lines.join("\n")
}

/// The first few of a list.
pub fn shortened(names: &[String]) -> String {
    const SHOWN: usize = 6;
    let mut text = names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", count(names.len() - SHOWN));
    }
    text
}
