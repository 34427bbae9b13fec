//! What is written reads back as the same bits, and a moved copy keeps all that it does not move.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod samples;

use nalgebra::Rotation3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use samples::{Sample, odd_values, samples, single};
use srrf_cloud::io::{CloudFile, Kept, write_cloud_to};
use srrf_cloud::{PointCloud, Rigid};

/// Formats that hold any number.
const LOSSLESS: [&str; 10] = ["ply", "pcd", "npy", "npz", "off", "obj", "xyz", "pts", "vtk", "vtp"];

fn open(bytes: &[u8], format: &str) -> CloudFile {
    CloudFile::from_reader(&mut &bytes[..], Some(format)).unwrap()
}

fn same_bits(a: &[[f64; 3]], b: &[[f64; 3]]) -> bool {
    a.len() == b.len() && a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Clouds of odd values, of any bits, and of map coordinates.
fn clouds(seed: u64) -> Vec<Vec<[f64; 3]>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let odd = odd_values();
    let mut pick = |from: &[f64]| from[rng.random_range(0..from.len())];
    let odd_points = (0..37).map(|_| [pick(&odd), pick(&odd), pick(&odd)]).collect();
    let mut any = || loop {
        let value = f64::from_bits(rng.random());
        if value.is_finite() {
            break value;
        }
    };
    let any_points = (0..41).map(|_| [any(), any(), any()]).collect();
    let map_points = (0..43)
        .map(|_| {
            let [a, b, c]: [f64; 3] = rng.random();
            [431_000.0 + 1000.0 * a, 4_812_000.0 + 1000.0 * b, 100.0 * c]
        })
        .collect();
    vec![odd_points, any_points, map_points, vec![[0.1, -0.0, 5e-324]]]
}

#[test]
fn what_is_written_reads_back_as_the_same_bits() {
    for seed in 0..20 {
        for points in clouds(seed) {
            let cloud = PointCloud::new(points.clone()).unwrap();
            for format in LOSSLESS
                .into_iter()
                .chain(cfg!(feature = "e57").then_some("e57"))
                .chain(cfg!(feature = "parquet").then_some("parquet"))
            {
                let mut bytes = Vec::new();
                write_cloud_to(&mut bytes, format, &cloud).unwrap();
                assert!(same_bits(&open(&bytes, format).points().unwrap(), &points), "{format}, seed {seed}");
            }
        }
    }
}

#[test]
fn single_precision_is_enough_or_refused() {
    for points in clouds(7) {
        let rounded = single(&points);
        let Ok(cloud) = PointCloud::new(rounded) else { continue };
        let mut bytes = Vec::new();
        write_cloud_to(&mut bytes, "kitti", &cloud).unwrap();
        assert!(same_bits(&open(&bytes, "kitti").points().unwrap(), cloud.points()));
    }
    let map = PointCloud::new(clouds(7).remove(2)).unwrap();
    let error = write_cloud_to(&mut Vec::new(), "kitti", &map).unwrap_err().to_string();
    assert!(error.contains("single precision") && error.contains("write .ply"), "{error}");
}

/// STL holds each corner once, 0 and -0 as the same.
fn without_repeats(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut kept: Vec<[f64; 3]> = Vec::new();
    points.iter().for_each(|p| {
        if !kept.contains(p) {
            kept.push(*p);
        }
    });
    kept
}

/// All samples of formats that are written too.
fn written(points: &[[f64; 3]]) -> impl Iterator<Item = Sample> {
    samples(points).into_iter().filter(|sample| sample.format != "mcap")
}

fn expected(sample: &Sample) -> Vec<[f64; 3]> {
    if sample.format == "stl" { without_repeats(&sample.points) } else { sample.points.clone() }
}

#[test]
fn every_flavour_is_read_exactly_and_recognised() {
    for seed in 0..5 {
        for points in clouds(seed) {
            for sample in samples(&points) {
                let name = &sample.name;
                let read = open(&sample.bytes, sample.format).points().unwrap();
                assert!(same_bits(&read, &expected(&sample)), "{name}, seed {seed}");
                if sample.format != "kitti" {
                    let found = CloudFile::from_reader(&mut &sample.bytes[..], None).unwrap();
                    assert_eq!(found.format(), open(&sample.bytes, sample.format).format(), "{name}");
                }
            }
        }
    }
}

#[test]
fn a_copy_that_does_not_move_is_the_same_file() {
    for points in clouds(3) {
        for sample in written(&points) {
            let mut copy = Vec::new();
            let kept =
                open(&sample.bytes, sample.format).write_transformed_to(&mut copy, None, &Rigid::identity());
            assert_eq!(kept.unwrap(), Kept::default());
            if sample.format == "npz" {
                assert!(same_bits(&open(&copy, "npz").points().unwrap(), &sample.points), "{}", sample.name);
            } else {
                assert_eq!(copy, sample.bytes, "{}", sample.name);
            }
        }
    }
}

#[test]
fn a_moved_copy_is_exact() {
    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.3, -1.0, 2.0).into_inner(),
        translation: [500_000.0, -20.0, 0.125].into(),
    };
    let map = clouds(5).remove(2);
    for sample in written(&map) {
        let file = open(&sample.bytes, sample.format);
        let wanted: Vec<[f64; 3]> = expected(&sample).iter().map(|p| motion.apply(p)).collect();
        let mut copy = Vec::new();
        let kept = file.write_transformed_to(&mut copy, None, &motion);
        if sample.name == "kitti" || sample.name == "stl-binary" {
            assert!(kept.unwrap_err().to_string().contains("single precision"), "{}", sample.name);
            continue;
        }
        assert!(kept.unwrap().is_everything());
        // Single precision that was no more exact before stays.
        let single = file.contents().unwrap().single;
        let close = |read: &[[f64; 3]]| {
            let far = |(a, b): (&f64, &f64)| (a - b).abs() > 0.5;
            single
                && read.len() == wanted.len()
                && !read.iter().flatten().zip(wanted.iter().flatten()).any(far)
        };
        let read = open(&copy, sample.format).points().unwrap();
        assert!(same_bits(&read, &wanted) || close(&read), "{}", sample.name);
        // Another format gets the points.
        let mut other = Vec::new();
        let format = if sample.format == "ply" { "pcd" } else { "ply" };
        file.write_transformed_to(&mut other, Some(format), &motion).unwrap();
        let read = open(&other, format).points().unwrap();
        assert!(same_bits(&read, &wanted) || close(&read), "{}", sample.name);
    }
}
