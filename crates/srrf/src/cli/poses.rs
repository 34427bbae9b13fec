//! Poses that the verbs read and write.

use std::io::Read;
use std::path::Path;

use clap::Args;
use srrf::Warning;
use srrf_args::files::{self, is_stream};
use srrf_args::{Failure, Places};
use srrf_cloud::pose::{PoseFile, PoseFormat, PoseNote, QuaternionOrder};
use srrf_cloud::{KnnIndex, PointCloud, Rigid};

/// Points of the source, and of the target, that are asked whether a pose looks inverted.
const ASKED: [usize; 2] = [500, 20_000];
/// So many times closer must the inverse lay the clouds...
const CLOSER: f64 = 4.0;
/// ...and that close, in shares of the target's extent.
const CLOSE: f64 = 0.05;

/// How to read poses.
#[derive(Debug, Clone, Copy, Args)]
pub struct PoseReading {
    /// Order of the quaternion where a pose is read as `tx ty tz` and four numbers, and no title says it: xyzw (TUM, ROS)
    /// or wxyz (EuRoC) [default: xyzw]
    #[arg(long, value_name = "ORDER")]
    pub quaternion: Option<QuaternionOrder>,
}

impl PoseReading {
    /// Reads the pose in a file.
    ///
    /// # Errors
    /// [`Failure::usage`], which names the file and what is wrong with it.
    pub fn read(self, path: &Path) -> Result<PoseFile, Failure> {
        let mut bytes = Vec::new();
        let read = if is_stream(path) {
            std::io::stdin().lock().take(MOST + 1).read_to_end(&mut bytes)
        } else {
            std::fs::File::open(path).and_then(|file| file.take(MOST + 1).read_to_end(&mut bytes))
        };
        read.map_err(|e| {
            Failure::usage(format!("cannot read {path:?}: {e}; it should hold a pose, such as 4 rows of 4"))
                .because(e)
        })?;
        if bytes.len() as u64 > MOST {
            return Err(Failure::usage(format!(
                "{path:?} is larger than any file of a pose; it should hold one, such as 4 rows of 4"
            )));
        }
        PoseFile::parse(&bytes, self.quaternion)
            .map_err(|e| Failure::usage(format!("{path:?}: {e}")).because(e))
    }
}

/// What was read, for people.
pub fn described(flag: &str, pose: &PoseFile) -> String {
    let abstained = if pose.abstained { "; the file says `abstain` of it" } else { "" };
    format!("{flag}: {}, taken as target_from_source{abstained}", pose.layout)
}

/// Bytes of the largest file of a pose; results of `--json` with long notes are far smaller.
const MOST: u64 = 64 << 20;

/// How to write a pose.
#[derive(Debug, Clone, Copy, Args)]
pub struct PoseWriting {
    /// Format of the pose of --output [default: as its name says, .txt, .json, .npy, .tum, .kitti or .ros]; `txt` is 4
    /// rows of 4, `kitti` 12 numbers in a row, `tum` and `ros` end with `qx qy qz qw`
    #[arg(long, value_name = "NAME")]
    pub pose_format: Option<PoseFormat>,
}

impl PoseWriting {
    /// The output of a pose among the places of a run.
    ///
    /// # Errors
    /// [`Failure::usage`] for a name of another format.
    pub fn among(self, places: Places, flag: &str, path: Option<&Path>) -> Result<Places, Failure> {
        places.writes_checked(flag, path, |path| self.format(path).map(drop))
    }

    /// The format of a file.
    fn format(self, path: &Path) -> Result<PoseFormat, Failure> {
        if is_stream(path) {
            return Ok(self.pose_format.unwrap_or(PoseFormat::Text));
        }
        match (self.pose_format, PoseFormat::of_path(path)) {
            (None, Some(named)) => Ok(named),
            (None, None) => Err(Failure::usage(format!(
                "{path:?}: its extension names no format of poses; use one of .{}, or say --pose-format",
                PoseFormat::ALL.map(PoseFormat::name).join(", .")
            ))),
            (Some(asked), None) => Ok(asked),
            (Some(asked), Some(named)) => {
                let rows = [PoseFormat::Text, PoseFormat::Tum, PoseFormat::Kitti, PoseFormat::Ros];
                let plain = path.extension().is_none();
                let text = named == PoseFormat::Text && rows.contains(&asked);
                if plain || text || asked == named {
                    return Ok(asked);
                }
                Err(Failure::usage(format!(
                    "{path:?}: the name says {}, and --pose-format {}; change one of them",
                    named.name(),
                    asked.name()
                )))
            }
        }
    }

    /// Writes a pose.
    ///
    /// # Errors
    /// [`Failure`], which names the file.
    pub fn write(self, path: &Path, pose: &Rigid, note: &PoseNote) -> Result<(), Failure> {
        let format = if files::is_special(path) {
            self.pose_format.unwrap_or(PoseFormat::Text)
        } else {
            self.format(path)?
        };
        let bytes = format.write(pose, note).map_err(Failure::other)?;
        files::write(path, &bytes)
    }
}

/// Whether a pose that was given lays the source far off the target, and its inverse close on it.
pub fn looks_inverted(pose: &Rigid, source: &PointCloud, target: &PointCloud) -> Option<Warning> {
    let thinned = |cloud: &PointCloud, most: usize| -> Vec<[f64; 3]> {
        let step = cloud.len().div_ceil(most).max(1);
        cloud.points().iter().step_by(step).copied().collect()
    };
    let (asked, near) = (thinned(source, ASKED[0]), thinned(target, ASKED[1]));
    let index = KnnIndex::new(&near).ok()?;
    let median = |pose: &Rigid| {
        let mut distances: Vec<f64> = asked.iter().map(|p| index.nearest(&pose.apply(p)).1.sqrt()).collect();
        distances.sort_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let (given, inverse) = (median(pose), median(&pose.inverse()));
    let extent = target.to_unit_sphere().1.radius;
    let inverted = given > CLOSER * inverse && inverse < CLOSE * extent;
    inverted.then_some(Warning::Inverted { given, inverse })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn a_name_says_the_format() {
        let format = |asked: Option<PoseFormat>, name: &str| {
            PoseWriting { pose_format: asked }.format(Path::new(name)).map_err(|e| e.to_string())
        };
        for (asked, name, wanted) in [
            (None, "t.txt", PoseFormat::Text),
            (None, "pose", PoseFormat::Text),
            (None, "t.JSON", PoseFormat::Json),
            (None, "t.npy", PoseFormat::Npy),
            (Some(PoseFormat::Kitti), "t.txt", PoseFormat::Kitti),
            (Some(PoseFormat::Npy), "pose", PoseFormat::Npy),
            (Some(PoseFormat::Tum), "t.dat", PoseFormat::Tum),
            (Some(PoseFormat::Json), "-", PoseFormat::Json),
            (None, "-", PoseFormat::Text),
        ] {
            assert_eq!(format(asked, name), Ok(wanted), "{name}");
        }
        assert!(format(None, "t.mat").unwrap_err().contains("use one of .txt, .json, .npy, .tum"));
        let clash = format(Some(PoseFormat::Kitti), "t.json").unwrap_err();
        assert!(clash.contains("the name says json, and --pose-format kitti"), "{clash}");
        assert!(format(Some(PoseFormat::Npy), "t.txt").is_err());
    }

    #[test]
    fn an_inverted_guess_is_known_by_the_clouds() {
        let points = (0..900).map(|i| {
            let s = f64::from(i);
            [s.sin(), (0.7 * s).cos() * 0.5, (0.013 * s).sin() * 0.25]
        });
        let source = PointCloud::new(points.collect()).unwrap();
        let rotation = EulerXyz::from_deg([10.0, -40.0, 75.0]).to_matrix();
        let pose = Rigid { rotation, translation: Vector3::new(4.0, -2.0, 7.0) };
        let target = source.transformed(&pose);
        assert!(looks_inverted(&pose, &source, &target).is_none());
        let warning = looks_inverted(&pose.inverse(), &source, &target).unwrap();
        assert!(warning.to_string().contains("looks inverted"), "{warning}");
        assert!(looks_inverted(&Rigid::identity(), &source, &target).is_none(), "wrong either way");
    }
}
