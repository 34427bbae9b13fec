//! The legacy files of VTK (`# vtk DataFile Version`), text and binary (big endian).

use std::ops::Range;

use super::super::scalar::Scalar;
use super::super::scan::{ByteLines, quote};
use super::super::{FormatError, ReadOptions};
use super::cells::{self, CellKind};
use super::cursor::{Kind, VtkCursor, components, kind, name, skip_metadata};

/// One value a point: what a file of VTK holds besides coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PointData {
    pub name: String,
    pub kind: Scalar,
    /// Numbers a point.
    pub components: usize,
    /// `components` numbers for each point.
    pub values: Vec<f64>,
    /// Where they are in the file, and whether they are turned with the points.
    pub place: Range<usize>,
    pub normals: bool,
}

/// A legacy file.
#[derive(Debug, Default)]
pub(super) struct Legacy {
    pub binary: bool,
    pub points: Vec<[f64; 3]>,
    pub kind: Option<Scalar>,
    /// Where the coordinates are, and the word that names their type.
    pub place: Range<usize>,
    pub kind_place: Range<usize>,
    pub faces: Vec<[u32; 3]>,
    pub grid: Option<[usize; 2]>,
    pub data: Vec<PointData>,
    /// The section from which on the file was not read.
    pub unread: Option<String>,
}

/// Whether `bytes` begin as a legacy file does.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.get(..20).is_some_and(|begin| begin.eq_ignore_ascii_case(b"# vtk DataFile Versi"))
}

/// Lists of cells: the number of corners in front of each, or offsets and connectivity.
struct Cells {
    ends: Vec<f64>,
    corners: Vec<f64>,
}

/// Reads a file.
///
/// # Errors
/// [`FormatError`] where it is none, ends too early, or is of a kind without points.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<Legacy, FormatError> {
    if !recognises(bytes) {
        return Err(FormatError::Content("the file does not begin with `# vtk DataFile Version`".into()));
    }
    let mut lines = ByteLines::new(bytes);
    lines.next();
    lines.next();
    let encoding = lines.next().map_or(&b""[..], |line| line.text.trim_ascii());
    let binary = encoding.eq_ignore_ascii_case(b"BINARY");
    if !binary && !encoding.eq_ignore_ascii_case(b"ASCII") {
        let problem = format!("the third line is {}, neither ASCII nor BINARY", quote(encoding));
        return Err(FormatError::Content(problem));
    }
    let mut cursor = VtkCursor { bytes, at: lines.offset(), binary };
    let mut reading = LegacyReading { options: options.clone(), ..LegacyReading::default() };
    while let Some((_, word)) = cursor.word() {
        let known = reading.section(&mut cursor, word)?;
        // What follows the geometry may be of any kind.
        if !known && !reading.file.points.is_empty() {
            reading.file.unread = Some(quote(word));
            break;
        }
        if !known {
            return Err(FormatError::Content(format!("the unknown section {}", quote(word))));
        }
    }
    reading.finish(binary)
}

/// What has been read so far.
#[derive(Default)]
struct LegacyReading {
    options: ReadOptions,
    file: Legacy,
    found: bool,
    dimensions: Option<[usize; 3]>,
    lists: Vec<(CellKind, Cells)>,
    cells: Option<Cells>,
    types: Vec<f64>,
    /// Whether values belong to points, and how many.
    data_of: Option<(bool, usize)>,
}

impl LegacyReading {
    /// Reads the section that `keyword` begins; `false` where that is none.
    fn section(&mut self, cursor: &mut VtkCursor, keyword: &[u8]) -> Result<bool, FormatError> {
        let keyword = String::from_utf8_lossy(keyword).to_ascii_uppercase();
        match keyword.as_str() {
            "DATASET" => {
                let (_, kind) = cursor.expect("the kind of data set")?;
                let known: [&[u8]; 3] = [b"POLYDATA", b"UNSTRUCTURED_GRID", b"STRUCTURED_GRID"];
                if !known.iter().any(|known| kind.eq_ignore_ascii_case(known)) {
                    return Err(FormatError::Content(format!(
                        "a data set of the kind {} has no points of its own; save a POLYDATA, \
                         UNSTRUCTURED_GRID or STRUCTURED_GRID",
                        quote(kind)
                    )));
                }
            }
            "POINTS" => self.points(cursor)?,
            "DIMENSIONS" => {
                let mut sizes = [0; 3];
                for size in &mut sizes {
                    *size = cursor.count("a size of the grid")?;
                }
                self.dimensions = Some(sizes);
            }
            "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" => {
                let kind = match keyword.as_str() {
                    "POLYGONS" => CellKind::Polygon,
                    "TRIANGLE_STRIPS" => CellKind::Strip,
                    _ => CellKind::Other,
                };
                self.lists.push((kind, cell_list(cursor)?));
            }
            "CELLS" => self.cells = Some(cell_list(cursor)?),
            "CELL_TYPES" => {
                let count = cursor.count("the number of cells")?;
                self.types = cursor.numbers(count, Scalar::I32)?.0;
            }
            "METADATA" => skip_metadata(cursor),
            "POINT_DATA" | "CELL_DATA" => {
                let count = cursor.count("the number of values")?;
                self.data_of = Some((keyword == "POINT_DATA", count));
            }
            "FIELD" => {
                cursor.expect("the name of the field")?;
                for _ in 0..cursor.count("the number of arrays")? {
                    self.field_array(cursor)?;
                }
            }
            _ => return self.values(cursor, &keyword),
        }
        Ok(true)
    }

    fn points(&mut self, cursor: &mut VtkCursor) -> Result<(), FormatError> {
        let count = cursor.count("the number of points")?;
        let (kind_place, word) = cursor.expect("the type of the coordinates")?;
        let Kind::Number(kind) = kind(word)? else {
            return Err(FormatError::Content(format!("coordinates of the type {}", quote(word))));
        };
        let all = count.checked_mul(3).ok_or_else(|| FormatError::Content(format!("{count} points")))?;
        // Numbers first, then points.
        self.options.check_points(cursor.bytes.len(), count.saturating_mul(2))?;
        let (values, place) = cursor.numbers(all, kind)?;
        self.file.points = values.as_chunks::<3>().0.to_vec();
        self.file.kind = Some(kind);
        self.file.place = place;
        self.file.kind_place = kind_place;
        self.found = true;
        Ok(())
    }

    /// An array of a field: name, components, tuples, type.
    fn field_array(&mut self, cursor: &mut VtkCursor) -> Result<(), FormatError> {
        if cursor.peeks(b"METADATA") {
            cursor.word();
            skip_metadata(cursor);
        }
        let name = name(cursor.expect("the name of an array")?.1);
        let components = cursor.count("the number of components")?;
        let tuples = cursor.count("the number of tuples")?;
        let kind = kind(cursor.expect("a type")?.1)?;
        self.take(cursor, name, (components, tuples), kind, false)
    }

    /// The values of a section of attributes; `false` where `keyword` begins none.
    fn values(&mut self, cursor: &mut VtkCursor, keyword: &str) -> Result<bool, FormatError> {
        let Some((_, count)) = self.data_of else { return Ok(false) };
        let fixed = match keyword {
            "SCALARS" => {
                let name = name(cursor.expect("a name")?.1);
                let kind = kind(cursor.expect("a type")?.1)?;
                let components = if cursor.peeks(b"LOOKUP_TABLE") { 1 } else { components(cursor) };
                if cursor.peeks(b"LOOKUP_TABLE") {
                    cursor.word();
                    cursor.expect("the name of a table")?;
                }
                self.take(cursor, name, (components, count), kind, false)?;
                return Ok(true);
            }
            "COLOR_SCALARS" => {
                let name = name(cursor.expect("a name")?.1);
                let components = cursor.count("the number of components")?;
                let kind = if cursor.binary { Scalar::U8 } else { Scalar::F32 };
                self.take(cursor, name, (components, count), Kind::Number(kind), false)?;
                return Ok(true);
            }
            "LOOKUP_TABLE" => {
                cursor.expect("a name")?;
                let size = cursor.count("the size of the table")?;
                let kind = Kind::Number(if cursor.binary { Scalar::U8 } else { Scalar::F32 });
                cursor.skip(size.saturating_mul(4), kind)?;
                return Ok(true);
            }
            "TEXTURE_COORDINATES" => {
                let name = name(cursor.expect("a name")?.1);
                let components = cursor.count("the number of components")?;
                let kind = kind(cursor.expect("a type")?.1)?;
                self.take(cursor, name, (components, count), kind, false)?;
                return Ok(true);
            }
            "VECTORS" | "NORMALS" => 3,
            "TENSORS" => 9,
            "TENSORS6" => 6,
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => 1,
            _ => return Ok(false),
        };
        let name = name(cursor.expect("a name")?.1);
        let kind = kind(cursor.expect("a type")?.1)?;
        self.take(cursor, name, (fixed, count), kind, keyword == "NORMALS")?;
        Ok(true)
    }

    /// Keeps values of points, and passes over others.
    fn take(
        &mut self,
        cursor: &mut VtkCursor,
        name: String,
        (components, tuples): (usize, usize),
        kind: Kind,
        normals: bool,
    ) -> Result<(), FormatError> {
        let count = components.saturating_mul(tuples);
        let of_points = matches!(self.data_of, Some((true, points)) if points == tuples);
        match kind {
            Kind::Number(kind) if of_points && tuples == self.file.points.len() && count > 0 => {
                let (values, place) = cursor.numbers(count, kind)?;
                self.file.data.push(PointData { name, kind, components, values, place, normals });
                Ok(())
            }
            _ => cursor.skip(count, kind),
        }
    }

    fn finish(mut self, binary: bool) -> Result<Legacy, FormatError> {
        if !self.found {
            return Err(FormatError::truncated("a section POINTS", "none"));
        }
        let points = self.file.points.len();
        for (kind, cells) in &self.lists {
            cells::add_cells(|_| (*kind, None), &cells.ends, &cells.corners, points, &mut self.file.faces)?;
        }
        if let Some(cells) = &self.cells {
            let kinds = |cell: usize| CellKind::of_type(self.types.get(cell).copied().unwrap_or(0.0));
            cells::add_cells(kinds, &cells.ends, &cells.corners, points, &mut self.file.faces)?;
        }
        if let Some([width, height, depth]) = self.dimensions {
            let all = width.checked_mul(height).and_then(|n| n.checked_mul(depth));
            if all != Some(points) {
                let announced = format!("a grid of {width} x {height} x {depth}");
                return Err(FormatError::truncated(announced, format!("{points} points")));
            }
            self.file.grid = (depth == 1 && width > 1 && height > 1).then_some([width, height]);
        }
        self.file.binary = binary;
        Ok(self.file)
    }
}

fn cell_list(cursor: &mut VtkCursor) -> Result<Cells, FormatError> {
    let count = cursor.count("the number of cells")?;
    let size = cursor.count("the size of the cells")?;
    if cursor.peeks(b"OFFSETS") {
        // Since version 5: the first number counts the offsets, the second the corners.
        let mut part = |keyword: &str, count: usize| {
            let (_, word) = cursor.expect(keyword)?;
            if !word.eq_ignore_ascii_case(keyword.as_bytes()) {
                return Err(FormatError::Content(format!("{} where {keyword} is expected", quote(word))));
            }
            let Kind::Number(kind) = kind(cursor.expect("a type")?.1)? else {
                return Err(FormatError::Content(format!("{keyword} that are no numbers")));
            };
            Ok(cursor.numbers(count, kind)?.0)
        };
        let offsets = part("OFFSETS", count)?;
        let corners = part("CONNECTIVITY", size)?;
        return Ok(Cells { ends: offsets.get(1..).unwrap_or_default().to_vec(), corners });
    }
    let (all, _) = cursor.numbers(size, Scalar::I32)?;
    let mut cells = Cells { ends: Vec::new(), corners: Vec::new() };
    let mut rest = &all[..];
    for _ in 0..count {
        let Some((&corners, after)) = rest.split_first() else { break };
        let taken = if corners >= 0.0 { after.get(..corners as usize) } else { None };
        let Some(taken) = taken else {
            let problem = format!("a cell of {corners} corners where {} are left", after.len());
            return Err(FormatError::Content(problem));
        };
        cells.corners.extend_from_slice(taken);
        cells.ends.push(cells.corners.len() as f64);
        rest = &after[taken.len()..];
    }
    if cells.ends.len() != count {
        return Err(FormatError::truncated(format!("{count} cells"), cells.ends.len().to_string()));
    }
    Ok(cells)
}
