//! Poses of many scans in files: JSON of our own, TUM, KITTI.

use std::fmt::Write;

use nalgebra::Matrix6;
use serde_json::{Value, json};
use srrf_align::{Map, MapEdge, PlacedScan};
use srrf_args::Failure;
use srrf_cloud::Rigid;
use srrf_cloud::pose::PoseFile;

use super::align_scans::ScanFiles;

/// Name of the JSON.
pub const SCHEMA: &str = "srrf-align";
/// Its version.
pub const SCHEMA_VERSION: u64 = 1;

/// 4 rows of 4.
pub fn matrix(pose: &Rigid) -> [[f64; 4]; 4] {
    let m = pose.to_matrix4();
    std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]))
}

/// A pose from 4 rows of 4.
///
/// # Errors
/// What is wrong with it.
pub fn rigid_of(rows: &[[f64; 4]; 4]) -> Result<Rigid, String> {
    let text: String =
        rows.iter().map(|row| row.iter().map(|v| format!("{v:e} ")).collect::<String>() + "\n").collect();
    let read = PoseFile::parse(text.as_bytes(), None).map_err(|e| e.to_string())?;
    Ok(read.target_from_source)
}

/// Everything that is known, as JSON.
pub fn to_json(map: &Map, scans: &ScanFiles, options: &str, seconds: f64) -> Value {
    let components: Vec<Value> = map
        .components
        .iter()
        .map(|members| json!({ "scans": members, "anchor": members[0], "placed": members.len() > 1 }))
        .collect();
    json!({
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "scans": (0..map.scans.len()).map(|i| scan(i, &map.scans[i], scans)).collect::<Vec<_>>(),
        "components": components,
        "edges": map.edges.iter().enumerate().map(|(i, e)| edge(i, e)).collect::<Vec<_>>(),
        "contradictions": map.edges.iter().enumerate()
            .filter(|(_, e)| e.verdict == srrf_align::EdgeVerdict::Contradicts)
            .map(|(i, _)| i).collect::<Vec<_>>(),
        "rivals": map.rivals,
        "look_alike": map.look_alike,
        "worst_loop": map.worst_loop,
        "residual": map.residual,
        "pairs": {
            "possible": map.choice.possible,
            "compared": map.choice.compared,
            "tried": map.choice.tried,
            "seconds": map.choice.pair_seconds,
            "rounds": map.choice.rounds.iter().map(|(why, n)| json!({ "why": why, "pairs": n })).collect::<Vec<_>>(),
        },
        "options": options,
        "seconds": seconds,
    })
}

fn scan(number: usize, placed: &PlacedScan, scans: &ScanFiles) -> Value {
    let (points, dropped) = scans.points(number);
    json!({
        "number": number,
        "name": scans.name(number),
        "hash": scans.hash(number),
        "points": points,
        "dropped_points": dropped,
        "component": placed.component,
        "map_from_scan": matrix(&placed.map_from_scan),
        "quaternion_xyzw": placed.map_from_scan.quaternion_xyzw(),
        "translation": placed.map_from_scan.translation.as_slice(),
        "probability": placed.probability,
        "abstain": placed.abstain,
        "held_by": placed.held_by,
        "spread": placed.spread,
        "covariance": placed.covariance.as_ref().map(rows),
        "covariance_order": "rotation x y z (radians), translation x y z, in the axes of the map about `centre`",
        "centre": placed.centre.as_slice(),
        "undetermined": placed.undetermined,
        "residual": placed.residual,
    })
}

fn edge(number: usize, e: &MapEdge) -> Value {
    json!({
        "number": number,
        "source": e.source,
        "target": e.target,
        "reason": e.reason,
        "target_from_source": e.target_from_source.as_ref().map(matrix),
        "probability": e.probability,
        "abstain": e.abstain,
        "probability_after_loops": e.posterior,
        "verdict": e.verdict,
        "overlap_source": e.overlap[0],
        "overlap_target": e.overlap[1],
        "seen_through": e.seen_through,
        "off_deg": e.off_deg,
        "off": e.off,
    })
}

fn rows(m: &Matrix6<f64>) -> Vec<Vec<f64>> {
    (0..6).map(|r| m.row(r).iter().copied().collect()).collect()
}

/// The largest map as TUM: the number of the scan stands for the time.
pub fn to_tum(map: &Map, scans: &ScanFiles) -> String {
    let mut text = String::from("# number of the scan from 0, tx ty tz, qx qy qz qw of map_from_scan\n");
    for &i in &map.components[0] {
        let pose = &map.scans[i].map_from_scan;
        let (t, q) = (&pose.translation, pose.quaternion_xyzw());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "# {}", scans.name(i));
        let _ =
            writeln!(text, "{i} {:e} {:e} {:e} {:e} {:e} {:e} {:e}", t.x, t.y, t.z, q[0], q[1], q[2], q[3]);
    }
    text
}

/// All poses as KITTI, which knows one map.
///
/// # Errors
/// [`Failure::failed`] for several maps.
pub fn to_kitti(map: &Map) -> Result<String, Failure> {
    if map.components.len() > 1 {
        return Err(Failure::failed(format!(
            "--kitti holds the poses of one map, and the scans make {} (scans that nothing joins are one each): use --output or --tum",
            map.components.len()
        )));
    }
    let mut text = String::new();
    for scan in &map.scans {
        let m = scan.map_from_scan.to_matrix4();
        let numbers: Vec<String> = (0..12).map(|k| format!("{:e}", m[(k / 4, k % 4)])).collect();
        let _ = writeln!(text, "{}", numbers.join(" "));
    }
    Ok(text)
}
