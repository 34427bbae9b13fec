//! Scenes for alignment: scans of one object or building, each moved to anywhere, with the truth beside them.
//!
//!     scenes turntable OUT [--scans 36] [--points 6000] [--shape 3] [--noise 0.002] [--seed 1]
//!     scenes building  OUT [--row 12] [--points 20000] [--loose 3] [--noise 0.004] [--seed 1]
//!     scenes corridor  OUT [--scans 500] [--points 20000] [--seed 1]
//!
//! OUT gets `scan-0000.ply` (a building: `.pcd`, with the place of the scanner) and so on, in an order that says nothing, and `truth.poses`: name, then the first three rows of
//! `map_from_scan`. `corridor` repeats scans of a building until there are enough.

use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;

use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use srrf_cloud::io::write_cloud;
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::views::{anywhere, seen_from, turntable};

mod building;

use building::Building;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// A scan where it was taken: a name, its points, and the place of the scanner where that is told.
type Taken = (String, PointCloud, Option<[f64; 3]>);

fn main() -> Outcome<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [kind, out, rest @ ..] = &args[..] else {
        return Err("scenes turntable|building|corridor OUT [--NAME VALUE ...]".into());
    };
    let number = |name: &str, default: f64| -> Outcome<f64> {
        match rest.iter().position(|a| *a == format!("--{name}")) {
            Some(at) => Ok(rest.get(at + 1).ok_or("a value is missing")?.parse()?),
            None => Ok(default),
        }
    };
    let seed = number("seed", 1.0)? as u64;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut scans = match kind.as_str() {
        "turntable" => turntable_scans(
            number("scans", 36.0)? as usize,
            number("points", 6000.0)? as usize,
            number("shape", 3.0)? as usize,
            number("noise", 0.002)?,
            &mut rng,
        )?,
        "building" => building_scans(
            number("row", 12.0)? as usize,
            number("points", 20_000.0)? as usize,
            number("loose", 3.0)? as usize,
            number("noise", 0.004)?,
            None,
            seed,
        )?,
        "corridor" => building_scans(
            6,
            number("points", 20_000.0)? as usize,
            3,
            0.004,
            Some(number("scans", 500.0)? as usize),
            seed,
        )?,
        other => return Err(format!("no scene `{other}`").into()),
    };
    scans.shuffle(&mut rng);
    write(Path::new(out), &scans, &mut rng)
}

/// Views of a built-in shape all around it, a third of the way up or down by turns.
fn turntable_scans(
    count: usize,
    points: usize,
    shape: usize,
    noise: f64,
    rng: &mut ChaCha8Rng,
) -> Outcome<Vec<Taken>> {
    let shapes = ProceduralShapes::new(41, 20, None)?;
    let dense = shapes.sample(shape, 60 * points, rng)?;
    let mut scans = Vec::new();
    for (i, mut eye) in turntable(count, 3.5, 1.2).into_iter().enumerate() {
        eye[2] *= if i % 2 == 0 { 1.0 } else { 0.4 };
        let seen = seen_from(&dense, eye, 0.01)?;
        let keep = (points as f64 / seen.len() as f64).min(1.0);
        let mut kept = Vec::new();
        for p in seen.points() {
            if rng.random_range(0.0..1.0) < keep {
                kept.push(p.map(|c| {
                    c + noise * (0..4).map(|_| rng.random_range(-1.0..1.0f64)).sum::<f64>() * 0.866
                }));
            }
        }
        scans.push((format!("view-{i:02}"), PointCloud::new(kept)?, None));
    }
    Ok(scans)
}

/// A scan at each station of a building; at those again, each time a little farther aside, until there are `most`.
fn building_scans(
    row: usize,
    points: usize,
    loose: usize,
    noise: f64,
    most: Option<usize>,
    seed: u64,
) -> Outcome<Vec<Taken>> {
    let building = Building::new(row, loose, seed);
    let stations = &building.stations;
    let rows = ((points as f64 / 2.0).sqrt()).round() as usize;
    (0..most.unwrap_or(stations.len()))
        .map(|i| {
            let station = &stations[i % stations.len()];
            let pass = i / stations.len();
            let aside = 0.25 * pass as f64;
            let far = if pass == 0 { 0.0 } else { 0.2 };
            let eye = [
                station.eye[0] + 0.3 * aside.sin(),
                station.eye[1] - far * aside.cos(),
                station.eye[2] + 0.05 * aside,
            ];
            let scan =
                building.solids.scan(eye, [2 * rows, rows], noise, seed.wrapping_mul(1000) + i as u64)?;
            Ok((format!("{}-{pass}", station.name), scan, Some(eye)))
        })
        .collect()
}

/// Writes the scans, each moved to anywhere, and the truth.
fn write(out: &Path, scans: &[Taken], rng: &mut ChaCha8Rng) -> Outcome<()> {
    fs::create_dir_all(out)?;
    let mut truth = fs::File::create(out.join("truth.poses"))?;
    writeln!(truth, "# file, station, first three rows of map_from_scan")?;
    for (number, (station, scan, eye)) in scans.iter().enumerate() {
        let size = scan.points().iter().flatten().fold(0.0f64, |most, c| most.max(c.abs()));
        let angles = std::array::from_fn(|_| rng.random_range(-3.0..3.0));
        let scan_from_map: Rigid = anywhere(angles, std::array::from_fn(|_| rng.random_range(-size..size)));
        let name = format!("scan-{number:04}.{}", if eye.is_some() { "pcd" } else { "ply" });
        let moved = scan.points().iter().map(|p| scan_from_map.apply(p)).collect();
        let moved = PointCloud::new(moved)?;
        match eye {
            Some(eye) => fs::write(out.join(&name), pcd(&moved, scan_from_map.apply(eye)))?,
            None => write_cloud(&out.join(&name), &moved)?,
        }
        let map_from_scan = scan_from_map.inverse().to_matrix4();
        let numbers: Vec<String> = (0..3)
            .flat_map(|r| (0..4).map(move |c| (r, c)))
            .map(|rc| format!("{:.12e}", map_from_scan[rc]))
            .collect();
        writeln!(truth, "{name} {station} {}", numbers.join(" "))?;
    }
    Ok(())
}

/// PCD, which has a place for that of the scanner.
fn pcd(cloud: &PointCloud, eye: [f64; 3]) -> Vec<u8> {
    let n = cloud.len();
    let [x, y, z] = eye;
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\n\
         HEIGHT 1\nVIEWPOINT {x} {y} {z} 1 0 0 0\nPOINTS {n}\nDATA binary\n"
    )
    .into_bytes();
    cloud.points().iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}
