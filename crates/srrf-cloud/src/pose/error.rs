//! [`PoseFileError`].

use crate::io::FormatError;

/// What all messages of a wrong shape end with.
const EXPECTED: &str = "a pose is 4 rows of 4 numbers, 3 rows of 4, 16 or 12 numbers in a row, `tx ty tz qx qy qz qw`, a \
                        table whose title names these, or JSON with `target_from_source`";

/// Why a file holds no pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PoseFileError {
    /// Neither text nor an array.
    #[error("neither UTF-8 text nor an .npy array; {EXPECTED}")]
    NotText,
    /// A `.npz` archive with no pose or with several.
    #[error(
        "{} of its arrays {names} could be a pose; call the one that maps source coordinates into the target frame \
         `target_from_source`, or save it alone with numpy.save as .npy",
        if *.poses == 0 { "none".to_owned() } else { .poses.to_string() }
    )]
    Archive {
        /// How many of the arrays have the shape of a pose.
        poses: usize,
        /// The arrays.
        names: String,
    },
    /// An array that cannot be read.
    #[error(transparent)]
    NotRead(#[from] FormatError),
    /// An array of another shape.
    #[error("an array of shape {shape:?}; {EXPECTED}")]
    Array {
        /// Its shape.
        shape: Vec<usize>,
    },
    /// A word that is no number.
    #[error("line {line}: {word:?} is not a finite number; {EXPECTED}")]
    Number {
        /// The line, from 1.
        line: usize,
        /// The word, at most 40 characters of it.
        word: String,
    },
    /// A number of an array that is NaN or infinite.
    #[error("a number is NaN or infinite; a pose has finite numbers")]
    NotFinite,
    /// Another number of numbers.
    #[error("{rows}; {EXPECTED}")]
    Shape {
        /// The rows that there are, in words.
        rows: String,
    },
    /// Many poses.
    #[error(
        "it holds {poses} poses, a trajectory; one is wanted: write the line of that one into a file of its own"
    )]
    Trajectory {
        /// How many.
        poses: usize,
    },
    /// The last row is neither 0 0 0 1 nor anything that is known.
    #[error("the last row of a 4 x 4 pose is 0 0 0 1, here it is {row:?}")]
    LastRow {
        /// The row.
        row: [f64; 4],
    },
    /// The translation stands in the last row.
    #[error(
        "the matrix is transposed: its last row, {row:?}, holds the translation, and its last column 0 0 0 1; write it row \
         by row (`numpy.savetxt(file, matrix.T)`, or `.transpose()` where it was column-major)"
    )]
    Transposed {
        /// The last row.
        row: [f64; 4],
    },
    /// A similarity.
    #[error(
        "the matrix has the scale {scale} in it, and a pose has none: bring both clouds to one unit, and divide the 3 x 3 \
         part by {scale}"
    )]
    Scale {
        /// The factor.
        scale: f64,
    },
    /// Shear, scales that differ, or no rotation at all.
    #[error(
        "the 3 x 3 part is not a rotation: its columns have the lengths {lengths:?}, and R^T R is up to {off:.4} off the \
         identity; a pose has neither scale nor shear"
    )]
    NotRotation {
        /// Lengths of the columns.
        lengths: [f64; 3],
        /// Greatest entry of `|R^T R - I|`.
        off: f64,
    },
    /// A mirror image.
    #[error("the 3 x 3 part is a mirror image, not a rotation (its determinant is -1)")]
    Mirror,
    /// A quaternion that is none.
    #[error(
        "the quaternion in `tx ty tz` and four numbers has the length {length:.6}, not 1; is the order another one?"
    )]
    Quaternion {
        /// Its length.
        length: f64,
    },
    /// The quaternion stands before the translation.
    #[error(
        "the first four of the numbers have length 1, the last four {length:.6}: the quaternion stands before the \
         translation; write `tx ty tz` first"
    )]
    QuaternionFirst {
        /// Length of the last four.
        length: f64,
    },
    /// JSON that cannot be read.
    #[error("not readable as JSON ({why}); {EXPECTED}")]
    Json {
        /// The reader's reason.
        why: String,
    },
    /// An answer without a pose.
    #[error("an answer without a pose: {why}")]
    NoPose {
        /// What the answer says.
        why: String,
    },
    /// JSON without a known key.
    #[error(
        "the JSON has no `target_from_source` (its keys are {keys}); name the 4 x 4 matrix so, which says that it maps \
         source coordinates into the target frame"
    )]
    NoKey {
        /// The keys that there are.
        keys: String,
    },
}
