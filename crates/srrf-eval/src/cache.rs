//! [`Cache`]: answers that were computed before, so that a run goes on after a kill and a second run
//! of the same command computes nothing.
//!
//! One file, `answers.jsonl`, to which a line is appended for each answer: the key, a checksum, the
//! answer as JSON, with spaces between. An answer whose checksum is another one is computed anew. A key is a hash of all that an answer depends on: the code of the method, the
//! device, the method with its weights and settings, the two clouds and the true pose. A line that a
//! kill tore is ignored, and so is one that another version wrote.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use sha2::{Digest, Sha256};
use srrf_corrupt::Pair;

use crate::EvalError;
use crate::kept::KeptAnswer;
use crate::methods::ReadyMethod;

/// Changes with the meaning of keys and lines.
const FORMAT: &str = "srrf-eval answers 3";
/// Name of the file in the folder.
const FILE: &str = "answers.jsonl";
/// Hexadecimal digits of a key: 128 bits.
const KEY_DIGITS: usize = 32;

/// Hexadecimal digits of the checksum of an answer: 32 bits of its SHA-256.
const SUM_DIGITS: usize = 8;

/// Names an answer.
type Key = [u8; KEY_DIGITS / 2];

/// Answers on disk. Safe to share between threads; a kill at any moment loses at most what was being
/// computed.
#[derive(Debug)]
pub struct Cache {
    path: PathBuf,
    /// What all keys have in common.
    common: Sha256,
    lines: Mutex<KeptLines>,
}

#[derive(Debug)]
struct KeptLines {
    file: File,
    /// Start and length of the JSON of each key.
    index: HashMap<Key, (u64, usize)>,
    reused: usize,
}

/// The part of a key that belongs to a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PairHash([u8; 32]);

impl Cache {
    /// Opens the cache in `folder`, which is made where it is missing. `device` is where tensors live.
    ///
    /// # Errors
    /// [`EvalError::Cache`] where the folder cannot be used.
    pub fn open(folder: &Path, device: &str) -> Result<Self, EvalError> {
        let path = folder.join(FILE);
        let lines = open(folder, &path).map_err(|source| EvalError::Cache { path: path.clone(), source })?;
        let common = Sha256::new().chain_update(FORMAT).chain_update(part(device.as_bytes()));
        Ok(Self { path, common, lines: Mutex::new(lines) })
    }

    /// Number of answers that were taken from the cache so far.
    pub fn reused(&self) -> usize {
        self.lock().reused
    }

    /// The hash of the clouds and the true pose.
    pub(crate) fn pair_hash(pair: &Pair) -> PairHash {
        let mut hash = Sha256::new();
        for cloud in [&pair.source, &pair.target] {
            hash.update((cloud.len() as u64).to_le_bytes());
            cloud.points().as_flattened().iter().for_each(|v| hash.update(v.to_le_bytes()));
        }
        let truth = &pair.target_from_source;
        truth.rotation.iter().chain(&truth.translation).for_each(|v| hash.update(v.to_le_bytes()));
        PairHash(hash.finalize().into())
    }

    /// The answer of `method`, if it was computed before.
    pub(crate) fn get(&self, method: &ReadyMethod, pair: &PairHash) -> Option<KeptAnswer> {
        let key = self.key(method, pair);
        let mut lines = self.lock();
        let &(start, length) = lines.index.get(&key)?;
        let mut json = vec![0; length];
        lines.file.seek(SeekFrom::Start(start)).ok()?;
        lines.file.read_exact(&mut json).ok()?;
        let (sum, json) = json.split_at_checked(SUM_DIGITS + 1)?;
        if sum.trim_ascii_end() != checksum(json).as_bytes() {
            return None;
        }
        let found = serde_json::from_slice(json).ok()?;
        lines.reused += 1;
        Some(found)
    }

    /// Keeps an answer.
    ///
    /// # Errors
    /// [`EvalError::Cache`] where it cannot be written.
    pub(crate) fn put(
        &self,
        method: &ReadyMethod,
        pair: &PairHash,
        found: &KeptAnswer,
    ) -> Result<(), EvalError> {
        let key = self.key(method, pair);
        let written = serde_json::to_string(found).map_err(io::Error::from).and_then(|json| {
            let json = format!("{} {json}", checksum(json.as_bytes()));
            let line = format!("{} {json}\n", hex(&key));
            let mut lines = self.lock();
            // One call, so that a line of another process cannot get into this one.
            lines.file.write_all(line.as_bytes())?;
            let end = lines.file.stream_position()?;
            lines.index.insert(key, (end - json.len() as u64 - 1, json.len()));
            Ok(())
        });
        written.map_err(|source| EvalError::Cache { path: self.path.clone(), source })
    }

    fn key(&self, method: &ReadyMethod, pair: &PairHash) -> Key {
        let hash = self
            .common
            .clone()
            .chain_update(method.code)
            .chain_update(part(method.register.name().as_bytes()))
            .chain_update(part(method.weights.as_deref().unwrap_or_default().as_bytes()))
            .chain_update(part(method.settings.as_bytes()))
            .chain_update(pair.0)
            .finalize();
        std::array::from_fn(|i| hash[i])
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, KeptLines> {
        // A thread that panicked left whole lines behind: each is written by one call.
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bytes after their number, so that two parts cannot be taken for two others.
fn part(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u64).to_le_bytes(), bytes].concat()
}

fn open(folder: &Path, path: &Path) -> io::Result<KeptLines> {
    fs::create_dir_all(folder)?;
    let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
    let (mut index, mut start, mut line) = (HashMap::new(), 0u64, Vec::new());
    let mut reader = BufReader::new(&file);
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line)? as u64;
        if length == 0 {
            break;
        }
        let head = KEY_DIGITS + 1;
        let whole = line.last() == Some(&b'\n') && line.len() > head + 1;
        if let Some(key) = line.get(..KEY_DIGITS).filter(|_| whole).and_then(unhex) {
            index.insert(key, (start + head as u64, line.len() - head - 1));
        }
        start += length;
    }
    if start > 0 {
        // What is appended next must not go on in a torn line.
        file.seek(SeekFrom::Start(start - 1))?;
        let mut last = [0];
        file.read_exact(&mut last)?;
        if last != [b'\n'] {
            file.write_all(b"\n")?;
        }
    }
    Ok(KeptLines { file, index, reused: 0 })
}

fn checksum(json: &[u8]) -> String {
    Sha256::digest(json).iter().take(SUM_DIGITS / 2).map(|byte| format!("{byte:02x}")).collect()
}

fn hex(key: &Key) -> String {
    key.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(digits: &[u8]) -> Option<Key> {
    let mut key = Key::default();
    for (byte, pair) in key.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(key)
}

#[cfg(test)]
mod tests {
    use srrf_classical::Identity;
    use srrf_cloud::{PointCloud, Registration, Rigid};
    use srrf_corrupt::{Bases, Label, PairConfig, PairSynthesizer, PoseDraw, Stream};

    use super::*;
    use crate::methods::PRODUCT_CODE;

    fn method(settings: &str) -> ReadyMethod {
        ReadyMethod { settings: settings.into(), ..ReadyMethod::new(Identity) }
    }

    fn pair(item: u64) -> Pair {
        let points = (0..37).map(|i| [f64::from(i), (f64::from(i)).sin(), 0.5]).collect();
        let cloud = PointCloud::new(points).unwrap();
        let synthesizer = PairSynthesizer::new(PairConfig { points: 31, ..PairConfig::default() }).unwrap();
        let stream = Stream { seed: 5, item };
        synthesizer
            .pair_from_bases(Bases::Shared(&cloud), Label::default(), None, PoseDraw::Seeded, stream)
            .unwrap()
    }

    fn found(seconds: f64) -> KeptAnswer {
        KeptAnswer::new(Ok(Registration::from_pose(Rigid::identity())), &Rigid::identity(), seconds)
    }

    #[test]
    fn what_was_put_is_found_again_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (Cache::pair_hash(&pair(1)), Cache::pair_hash(&pair(2)));
        let cache = Cache::open(folder.path(), "flex").unwrap();
        assert_eq!(cache.get(&method(""), &a), None);
        cache.put(&method(""), &a, &found(1.0)).unwrap();
        cache.put(&method("x"), &a, &found(2.0)).unwrap();
        for cache in [&cache, &Cache::open(folder.path(), "flex").unwrap()] {
            assert_eq!(cache.get(&method(""), &a), Some(found(1.0)));
            assert_eq!(cache.get(&method("x"), &a), Some(found(2.0)));
            assert_eq!(cache.get(&method(""), &b), None);
            assert_eq!(cache.reused(), 2);
        }
        assert_eq!(Cache::open(folder.path(), "cuda").unwrap().get(&method(""), &a), None);
    }

    #[test]
    fn answers_of_the_product_have_keys_of_their_own_code() {
        let folder = tempfile::tempdir().unwrap();
        let hash = Cache::pair_hash(&pair(1));
        let cache = Cache::open(folder.path(), "flex").unwrap();
        cache.put(&method(""), &hash, &found(1.0)).unwrap();
        let product = ReadyMethod { code: PRODUCT_CODE, ..method("") };
        assert_eq!(cache.get(&product, &hash), None);
    }

    #[test]
    fn a_torn_line_is_ignored_and_does_not_spoil_the_next() {
        let folder = tempfile::tempdir().unwrap();
        let hashes: Vec<PairHash> = (0..3).map(|item| Cache::pair_hash(&pair(item))).collect();
        let cache = Cache::open(folder.path(), "flex").unwrap();
        cache.put(&method(""), &hashes[0], &found(1.0)).unwrap();
        cache.put(&method(""), &hashes[1], &found(2.0)).unwrap();
        drop(cache);
        let path = folder.path().join(FILE);
        let bytes = fs::read(&path).unwrap();
        // A kill may tear the second line anywhere.
        let first = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
        for kept in [first + 1, first + KEY_DIGITS + 1, first + KEY_DIGITS + 9, bytes.len() - 2] {
            fs::write(&path, &bytes[..kept]).unwrap();
            let cache = Cache::open(folder.path(), "flex").unwrap();
            assert_eq!(cache.get(&method(""), &hashes[0]), Some(found(1.0)));
            assert_eq!(cache.get(&method(""), &hashes[1]), None);
            cache.put(&method(""), &hashes[2], &found(3.0)).unwrap();
            let again = Cache::open(folder.path(), "flex").unwrap();
            assert_eq!(again.get(&method(""), &hashes[2]), Some(found(3.0)));
            assert_eq!(again.get(&method(""), &hashes[1]), None);
        }
    }

    #[test]
    fn a_folder_that_cannot_be_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = Cache::open(&file.path().join("cache"), "flex").unwrap_err();
        assert!(error.to_string().contains("answers.jsonl"), "{error}");
        assert!(error.is_usage());
    }
}
