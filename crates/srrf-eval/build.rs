//! Puts fingerprints of the code that answers pairs into the program, so that answers kept by an older
//! program are not taken for those of this one: one of the methods, and one of the product, which has
//! its own search and calibration on top.

#![allow(clippy::print_stdout, reason = "a build script talks to cargo by printing")]

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Crates whose code a method's answer may depend on, beside this one.
const METHODS: [&str; 5] = ["srrf-cloud", "srrf-model", "srrf-refine", "srrf-classical", "srrf-baselines"];
/// The crate that the rows of the product depend on, beside those.
const PRODUCT: &str = "srrf";
/// What answers no pair: readers and writers of files (an answer is known by its points) and command lines.
const LEFT_OUT: [&str; 2] = ["io", "cli"];

fn main() -> io::Result<()> {
    let crates = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("..");
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for name in METHODS {
        add_crate(&crates, name, &mut hash)?;
    }
    let lock = crates.join("../Cargo.lock");
    println!("cargo::rerun-if-changed={}", lock.display());
    hash.add(&fs::read(lock)?);
    println!("cargo::rustc-env=SRRF_METHODS_CODE={:016x}", hash.0);
    add_crate(&crates, PRODUCT, &mut hash)?;
    println!("cargo::rustc-env=SRRF_PRODUCT_CODE={:016x}", hash.0);
    Ok(())
}

/// The sources of a crate.
fn add_crate(crates: &Path, name: &str, hash: &mut Fnv) -> io::Result<()> {
    let folder = crates.join(name).join("src");
    println!("cargo::rerun-if-changed={}", folder.display());
    add(&folder, hash)
}

/// Every file under `folder`, by name.
fn add(folder: &Path, hash: &mut Fnv) -> io::Result<()> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    entries.sort();
    for path in entries {
        if path.is_dir() {
            if !LEFT_OUT.iter().any(|name| path.ends_with(name)) {
                add(&path, hash)?;
            }
        } else {
            hash.add(path.file_name().unwrap_or_default().as_encoded_bytes());
            hash.add(&fs::read(path)?);
        }
    }
    Ok(())
}

/// FNV-1a, 64 bits: a fingerprint against mistakes, not against attacks.
struct Fnv(u64);

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}
