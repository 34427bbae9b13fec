//! The scans of a file that holds several, in words and in JSON.

use std::path::Path;

use serde_json::{Value, json};
use srrf_args::files::is_stream;
use srrf_args::words::{count, points, vector};
use srrf_cloud::io::{CloudFile, ReadOptions, ScanEntry};

/// The scans of a file, if it holds several.
pub fn several(file: &CloudFile) -> Vec<ScanEntry> {
    let scans = if file.holds_scans() { file.scans().unwrap_or_default() } else { Vec::new() };
    if scans.len() > 1 { scans } else { Vec::new() }
}

/// A file and its scans, where it holds several and none of them is asked for: they can be listed even if they are no
/// one cloud.
pub fn of_path(path: &Path, options: ReadOptions) -> Option<(CloudFile, Vec<ScanEntry>)> {
    if is_stream(path) {
        return None;
    }
    let file = CloudFile::open_with(path, options).ok()?;
    if file.options().scan.or(file.options().message).is_some() {
        return None;
    }
    let scans = several(&file);
    (!scans.is_empty()).then_some((file, scans))
}

/// A line for each scan.
pub fn in_words(scans: &[ScanEntry]) -> Vec<String> {
    let line = |(index, scan): (usize, &ScanEntry)| {
        let name = if scan.name.is_empty() { String::new() } else { format!(" {}", scan.name) };
        let place = scan.pose.as_ref().map_or(String::new(), |pose| {
            format!(", scanner at {}", vector(pose.translation.into(), 0.001, 3))
        });
        let size = usize::try_from(scan.points).unwrap_or(usize::MAX);
        format!("#{}{name}: {}{place}", index + 1, points(size))
    };
    let mut lines: Vec<String> = scans.iter().take(MOST).enumerate().map(line).collect();
    if scans.len() > MOST {
        lines.push(format!("and {} more", count(scans.len() - MOST)));
    }
    lines
}

/// Scans that are listed in words; JSON has them all.
const MOST: usize = 100;

/// A list with an object for each scan.
pub fn to_json(scans: &[ScanEntry]) -> Value {
    let object = |(index, scan): (usize, &ScanEntry)| {
        let pose = scan.pose.as_ref().map(|pose| {
            (0..4)
                .map(|row| {
                    (0..4)
                        .map(|column| match (row, column) {
                            (3, 3) => 1.0,
                            (3, _) => 0.0,
                            (row, 3) => pose.translation[row],
                            place => pose.rotation[place],
                        })
                        .collect::<Vec<f64>>()
                })
                .collect::<Vec<_>>()
        });
        json!({ "number": index + 1, "name": scan.name, "points": scan.points, "file_from_scan": pose })
    };
    scans.iter().enumerate().map(object).collect()
}
