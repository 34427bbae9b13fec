//! [`PoseFormat`]: how a pose is written.

use std::fmt::Write;
use std::io;
use std::path::Path;
use std::str::FromStr;

use serde_json::json;

use crate::Rigid;
use crate::io::Array;

/// The version of the keys of a pose in JSON.
const SCHEMA: &str = "srrf-pose/1";

/// A format of files of poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseFormat {
    /// 4 rows of 4 numbers, which `numpy.loadtxt` reads.
    Text,
    /// JSON with `target_from_source`.
    Json,
    /// A NumPy array of shape (4, 4).
    Npy,
    /// `timestamp tx ty tz qx qy qz qw`, of the TUM RGB-D benchmark.
    Tum,
    /// 12 numbers in a row, the first three rows of the matrix, of KITTI's odometry benchmark.
    Kitti,
    /// `tx ty tz qx qy qz qw`, the arguments of ROS's `static_transform_publisher`.
    Ros,
}

/// What is known of a pose beside its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseNote {
    /// Whether the one who found it abstains from it.
    pub abstain: bool,
    /// The probability that it is right, if it is known.
    pub probability: Option<f64>,
}

impl PoseFormat {
    /// All formats.
    pub const ALL: [Self; 6] = [Self::Text, Self::Json, Self::Npy, Self::Tum, Self::Kitti, Self::Ros];

    /// Its name, as users give it; also the extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Text => "txt",
            Self::Json => "json",
            Self::Npy => "npy",
            Self::Tum => "tum",
            Self::Kitti => "kitti",
            Self::Ros => "ros",
        }
    }

    /// The format that the extension of `path` says; text where there is none, and `None` for one of no known format.
    pub fn of_path(path: &Path) -> Option<Self> {
        match path.extension() {
            None => Some(Self::Text),
            Some(extension) => extension.to_string_lossy().to_ascii_lowercase().parse().ok(),
        }
    }

    /// The bytes of a file with this pose. Numbers read back as the same bits where the format holds a matrix. Every
    /// format but `.npy` has room for `note`: a comment, or keys.
    ///
    /// # Errors
    /// None but those of memory.
    pub fn write(self, target_from_source: &Rigid, note: &PoseNote) -> io::Result<Vec<u8>> {
        let matrix = target_from_source.to_matrix4();
        let rows: [[f64; 4]; 4] =
            std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]));
        let [x, y, z] = target_from_source.translation.into();
        let [qx, qy, qz, qw] = target_from_source.quaternion_xyzw();
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = match self {
            Self::Npy => {
                let mut bytes = Vec::new();
                Array::write(&[4, 4], rows.as_flattened(), &mut bytes)?;
                return Ok(bytes);
            }
            Self::Json => {
                let value = json!({
                    "schema": SCHEMA,
                    "target_from_source": rows,
                    "translation": [x, y, z],
                    "quaternion_xyzw": [qx, qy, qz, qw],
                    "abstain": note.abstain,
                    "probability": note.probability,
                });
                writeln!(text, "{value:#}")
            }
            Self::Text => {
                note.comment(&mut text);
                rows.iter().try_for_each(|row| writeln!(text, "{}", spaced(row)))
            }
            Self::Kitti => {
                note.comment(&mut text);
                writeln!(text, "{}", spaced(&rows.as_flattened()[..12]))
            }
            Self::Tum => {
                note.comment(&mut text);
                let numbers = spaced(&[x, y, z, qx, qy, qz, qw]);
                writeln!(text, "# timestamp tx ty tz qx qy qz qw\n0 {numbers}")
            }
            Self::Ros => {
                note.comment(&mut text);
                writeln!(text, "# tx ty tz qx qy qz qw\n{}", spaced(&[x, y, z, qx, qy, qz, qw]))
            }
        };
        Ok(text.into_bytes())
    }
}

impl FromStr for PoseFormat {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name);
            format!("expected one of {}", known.join(", "))
        })
    }
}

impl PoseNote {
    /// A comment that `numpy.loadtxt` passes over, where there is something to say.
    fn comment(&self, text: &mut String) {
        if self.abstain {
            let probability = self.probability.map(|p| format!(" (probability {p:.3})")).unwrap_or_default();
            let _ = writeln!(text, "# abstain: this pose may well be wrong{probability}");
        }
    }
}

/// 17 significant digits each, which give the same bits when they are read.
fn spaced(numbers: &[f64]) -> String {
    numbers.iter().map(|v| format!("{v:.16e}")).collect::<Vec<_>>().join(" ")
}
