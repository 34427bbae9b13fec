//! What the tests of the program share: the program, and clouds made on the spot.
#![allow(dead_code, clippy::unwrap_used, reason = "each test uses a part; what fails here fails the test")]

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use nalgebra::Vector3;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use serde_json::Value;
use srrf_cloud::io::write_cloud;
use srrf_cloud::{EulerXyz, PointCloud, Rigid};
use srrf_corrupt::{datasets::ShapeSource, shapes::ProceduralShapes};

/// A folder with a source, a target and the pose between them.
pub struct Scene {
    pub folder: tempfile::TempDir,
    pub source: PointCloud,
    pub truth: Rigid,
}

impl Scene {
    /// A built-in shape of 3 m, in double precision at map coordinates: `source.ply` and `target.ply`.
    pub fn new(points: usize) -> Self {
        let place = Vector3::new(500_123.25, 4_100_456.5, 312.125);
        let to_map = |p: &[f64; 3]| (Vector3::from(*p) * 1.5 + place).into();
        let shape = shape(points);
        let source = PointCloud::new(shape.points().iter().map(to_map).collect()).unwrap();
        // Turned about its own centre and shifted by some metres.
        let rotation = EulerXyz::from_deg([12.0, -9.0, 31.0]).to_matrix();
        let translation = place - rotation * place + Vector3::new(2.5, -1.25, 0.75);
        let truth = Rigid { rotation, translation };
        let folder = tempfile::tempdir().unwrap();
        write_cloud(&folder.path().join("source.ply"), &source).unwrap();
        write_cloud(&folder.path().join("target.ply"), &source.transformed(&truth)).unwrap();
        Self { folder, source, truth }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file and gives its path.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// Runs `srrf` in the folder.
    pub fn srrf(&self, arguments: &[&str]) -> Done {
        self.srrf_reading(arguments, b"")
    }

    /// Runs `srrf` in the folder with bytes on standard input.
    pub fn srrf_reading(&self, arguments: &[&str], input: &[u8]) -> Done {
        let mut child = Command::new(env!("CARGO_BIN_EXE_srrf"))
            .args(arguments)
            .current_dir(self.folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdin.take().unwrap();
        let input = input.to_vec();
        let feeder = std::thread::spawn(move || {
            let _ = pipe.write_all(&input); // the program may end without reading it
        });
        let output = child.wait_with_output().unwrap();
        feeder.join().unwrap();
        Done::new(output)
    }

    /// Greatest distance between where a pose takes the source's points and where they belong.
    pub fn worst(&self, pose: &Rigid) -> f64 {
        let error = |p: &[f64; 3]| (Vector3::from(pose.apply(p)) - Vector3::from(self.truth.apply(p))).norm();
        self.source.points().iter().map(error).fold(0.0, f64::max)
    }
}

/// A chair of radius 1.
pub fn shape(points: usize) -> PointCloud {
    let shapes = ProceduralShapes::new(3, 1, Some(&["chair"])).unwrap();
    shapes.sample(0, points, &mut ChaCha8Rng::seed_from_u64(5)).unwrap()
}

/// A run that has ended.
#[derive(Debug)]
pub struct Done {
    pub code: i32,
    pub out: String,
    pub bytes: Vec<u8>,
    pub err: String,
}

impl Done {
    fn new(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8(output.stderr).unwrap(),
            bytes: output.stdout,
        }
    }

    /// Checks that it ended well, or abstained.
    pub fn ok(self) -> Self {
        assert!(self.code == 0 || self.code == 3, "{self:?}");
        assert!(!self.err.contains("error:"), "{self:?}");
        self
    }
}

/// A pose from text as `numpy.loadtxt` would read it: rows of numbers.
pub fn pose_of(text: &str) -> Rigid {
    let lines = text.lines().filter(|l| !l.starts_with('#'));
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.split_whitespace().map(|w| w.parse().unwrap()).collect()).collect();
    pose_of_rows(&rows)
}

/// A pose from `target_from_source` in JSON.
pub fn pose_of_json(value: &Value) -> Rigid {
    pose_of_rows(&serde_json::from_value::<Vec<Vec<f64>>>(value["target_from_source"].clone()).unwrap())
}

fn pose_of_rows(rows: &[Vec<f64>]) -> Rigid {
    assert_eq!(rows.iter().map(Vec::len).collect::<Vec<_>>(), [4; 4]);
    assert_eq!(rows[3], [0.0, 0.0, 0.0, 1.0]);
    Rigid {
        rotation: nalgebra::Matrix3::from_fn(|r, c| rows[r][c]),
        translation: Vector3::new(rows[0][3], rows[1][3], rows[2][3]),
    }
}

/// JSON from a file.
pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// JSON from each line of a text.
pub fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}
