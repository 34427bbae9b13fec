//! [`Contents`]: what a file holds.

use std::fmt;

use super::encoding::TextEncoding;
use super::options::PointLayout;
use crate::Rigid;

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contents {
    /// The points in the order of the file, any numbers; shape `[n, 3]`. Of a mesh, its vertices.
    pub points: Vec<[f64; 3]>,
    /// Triangles of a mesh, as indices of `points`; shape `[m, 3]`. Polygons become fans. Empty for clouds.
    pub faces: Vec<[u32; 3]>,
    /// Whether single precision holds every coordinate, by the types in the file.
    pub single: bool,
    /// Where the scanner stood, in the frame of the points; `None` where the file does not say.
    pub viewpoint: Option<[f64; 3]>,
    /// Width and height of an organised cloud, whose points come row by row.
    pub grid: Option<[usize; 2]>,
    /// What a user should know of the reading.
    pub notes: Vec<Note>,
}

impl Contents {
    /// Of points in double precision, and nothing else.
    pub fn of_points(points: Vec<[f64; 3]>) -> Self {
        Self { points, ..Self::default() }
    }

    /// Takes the points away that have NaN or infinite coordinates, with the faces at them, and says how many they
    /// were. A cloud that loses points is no longer organised.
    pub fn drop_not_finite(&mut self) -> usize {
        let before = self.points.len();
        let finite = |p: &[f64; 3]| p.iter().all(|c| c.is_finite());
        if self.points.iter().all(finite) {
            return 0;
        }
        if !self.faces.is_empty() {
            let mut next = 0u32;
            let places: Vec<Option<u32>> = self
                .points
                .iter()
                .map(|p| {
                    finite(p).then(|| {
                        next += 1;
                        next - 1
                    })
                })
                .collect();
            let place = |corner: u32| places.get(corner as usize).copied().flatten();
            self.faces =
                self.faces.iter().filter_map(|&[a, b, c]| Some([place(a)?, place(b)?, place(c)?])).collect();
        }
        self.points.retain(finite);
        self.grid = None;
        before - self.points.len()
    }
}

/// So many points at exactly 0, 0, 0 are no points: cameras and scanners write them for "no return".
const PILE: usize = 3;

impl Contents {
    /// Which points stand for "no return": those at exactly 0, 0, 0, where they are several. None in a mesh.
    pub fn no_returns(&self) -> Option<Vec<bool>> {
        let is_zero = |p: &[f64; 3]| p.iter().all(|c| *c == 0.0);
        let pile = self.points.iter().filter(|p| is_zero(p)).count() >= PILE;
        (pile && self.faces.is_empty()).then(|| self.points.iter().map(is_zero).collect())
    }

    /// Takes the points away that stand for "no return" ([`no_returns`](Self::no_returns)), says so in a note, and how many they were.
    /// A cloud that loses points is no longer organised.
    pub fn drop_no_returns(&mut self) -> usize {
        let Some(zero) = self.no_returns() else { return 0 };
        let before = self.points.len();
        let mut zeros = zero.into_iter();
        self.points.retain(|_| !zeros.next().unwrap_or(false));
        let points = before - self.points.len();
        self.notes.push(Note::NoReturns { points, organised: self.grid.take().is_some() });
        points
    }
}

/// What a user should know of a reading. [`fmt::Display`] gives a sentence.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// Points at exactly 0, 0, 0 were left out, since they stand for "no return".
    NoReturns {
        /// How many.
        points: usize,
        /// Whether the cloud was organised, as depth cameras write them.
        organised: bool,
    },
    /// Something in the file was passed over.
    Ignored {
        /// What, such as `3 lines that begin with "foo"`.
        what: String,
    },
    /// Bytes behind the end.
    ExtraBytes {
        /// How many.
        bytes: usize,
    },
    /// What a point is was found by the plausibility of its numbers.
    LayoutFound {
        /// What was found.
        layout: PointLayout,
    },
    /// The first line is a title of numbers: 0, 1, 2 and so on, as pandas writes it for columns without names.
    NumberedTitle,
    /// Rows lack a coordinate; they are points with NaN.
    EmptyCells {
        /// How many.
        rows: usize,
    },
    /// Several scans were read as one cloud, each where its pose says.
    Merged {
        /// How many.
        scans: usize,
    },
    /// Points of a mesh that are no corner of a triangle.
    LoosePoints {
        /// How many.
        points: usize,
    },
    /// The text is not in UTF-8; a moved copy of it is.
    Decoded {
        /// What it is in.
        encoding: TextEncoding,
    },
    /// An array of other than two axes was read as a list of points.
    Flattened {
        /// Its shape.
        shape: Vec<u64>,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReturns { points, organised } => write!(
                f,
                "{points} points{} at exactly 0, 0, 0 were left out, since such a pile stands for \"no return\"; \
                 `--keep-zeros` keeps them",
                if *organised { " of the organised cloud" } else { "" }
            ),
            Self::Ignored { what } => write!(f, "passed over {what}"),
            Self::Decoded { encoding } => {
                write!(f, "the text is in {encoding}; a moved copy of it is in UTF-8")
            }
            Self::ExtraBytes { bytes: 1 } => f.write_str("passed over 1 byte behind the end"),
            Self::ExtraBytes { bytes } => write!(f, "passed over {bytes} bytes behind the end"),
            Self::LayoutFound { layout } => write!(
                f,
                "read as {} numbers of {} a point ({layout}), the only usual layout that fits; `--layout` says another",
                layout.numbers,
                if layout.double { "float64" } else { "float32" }
            ),
            Self::NumberedTitle => {
                f.write_str("the first line, 0, 1, 2 and so on, was taken for a title and not for a point")
            }
            Self::EmptyCells { rows } => write!(
                f,
                "{rows} row{} a coordinate (an empty cell, or a word such as NA) and {} as NaN",
                if *rows == 1 { " lacks" } else { "s lack" },
                if *rows == 1 { "counts" } else { "count" }
            ),
            Self::Merged { scans } => {
                write!(
                    f,
                    "{scans} scans as one cloud, each where its pose says; `FILE#2` is the second alone"
                )
            }
            Self::LoosePoints { points } => {
                write!(f, "{points} points are no corner of a triangle, and so no part of the surface")
            }
            Self::Flattened { shape } => write!(f, "an array of shape {shape:?}, read as a list of points"),
        }
    }
}

/// One of several scans in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanEntry {
    /// Its name; empty where it has none.
    pub name: String,
    /// Number of its points.
    pub points: u64,
    /// From the scanner's frame to that of the file, where the file has it.
    pub pose: Option<Rigid>,
}

/// What the points of a file have besides their place: one value a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// In small letters: `red`, `green`, `blue`, `alpha`, `intensity`, `nx`, `ny`, `nz`, or as the file has it.
    pub name: String,
    /// The values, as many as points.
    pub values: AttributeValues,
}

/// Values of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValues {
    /// `int8`
    I8(Vec<i8>),
    /// `uint8`
    U8(Vec<u8>),
    /// `int16`
    I16(Vec<i16>),
    /// `uint16`
    U16(Vec<u16>),
    /// `int32`
    I32(Vec<i32>),
    /// `uint32`
    U32(Vec<u32>),
    /// `int64`
    I64(Vec<i64>),
    /// `uint64`
    U64(Vec<u64>),
    /// `float32`
    F32(Vec<f32>),
    /// `float64`
    F64(Vec<f64>),
}

impl AttributeValues {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::I8(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::I16(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::U64(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A value as `f64` (64-bit integers are rounded); `None` past the end.
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::I8(v) => v.get(index).map(|&v| v.into()),
            Self::U8(v) => v.get(index).map(|&v| v.into()),
            Self::I16(v) => v.get(index).map(|&v| v.into()),
            Self::U16(v) => v.get(index).map(|&v| v.into()),
            Self::I32(v) => v.get(index).map(|&v| v.into()),
            Self::U32(v) => v.get(index).map(|&v| v.into()),
            Self::I64(v) => v.get(index).map(|&v| v as f64),
            Self::U64(v) => v.get(index).map(|&v| v as f64),
            Self::F32(v) => v.get(index).map(|&v| v.into()),
            Self::F64(v) => v.get(index).copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_follow_their_points() {
        let mut contents = Contents {
            points: vec![[0.0; 3], [f64::NAN; 3], [1.0; 3], [2.0; 3], [3.0, f64::INFINITY, 0.0]],
            faces: vec![[0, 2, 3], [0, 1, 2], [2, 3, 4], [3, 2, 0]],
            grid: Some([5, 1]),
            ..Contents::default()
        };
        assert_eq!(contents.drop_not_finite(), 2);
        assert_eq!(contents.points, [[0.0; 3], [1.0; 3], [2.0; 3]]);
        assert_eq!((contents.faces.as_slice(), contents.grid), (&[[0, 1, 2], [2, 1, 0]][..], None));
        assert_eq!(contents.drop_not_finite(), 0);
    }

    #[test]
    fn a_pile_at_the_origin_is_no_return() {
        let zeros = [[0.0; 3], [0.0, -0.0, 0.0], [0.0; 3]];
        let cloud = |zeros: &[[f64; 3]]| {
            let mut contents = Contents::of_points(vec![[1.0, 2.0, 3.0], [0.0, 0.0, 4.0]]);
            contents.points.splice(1..1, zeros.iter().copied());
            contents.grid = Some([contents.points.len(), 1]);
            contents
        };
        let mut camera = cloud(&zeros);
        assert_eq!(camera.drop_no_returns(), 3);
        assert_eq!(camera.points, [[1.0, 2.0, 3.0], [0.0, 0.0, 4.0]]);
        assert_eq!(camera.grid, None);
        let note = camera.notes[0].to_string();
        assert!(note.starts_with("3 points of the organised cloud at exactly 0, 0, 0"), "{note}");
        // One or two may be points.
        let mut few = cloud(&zeros[..2]);
        assert_eq!((few.drop_no_returns(), few.points.len(), few.notes.len()), (0, 4, 0));
        // Many triangles of a mesh may meet at the origin.
        let mut mesh = Contents { faces: vec![[0, 1, 2]], ..cloud(&zeros) };
        assert_eq!((mesh.drop_no_returns(), mesh.points.len()), (0, 5));
    }
}
