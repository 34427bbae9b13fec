//! The fuzzer of poses without coverage: its seeds, and a fixed number of seeded mutations of them, keep its promises.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

#[path = "../../../fuzz/src/lib.rs"]
#[allow(dead_code, reason = "the fuzzers of clouds have a test of their own")]
mod check;

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::pose::{PoseFile, PoseFormat, PoseNote};

/// Mutations of the seeds.
const MUTATIONS: usize = 30_000;

const WORDS: &[&[u8]] = &[
    b"nan",
    b"-1",
    b"0",
    b"1e999",
    b"1e308",
    b"-1e308",
    b",",
    b";",
    b"\r",
    b"\n",
    b" ",
    b"#",
    b"[",
    b"]",
    b"{",
    b"}",
    b"\"",
    b":",
    b"qw",
    b"qx qy qz qw",
    b"translation:\n",
    b"\"target_from_source\":",
    b"null",
    b"0 0 0 1\n",
    b"abstain",
    b"\xef\xbb\xbf",
    b"\xff",
    b"PK\x03\x04",
    b"\x93NUMPY",
];

fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../fuzz/seeds/pose");
    let mut paths: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut seeds: Vec<Vec<u8>> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
    let pose = PoseFile::parse(&seeds[0], None).unwrap().target_from_source;
    seeds.extend(PoseFormat::ALL.iter().map(|format| format.write(&pose, &PoseNote::default()).unwrap()));
    seeds
}

#[test]
fn seeds_keep_the_promises_and_most_are_poses() {
    let seeds = seeds();
    let poses = seeds.iter().filter(|seed| PoseFile::parse(seed, None).is_ok()).count();
    assert_eq!(seeds.len() - poses, 2, "a transposed matrix and one with a scale");
    for seed in &seeds {
        (0..=seed.len()).for_each(|length| check::check_pose(&seed[..length]));
    }
}

#[test]
fn mutations_keep_the_promises() {
    let (seeds, mut rng) = (seeds(), ChaCha8Rng::seed_from_u64(24));
    let mut read = 0;
    for _ in 0..MUTATIONS {
        let mut bytes = seeds[rng.random_range(0..seeds.len())].clone();
        for _ in 0..rng.random_range(1..5) {
            let at = rng.random_range(0..=bytes.len());
            let end = (at + rng.random_range(0..12)).min(bytes.len());
            match rng.random_range(0..4) {
                0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
                1 => drop(bytes.splice(at..end, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
                2 => drop(bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
                _ => bytes.truncate(at.max(8)),
            }
        }
        read += usize::from(PoseFile::parse(&bytes, None).is_ok());
        assert!(catch_unwind(|| check::check_pose(&bytes)).is_ok(), "{}", bytes.escape_ascii());
    }
    assert!(read > MUTATIONS / 100, "only {read} of them are poses");
}
