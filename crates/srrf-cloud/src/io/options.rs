//! [`ReadOptions`]: how a file is to be read where it does not say so itself.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use super::FormatError;
use super::memory::half_of_the_machine;

/// How a file is to be read where it does not say so itself. The default asks the file for everything; where it
/// does not answer, the error names the option.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The columns of text, or the fields of an array, that are x, y and z.
    pub columns: Option<PointColumns>,
    /// Name of the array in an archive.
    pub array: Option<String>,
    /// What a point is in a file of bare numbers (`.bin`).
    pub layout: Option<PointLayout>,
    /// Number of the scan in a file of several, from 1; all of them without it.
    pub scan: Option<usize>,
    /// Topic of the messages that hold the cloud.
    pub topic: Option<String>,
    /// Number of the message, from 1.
    pub message: Option<usize>,
    /// Whether points at exactly 0, 0, 0 stay although they lie there in a pile, which stands for "no return".
    pub keep_zeros: bool,
    /// Folder of the file, where those lie that it names (the buffers of a `.gltf`); [`CloudFile`](super::CloudFile)
    /// knows it.
    pub folder: Option<PathBuf>,
    /// Most bytes of memory that reading may take, the file's own included; half of the machine's without it.
    pub max_memory: Option<u64>,
    /// Those of the options that were said of several files together: a file whose format takes one of them not passes it
    /// over, and does not refuse it. Who sets them sees to it that some file takes each
    /// ([`Taken`](super::Taken)).
    pub shared: Vec<ReadSwitch>,
}

impl ReadOptions {
    /// The options for scan `number`, from 1.
    pub fn of_scan(&self, number: usize) -> Self {
        Self { scan: Some(number), ..self.clone() }
    }

    /// Most bytes that reading may take.
    pub fn memory(&self) -> u64 {
        self.max_memory.unwrap_or_else(half_of_the_machine)
    }

    /// Checks that `planned` bytes may be taken for `what`, beside the `held` ones that are.
    ///
    /// # Errors
    /// [`FormatError::Memory`].
    pub fn check_memory(&self, what: &str, held: usize, planned: usize) -> Result<(), FormatError> {
        let (needed, limit) = ((held as u64).saturating_add(planned as u64), self.memory());
        if needed <= limit {
            return Ok(());
        }
        Err(FormatError::Memory { what: what.to_owned(), needed, limit })
    }

    /// Checks that there is room for `points` points beside the `held` bytes that are in use.
    ///
    /// # Errors
    /// [`FormatError::Memory`].
    pub fn check_points(&self, held: usize, points: usize) -> Result<(), FormatError> {
        let size = points.saturating_mul(size_of::<[f64; 3]>());
        self.check_memory(&format!("{points} points"), held, size)
    }

    /// Makes room in a list that grows without a known end.
    ///
    /// # Errors
    /// [`FormatError::Memory`].
    #[inline]
    pub fn grow<T>(&self, what: &str, held: usize, list: &mut Vec<T>) -> Result<(), FormatError> {
        if list.len() < list.capacity() {
            return Ok(());
        }
        let more = list.capacity().max(64);
        // While a list moves, both its old and its new place are taken.
        let both = (2 * list.capacity() + more).saturating_mul(size_of::<T>());
        self.check_memory(what, held, both)?;
        list.reserve_exact(more);
        Ok(())
    }
}

/// An option that speaks of some formats alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadSwitch {
    /// [`ReadOptions::columns`]
    Columns,
    /// [`ReadOptions::array`]
    Array,
    /// [`ReadOptions::layout`]
    Layout,
    /// [`ReadOptions::scan`]
    Scan,
    /// [`ReadOptions::topic`]
    Topic,
    /// [`ReadOptions::message`]
    Message,
}

impl ReadSwitch {
    /// The flag of the programs.
    pub fn flag(self) -> &'static str {
        match self {
            Self::Columns => "--columns",
            Self::Array => "--array",
            Self::Layout => "--layout",
            Self::Scan => "--scan",
            Self::Topic => "--topic",
            Self::Message => "--message",
        }
    }
}

impl ReadOptions {
    /// The options that are set and speak of some formats alone.
    pub fn switches(&self) -> impl Iterator<Item = ReadSwitch> {
        let set = [
            self.columns.is_some().then_some(ReadSwitch::Columns),
            self.array.is_some().then_some(ReadSwitch::Array),
            self.layout.is_some().then_some(ReadSwitch::Layout),
            self.scan.is_some().then_some(ReadSwitch::Scan),
            self.topic.is_some().then_some(ReadSwitch::Topic),
            self.message.is_some().then_some(ReadSwitch::Message),
        ];
        set.into_iter().flatten()
    }

    /// The same options, said of several files together.
    pub fn of_several(mut self) -> Self {
        self.shared = self.switches().collect();
        self
    }

    /// Leaves out one of the options.
    pub(super) fn leave_out(&mut self, switch: ReadSwitch) {
        match switch {
            ReadSwitch::Columns => self.columns = None,
            ReadSwitch::Array => self.array = None,
            ReadSwitch::Layout => self.layout = None,
            ReadSwitch::Scan => self.scan = None,
            ReadSwitch::Topic => self.topic = None,
            ReadSwitch::Message => self.message = None,
        }
    }
}

/// A column by its name or by its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnName {
    /// As the title of the file has it.
    Name(String),
    /// From 1.
    Number(usize),
}

impl fmt::Display for ColumnName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

/// The columns of x, y and z, such as `x,y,z`, `east,north,up` or `2,3,4`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointColumns(pub [ColumnName; 3]);

impl fmt::Display for PointColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = &self.0;
        write!(f, "{x},{y},{z}")
    }
}

/// What was written in place of an option.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct OptionError(String);

impl FromStr for PointColumns {
    type Err = OptionError;

    /// Three names or numbers (from 1), apart by commas.
    fn from_str(text: &str) -> Result<Self, OptionError> {
        let wrong = || {
            OptionError(format!(
                "expected three columns apart by commas, by name or by number from 1, such as x,y,z or 2,3,4; found {text:?}"
            ))
        };
        let column = |name: &str| match name.trim() {
            "" => Err(wrong()),
            name if name.bytes().all(|b| b.is_ascii_digit()) => {
                name.parse().ok().filter(|&n| n > 0).map(ColumnName::Number).ok_or_else(wrong)
            }
            name => Ok(ColumnName::Name(name.to_owned())),
        };
        let columns = text.split(',').map(column).collect::<Result<Vec<_>, _>>()?;
        let columns: [ColumnName; 3] = columns.try_into().map_err(|_| wrong())?;
        let [x, y, z] = &columns;
        if x == y || y == z || x == z {
            return Err(OptionError(format!(
                "a column is named twice in {text:?}; name three different ones"
            )));
        }
        Ok(Self(columns))
    }
}

/// Points of bare numbers one after the other, little endian: how many numbers a point has, of which type. x, y
/// and z come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointLayout {
    /// Numbers of a point, at least 3.
    pub numbers: usize,
    /// Whether they are `float64` and not `float32`.
    pub double: bool,
}

impl PointLayout {
    /// x, y, z, intensity: KITTI, SemanticKITTI and most others.
    pub const KITTI: Self = Self { numbers: 4, double: false };
    /// x, y, z, intensity, ring: nuScenes.
    pub const NUSCENES: Self = Self { numbers: 5, double: false };
    /// Most numbers of a point.
    pub const MOST: usize = 64;

    /// Bytes of a point.
    pub fn bytes(self) -> usize {
        self.numbers * if self.double { 8 } else { 4 }
    }
}

/// Such as `4xf32`.
impl fmt::Display for PointLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.numbers, if self.double { "f64" } else { "f32" })
    }
}

impl FromStr for PointLayout {
    type Err = OptionError;

    /// `kitti`, `nuscenes`, or the numbers of a point and their type: `3xf32`, `6xf64`.
    fn from_str(text: &str) -> Result<Self, OptionError> {
        let lower = text.trim().to_ascii_lowercase();
        match lower.as_str() {
            "kitti" => return Ok(Self::KITTI),
            "nuscenes" => return Ok(Self::NUSCENES),
            _ => {}
        }
        let parsed = lower.split_once('x').and_then(|(numbers, kind)| {
            let numbers = numbers.parse().ok().filter(|n| (3..=Self::MOST).contains(n))?;
            match kind {
                "f32" | "float32" | "f4" => Some(Self { numbers, double: false }),
                "f64" | "float64" | "f8" => Some(Self { numbers, double: true }),
                _ => None,
            }
        });
        parsed.ok_or_else(|| {
            OptionError(format!(
                "expected kitti (4xf32), nuscenes (5xf32), or the numbers of a point (3 to {}) and their type, such as \
                 3xf32 or 6xf64; found {text:?}",
                Self::MOST
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_by_name_and_by_number() {
        let columns: PointColumns = "east, 3 ,up m".parse().unwrap();
        assert_eq!(
            columns.0,
            [ColumnName::Name("east".into()), ColumnName::Number(3), ColumnName::Name("up m".into())]
        );
        assert_eq!(columns.to_string(), "east,3,up m");
        for (text, fact) in [
            ("x,y", "three columns"),
            ("x,y,z,w", "three columns"),
            ("x,,z", "three"),
            ("0,1,2", "from 1"),
            ("x,y,x", "twice"),
        ] {
            let error = text.parse::<PointColumns>().unwrap_err().to_string();
            assert!(error.contains(fact), "{error}");
        }
    }

    #[test]
    fn layouts() {
        for (text, numbers, double) in
            [("kitti", 4, false), ("nuScenes", 5, false), ("3xf32", 3, false), ("6xFloat64", 6, true)]
        {
            assert_eq!(text.parse::<PointLayout>(), Ok(PointLayout { numbers, double }), "{text}");
        }
        assert_eq!((PointLayout::NUSCENES.to_string(), PointLayout::NUSCENES.bytes()), ("5xf32".into(), 20));
        for text in ["", "2xf32", "x", "65xf32", "3xi32", "3"] {
            assert!(text.parse::<PointLayout>().unwrap_err().to_string().contains("such as 3xf32"), "{text}");
        }
    }

    #[test]
    fn memory_is_bounded() {
        let options = ReadOptions { max_memory: Some(1000), ..ReadOptions::default() };
        assert_eq!(options.check_points(760, 10), Ok(()));
        let error = options.check_points(761, 10).unwrap_err().to_string();
        assert!(error.contains("10 points") && error.contains("--max-memory"), "{error}");
        let mut list: Vec<u64> = Vec::new();
        let mut grown = 0;
        while options.grow("a list", 0, &mut list).is_ok() {
            list.push(0);
            grown += 1;
        }
        assert_eq!(grown, 64, "64 numbers of 8 bytes, but not twice as many beside them");
        assert!(ReadOptions::default().memory() > 1 << 26);
    }
}
