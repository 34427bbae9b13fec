//! Broken files give an error or a right reading, never a panic, and take bounded memory.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod samples;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use samples::{Sample, samples};
use srrf_cloud::io::{CloudFile, IoError};

/// Counts the bytes in use and their largest number.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn took(bytes: usize) {
    PEAK.fetch_max(NOW.fetch_add(bytes, Ordering::Relaxed) + bytes, Ordering::Relaxed);
}

// SAFETY: all work is the system allocator's.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most bytes in use while `work` runs, above those before it.
fn peak<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let result = work();
    (result, PEAK.load(Ordering::Relaxed).saturating_sub(before))
}

const POINTS: [[f64; 3]; 5] = [
    [1.5, -2.25, 3.125],
    [431_234.567, 4_812_345.678, 90.5],
    [0.1, 0.2, 0.3],
    [7.0, 8.0, 9.0],
    [-1e-9, 1e9, 0.0],
];

fn replaced(bytes: &[u8], from: &str, to: &str) -> Option<Vec<u8>> {
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes())?;
    Some([&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat())
}

/// At least 200 broken variants of a file, each with a name.
fn broken(sample: &Sample, seed: u64) -> Vec<(String, Vec<u8>)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let bytes = &sample.bytes;
    let mut all: Vec<(String, Vec<u8>)> = vec![("empty".into(), vec![])];
    let mut add = |name: String, bytes: Vec<u8>| all.push((name, bytes));
    let head = sample.header.max(64).min(bytes.len());
    for length in (0..head).chain((0..40).map(|part| head + (bytes.len() - head) * part / 40)) {
        add(format!("cut at {length}"), bytes[..length].to_vec());
    }
    (1..12).for_each(|less| {
        add(format!("{less} bytes short"), bytes[..bytes.len().saturating_sub(less)].to_vec())
    });
    let counts = [
        "0",
        "4",
        "6",
        "-1",
        "4294967295",
        "1000000000000000000",
        "18446744073709551615",
        "1e9",
        "nan",
        "5,0",
        "",
    ];
    for (prefix, suffix) in
        [("vertex ", "\n"), ("POINTS ", "\n"), ("WIDTH ", "\n"), ("(", ","), ("OFF\n", " "), ("", "\n")]
    {
        for count in counts {
            let (from, to) = (format!("{prefix}5{suffix}"), format!("{prefix}{count}{suffix}"));
            if let Some(changed) = replaced(bytes, &from, &to) {
                add(format!("count {to:?}"), changed.clone());
                // The other count, so that the two agree.
                if let Some(both) = replaced(&changed, "WIDTH 5\n", &format!("WIDTH {count}\n")) {
                    add(format!("counts {count}"), both);
                }
            }
        }
    }
    // Extreme words where a binary header could have its counts, and at its end.
    let end = bytes.len().saturating_sub(64);
    for at in (0..sample.header.max(80) + 12).step_by(2).chain((end..bytes.len()).step_by(2)) {
        for word in [0u32, 1, 0x7fff_ffff, 0xffff_ffff] {
            let mut changed = bytes.clone();
            if let Some(slot) = changed.get_mut(at..at + 4) {
                slot.copy_from_slice(&word.to_le_bytes());
                add(format!("word {word:#x} at {at}"), changed);
            }
        }
    }
    for (from, to) in [
        ("little_endian", "big_endian"),
        ("big_endian", "little_endian"),
        ("ascii", "binary_little_endian"),
        ("DATA binary\n", "DATA binary_compressed\n"),
        ("DATA binary_compressed", "DATA binary"),
        ("'<f", "'>f"),
        ("double", "float"),
        ("float", "uchar"),
        ("list uchar", "list float"),
        ("list uchar", "list int"),
        (" x", " x y z x"),
        ("end_header", "end_head"),
        ("SIZE 4", "SIZE 3"),
        ("COUNT 1", "COUNT 4294967296"),
        ("COUNT 1", "COUNT 0"),
        ("endsolid", ""),
        ("facet", "facet facet"),
        ("f 1", "f 1000000000000000000"),
        ("f 1", "f -99"),
        ("3 0 0 0", "1000000000000000000 0 0 0"),
    ] {
        if let Some(changed) = replaced(bytes, from, to) {
            add(format!("{from:?} is {to:?}"), changed);
        }
    }
    let all_of = |from: u8, to: &[u8]| -> Vec<u8> {
        bytes.iter().flat_map(|&b| if b == from { to.to_vec() } else { vec![b] }).collect()
    };
    add("locale commas".into(), all_of(b'.', b","));
    add("lone returns".into(), all_of(b'\n', b"\r"));
    add("line ends doubled".into(), all_of(b'\n', b"\n\n"));
    add("tabs".into(), all_of(b' ', b"\t"));
    add("twice".into(), [&bytes[..], bytes].concat());
    add("more bytes".into(), [&bytes[..], &[0xff; 100]].concat());
    add("before it".into(), [b"\xef\xbb\xbf", &bytes[..]].concat());
    for (name, word) in [("nan", f64::NAN), ("infinity", f64::INFINITY), ("huge", 1e308)] {
        let mut changed = bytes.clone();
        let body = sample.header.min(changed.len());
        changed[body..].as_chunks_mut::<8>().0.iter_mut().for_each(|slot| *slot = word.to_le_bytes());
        add(format!("{name} everywhere"), changed);
    }
    let mut swapped = bytes.clone();
    swapped[sample.header.min(bytes.len())..]
        .as_chunks_mut::<4>()
        .0
        .iter_mut()
        .for_each(|slot| slot.reverse());
    add("bytes swapped".into(), swapped);
    for deep in ["(", "[", "{", "property list uchar int n\n", "element e 99999999\n", "# c\n", " "] {
        let at = rng.random_range(0..=sample.header);
        add(format!("deep {deep:?}"), [&bytes[..at], deep.repeat(3000).as_bytes(), &bytes[at..]].concat());
    }
    for length in [1, 16, 100, 1000] {
        let garbage: Vec<u8> = (0..length).map(|_| rng.random()).collect();
        add(format!("garbage of {length}"), garbage.clone());
        add(format!("garbage of {length} behind the header"), [&bytes[..sample.header], &garbage].concat());
    }
    for number in 0..120 {
        let mut changed = bytes.clone();
        for _ in 0..rng.random_range(1..6) {
            let at = rng.random_range(0..changed.len());
            match rng.random_range(0..4) {
                0 => changed[at] = rng.random(),
                1 => changed[at] ^= 1 << rng.random_range(0..8),
                2 => changed.insert(at, rng.random()),
                _ => drop(changed.remove(at)),
            }
        }
        add(format!("mutation {number}"), changed);
    }
    all
}

#[cfg(any(feature = "las", feature = "e57", feature = "parquet"))]
fn written(format: &'static str) -> Sample {
    let cloud = srrf_cloud::PointCloud::new(POINTS.to_vec()).unwrap();
    let mut bytes = Vec::new();
    srrf_cloud::io::write_cloud_to(&mut bytes, format, &cloud).unwrap();
    let points = CloudFile::from_reader(&mut &bytes[..], Some(format)).unwrap().points().unwrap();
    Sample { format, name: format.into(), header: bytes.len().min(400), bytes, points, text: false }
}

/// One test, because it counts the memory of the whole program.
#[test]
fn broken_files_are_errors_and_take_bounded_memory() {
    #[allow(unused_mut)]
    let mut all = samples(&POINTS);
    #[cfg(feature = "las")]
    all.extend([written("las"), written("laz")]);
    #[cfg(feature = "e57")]
    all.push(written("e57"));
    #[cfg(feature = "parquet")]
    all.push(written("parquet"));
    let (mut files, mut errors) = (0, 0);
    for (seed, sample) in all.iter().enumerate() {
        let cases = broken(sample, seed as u64);
        assert!(cases.len() >= 200, "{} cases of {}", cases.len(), sample.name);
        for (case, bytes) in cases {
            for format in [Some(sample.format), None] {
                let read = || CloudFile::from_reader(&mut &bytes[..], format).and_then(|file| file.points());
                let (result, memory) = peak(read);
                // The tables of LAZ's arithmetic coder take 2 MB, however small the file.
                let tables = if sample.format == "laz" { 4 << 20 } else { 0 };
                let bound = 64 * bytes.len() + (1 << 20) + tables;
                assert!(memory <= bound, "{}, {case}: {memory} bytes for {}", sample.name, bytes.len());
                files += 1;
                match result {
                    Ok(points) => assert!(!points.is_empty()),
                    Err(error) => {
                        errors += 1;
                        let message = error.to_string();
                        assert!(message.starts_with("\"-\": ") && message.len() < 700, "{message}");
                        assert!(!matches!(error, IoError::Read { .. }), "{message}");
                    }
                }
            }
        }
        // Not broken at all: other line ends.
        if sample.text {
            let crlf: Vec<u8> = sample
                .bytes
                .iter()
                .flat_map(|&b| if b == b'\n' { vec![b'\r', b'\n'] } else { vec![b] })
                .collect();
            let read = CloudFile::from_reader(&mut &crlf[..], Some(sample.format)).unwrap().points().unwrap();
            assert_eq!(read, sample.points, "{} with CRLF", sample.name);
        }
    }
    assert!(errors * 2 > files, "{errors} errors in {files} readings");
}
