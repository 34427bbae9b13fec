//! A fuzzer without coverage, for toolchains that cannot build those in `fuzz/`: it mutates the same
//! seeds with a seeded generator for `SRRF_FUZZ_SECONDS` (60) seconds and checks the same promises:
//! `SRRF_FUZZ_SECONDS=600 cargo test -p srrf-cloud --test io_fuzz -- --ignored`.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "tests")]

#[allow(dead_code, reason = "each test uses its part")]
#[path = "../../../fuzz/src/lib.rs"]
mod check;
mod samples;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::PointCloud;
use srrf_cloud::io::{format_names, write_cloud_to};

/// The folder of the seeds, a folder for each parser.
fn folder() -> PathBuf {
    Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../fuzz/seeds")
}

/// Small files of every flavour by parser, with their names.
fn made() -> Vec<(&'static str, String, Vec<u8>)> {
    let points = vec![[1.5, -2.25, 3.125], [431_234.567, 4_812_345.678, 90.5], [0.1, 0.2, 0.3]];
    let mut made = Vec::new();
    for sample in samples::samples(&points) {
        let parser = if sample.format == "csv" { "xyz" } else { sample.format };
        made.push((parser, sample.name, sample.bytes));
    }
    let cloud = PointCloud::new(points).unwrap();
    for format in check::FORMATS.into_iter().chain(check::NEWER).filter(|name| format_names().contains(name))
    {
        let mut bytes = Vec::new();
        if write_cloud_to(&mut bytes, format, &cloud).is_ok() {
            made.push((format, "written".to_owned(), bytes));
        }
    }
    made
}

/// The seeds in the repository, which hold inputs that once led to a bug too.
fn seeds() -> BTreeMap<&'static str, Vec<Vec<u8>>> {
    let mut seeds: BTreeMap<&'static str, Vec<Vec<u8>>> = BTreeMap::new();
    for (parser, _, bytes) in made() {
        seeds.entry(parser).or_default().push(bytes);
    }
    for (parser, files) in &mut seeds {
        let mut paths: Vec<PathBuf> = fs::read_dir(folder().join(parser))
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .collect();
        paths.sort();
        files.extend(paths.iter().map(|path| fs::read(path).unwrap()));
    }
    seeds
}

#[test]
#[ignore = "writes the seeds of the fuzzers"]
fn write_seeds() {
    for (parser, name, bytes) in made() {
        fs::create_dir_all(folder().join(parser)).unwrap();
        fs::write(folder().join(parser).join(name), bytes).unwrap();
    }
}

/// What is in the repository keeps the promises, as it is and cut short.
#[test]
fn seeds_keep_the_promises() {
    for (parser, files) in seeds() {
        for bytes in files {
            check::check(Some(parser), &bytes);
            check::check(None, &bytes);
            (0..bytes.len()).step_by(7).for_each(|length| check::check(Some(parser), &bytes[..length]));
        }
    }
}

/// What the fuzzers in `fuzz/` found new, each input through the function of its fuzzer, without libFuzzer.
#[test]
fn the_corpus_keeps_the_promises() {
    let packed = fs::File::open(folder().join("../corpus.tar.gz")).unwrap();
    let mut corpus = tar::Archive::new(flate2::read::GzDecoder::new(packed));
    let mut replayed: BTreeMap<String, usize> = BTreeMap::new();
    for entry in corpus.entries().unwrap() {
        let mut entry = entry.unwrap();
        if !entry.header().entry_type().is_file() {
            continue;
        }
        let path = entry.path().unwrap().into_owned();
        let fuzzer = path.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
        let format = (fuzzer != "detect").then_some(fuzzer.as_str());
        if format.is_some_and(|format| !format_names().contains(&format)) {
            continue; // not in this build
        }
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        check::check(format, &bytes);
        *replayed.entry(fuzzer).or_default() += 1;
    }
    let expected = check::FORMATS.into_iter().filter(|name| format_names().contains(name)).count() + 1;
    assert_eq!(replayed.len(), expected, "{replayed:?}");
    assert!(replayed.values().all(|&inputs| inputs > 500), "{replayed:?}");
}

/// Words that parsers trip over.
const WORDS: &[&[u8]] = &[
    b"nan",
    b"-1",
    b"0",
    b"1e999",
    b"18446744073709551615",
    b"1000000000000000000",
    b",",
    b";",
    b"\r",
    b"\n",
    b" ",
    b"\t",
    b"\0",
    b"#",
    b"//",
    b"\"",
    b"\\",
    b"x",
    b"list",
    b"property list float double x\n",
    b"element vertex 1\n",
    b"COUNT 0 0 0 0\n",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x80",
    b"(",
    b"3 0 0 0\n",
    b"solid",
    b"-0",
    b"1,5",
    b"DATA ascii\n",
    b"\xef\xbb\xbf",
];

fn mutated(rng: &mut ChaCha8Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[rng.random_range(0..seeds.len())].clone();
    for _ in 0..rng.random_range(1..8) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..24)).min(bytes.len());
        match rng.random_range(0..8) {
            0 if at < bytes.len() => bytes[at] = rng.random(),
            1 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => drop(bytes.drain(at..end)),
            3 => drop(bytes.splice(at..end, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
            4 => drop(bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
            5 => {
                let other = &seeds[rng.random_range(0..seeds.len())];
                let from = rng.random_range(0..=other.len());
                let to = rng.random_range(from..=other.len());
                drop(bytes.splice(at..end, other[from..to].iter().copied()));
            }
            6 => bytes.truncate(at),
            _ => {
                let part = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, part));
            }
        }
        bytes.truncate(1 << 16);
    }
    bytes
}

#[test]
#[ignore = "runs for SRRF_FUZZ_SECONDS"]
fn mutated_files_keep_the_promises() {
    let seconds = std::env::var("SRRF_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(60u64);
    let seeds = seeds();
    let each = Duration::from_secs(seconds) / seeds.len() as u32;
    let mut failures = Vec::new();
    for (number, (format, files)) in seeds.iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(number as u64);
        let (begin, mut runs) = (Instant::now(), 0u64);
        while begin.elapsed() < each {
            let bytes = mutated(&mut rng, files);
            for asked in [Some(*format), None] {
                runs += 1;
                if catch_unwind(|| check::check(asked, &bytes)).is_err() {
                    println!("{format} as {asked:?}: {}", bytes.escape_ascii());
                    failures.push(*format);
                }
            }
            if failures.len() > 20 {
                break;
            }
        }
        println!("{format}: {runs} readings");
    }
    assert!(failures.is_empty(), "{failures:?}");
}
