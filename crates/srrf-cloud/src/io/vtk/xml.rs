//! The XML files of VTK with points: PolyData (`.vtp`), UnstructuredGrid (`.vtu`) and StructuredGrid
//! (`.vts`).

use std::ops::Range;

use roxmltree::{Document, Node, ParsingOptions};

use super::super::scalar::Scalar;
use super::super::scan::quote;
use super::super::{FormatError, ReadOptions};
use super::blocks::{Storage, budget, of_text};
use super::cells::{self, CellKind};
use super::legacy::PointData;

/// What an XML file holds, its pieces one after another.
#[derive(Debug, Default)]
pub(super) struct Xml {
    pub points: Vec<[f64; 3]>,
    /// Whether the coordinates of all pieces are `Float32`.
    pub single: bool,
    pub faces: Vec<[u32; 3]>,
    pub grid: Option<[usize; 2]>,
    pub data: Vec<PointData>,
    pub arrays: Vec<XmlArray>,
}

/// An array that changes in a moved copy.
#[derive(Debug)]
pub(super) struct XmlArray {
    /// Where its element is in the file.
    pub place: Range<usize>,
    pub name: String,
    pub kind: Scalar,
    pub values: Vec<[f64; 3]>,
    pub normals: bool,
}

/// The kinds of data sets with points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum XmlKind {
    PolyData,
    UnstructuredGrid,
    StructuredGrid,
}

impl XmlKind {
    /// As files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::PolyData => "PolyData",
            Self::UnstructuredGrid => "UnstructuredGrid",
            Self::StructuredGrid => "StructuredGrid",
        }
    }
}

/// Whether `bytes` begin as an XML file of VTK of this kind does; those of unknown kinds count as PolyData.
pub(super) fn recognises(bytes: &[u8], kind: XmlKind) -> bool {
    let begin = &bytes[..bytes.len().min(2000)];
    let begin = begin.strip_prefix("\u{feff}".as_bytes()).unwrap_or(begin).trim_ascii_start();
    if !begin.starts_with(b"<VTKFile") && !begin.starts_with(b"<?xml") {
        return false;
    }
    let Some(at) = find(begin, b"<VTKFile") else { return false };
    let tag = begin[at..].split(|&b| b == b'>').next().unwrap_or_default();
    let is = |kind: XmlKind| find(tag, kind.name().as_bytes()).is_some();
    match kind {
        XmlKind::PolyData => !is(XmlKind::UnstructuredGrid) && !is(XmlKind::StructuredGrid),
        other => is(other),
    }
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|window| window == word)
}

/// The XML without the appended data, which need not be XML at all, and that data.
fn split(bytes: &[u8]) -> Result<(String, &[u8]), FormatError> {
    let text = |bytes: &[u8]| {
        let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
        std::str::from_utf8(bytes)
            .map(str::to_owned)
            .map_err(|_| FormatError::Content("the XML is not UTF-8".into()))
    };
    let Some(at) = find(bytes, b"<AppendedData") else { return Ok((text(bytes)?, &[])) };
    let tag = bytes[at..].iter().position(|&b| b == b'>').map(|end| at + end + 1);
    let tag = tag.ok_or_else(|| FormatError::truncated("appended data", "the end of the file"))?;
    let data = &bytes[tag..];
    // The data begins behind an underscore.
    let begin = data.iter().position(|&b| !b.is_ascii_whitespace()).unwrap_or(data.len());
    if data.get(begin) != Some(&b'_') {
        return Err(FormatError::Content("the appended data does not begin with `_`".into()));
    }
    let mut xml = text(&bytes[..tag])?;
    let closed = xml.ends_with("/>");
    xml.push_str(if closed { "</VTKFile>" } else { "</AppendedData></VTKFile>" });
    Ok((xml, &data[begin + 1..]))
}

/// What is read beside points and faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum What {
    Geometry,
    /// The values of points too.
    Data,
    /// The arrays that change in a moved copy too.
    Arrays,
}

/// Reads a file.
///
/// # Errors
/// [`FormatError`] where it is none, is damaged, or is of a kind without points.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, what: What) -> Result<Xml, FormatError> {
    options.check_memory("the XML", bytes.len(), bytes.len().saturating_mul(4))?;
    let (xml, appended) = split(bytes)?;
    let skipped = if bytes.starts_with("\u{feff}".as_bytes()) { 3 } else { 0 };
    let damaged = |e: roxmltree::Error| FormatError::Content(format!("the XML is damaged: {e}"));
    // An element takes far more memory than its shortest text, `<a/>`.
    let nodes_limit = u32::try_from(xml.len() / 16 + 100).unwrap_or(u32::MAX);
    let limits = ParsingOptions { nodes_limit, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&xml, limits).map_err(damaged)?;
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" {
        return Err(FormatError::Content("the XML is not a VTKFile".into()));
    }
    let kind = root.attribute("type").unwrap_or_default();
    if !["PolyData", "UnstructuredGrid", "StructuredGrid"].contains(&kind) {
        return Err(FormatError::Content(format!(
            "a VTKFile of the type {} has no points of its own; save PolyData (.vtp)",
            quote(kind.as_bytes())
        )));
    }
    let packer = root.attribute("compressor").filter(|packer| !packer.is_empty());
    let encoding = child(root, "AppendedData").and_then(|node| node.attribute("encoding"));
    let storage = Storage {
        big_endian: root.attribute("byte_order") == Some("BigEndian"),
        long: root.attribute("header_type") == Some("UInt64"),
        packer,
        appended,
        appended_base64: encoding == Some("base64"),
        budget: budget(bytes.len(), packer.is_some()),
        options,
        held: bytes.len(),
    };
    let body = child(root, kind).ok_or_else(|| FormatError::truncated(format!("a {kind}"), "none"))?;
    let mut file = Xml { single: true, ..Xml::default() };
    let pieces: Vec<Node> = body.children().filter(|node| node.has_tag_name("Piece")).collect();
    for piece in &pieces {
        add_piece(*piece, &storage, &mut file, pieces.len() == 1, what)?;
        options.check_points(bytes.len().saturating_mul(4), file.points.len())?;
    }
    file.single &= !file.points.is_empty();
    file.arrays.iter_mut().for_each(|array| {
        array.place = array.place.start + skipped..array.place.end + skipped;
    });
    Ok(file)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn add_piece(
    piece: Node,
    storage: &Storage,
    file: &mut Xml,
    alone: bool,
    what: What,
) -> Result<(), FormatError> {
    let Some(array) = child(piece, "Points").and_then(|points| child(points, "DataArray")) else {
        return Ok(());
    };
    let (kind, values) = numbers(array, storage)?;
    if values.len() % 3 != 0 || components(array) != 3 {
        return Err(FormatError::Content(format!("{} numbers that are no x, y and z", values.len())));
    }
    let points = values.as_chunks::<3>().0;
    if let Some(count) = piece.attribute("NumberOfPoints")
        && count.trim().parse() != Ok(points.len())
    {
        return Err(FormatError::truncated(
            format!("{} points", quote(count.as_bytes())),
            points.len().to_string(),
        ));
    }
    file.single &= kind == Scalar::F32;
    let mut faces = Vec::new();
    for (list, kind) in [("Polys", CellKind::Polygon), ("Strips", CellKind::Strip)] {
        if let Some((ends, corners)) = child(piece, list).map(|list| cells(list, storage)).transpose()? {
            cells::add_cells(|_| (kind, None), &ends, &corners, points.len(), &mut faces)?;
        }
    }
    if let Some(list) = child(piece, "Cells") {
        let (ends, corners) = cells(list, storage)?;
        let types = named(list, "types").map(|array| numbers(array, storage)).transpose()?;
        let types = types.map(|(_, types)| types).unwrap_or_default();
        let kinds = |cell: usize| CellKind::of_type(types.get(cell).copied().unwrap_or(0.0));
        cells::add_cells(kinds, &ends, &corners, points.len(), &mut faces)?;
    }
    let base = u32::try_from(file.points.len());
    let base = base.map_err(|_| FormatError::Content("more than 4,294,967,295 points".into()))?;
    file.faces.extend(faces.into_iter().map(|face| face.map(|corner| base.saturating_add(corner))));
    file.points.extend_from_slice(points);
    if alone {
        file.grid = piece.attribute("Extent").and_then(|extent| grid(extent, points.len()));
    }
    let moves = |array: Node, kind, values: &[f64], normals| XmlArray {
        place: array.range(),
        name: array.attribute("Name").unwrap_or_default().to_owned(),
        kind,
        values: values.as_chunks::<3>().0.to_vec(),
        normals,
    };
    if what == What::Arrays {
        file.arrays.push(moves(array, kind, &values, false));
    }
    for (array, data) in child(piece, "PointData")
        .filter(|_| what != What::Geometry)
        .map(|list| point_data(list, storage, points.len()))
        .into_iter()
        .flatten()
    {
        if what == What::Arrays && data.normals {
            file.arrays.push(moves(array, data.kind, &data.values, true));
        } else if what == What::Data && alone {
            file.data.push(data);
        }
    }
    Ok(())
}

/// Width and height of a grid with one layer.
fn grid(extent: &str, points: usize) -> Option<[usize; 2]> {
    let bounds: Vec<i64> =
        extent.split_ascii_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let &[a, b, c, d, e, f] = &bounds[..] else { return None };
    let size = |low: i64, high: i64| usize::try_from(high.checked_sub(low)?.checked_add(1)?).ok();
    let [width, height, depth] = [size(a, b)?, size(c, d)?, size(e, f)?];
    let flat = depth == 1 && width > 1 && height > 1 && width.checked_mul(height) == Some(points);
    flat.then_some([width, height])
}

fn named<'a, 'i>(list: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    list.children().find(|array| array.has_tag_name("DataArray") && array.attribute("Name") == Some(name))
}

/// Where the cells of a list end, and their corners.
fn cells(list: Node, storage: &Storage) -> Result<(Vec<f64>, Vec<f64>), FormatError> {
    let array = |name: &str| named(list, name).map(|array| numbers(array, storage)).transpose();
    let (Some((_, ends)), Some((_, corners))) = (array("offsets")?, array("connectivity")?) else {
        return Ok((Vec::new(), Vec::new()));
    };
    Ok((ends, corners))
}

fn components(array: Node) -> usize {
    array.attribute("NumberOfComponents").and_then(|count| count.trim().parse().ok()).unwrap_or(1)
}

fn numbers(array: Node, storage: &Storage) -> Result<(Scalar, Vec<f64>), FormatError> {
    let kind = match array.attribute("type").unwrap_or_default() {
        "Int8" => Scalar::I8,
        "UInt8" => Scalar::U8,
        "Int16" => Scalar::I16,
        "UInt16" => Scalar::U16,
        "Int32" => Scalar::I32,
        "UInt32" => Scalar::U32,
        "Int64" => Scalar::I64,
        "UInt64" => Scalar::U64,
        "Float32" => Scalar::F32,
        "Float64" => Scalar::F64,
        other => {
            let problem = format!("{} is no type of numbers of VTK", quote(other.as_bytes()));
            return Err(FormatError::Content(problem));
        }
    };
    let values = match array.attribute("format") {
        Some("appended") => {
            let offset = array.attribute("offset").and_then(|offset| offset.trim().parse().ok());
            let offset = offset.ok_or_else(|| FormatError::Content("an array without its offset".into()))?;
            storage.appended(offset, kind)?
        }
        Some("binary") => storage.inline(array.text().unwrap_or_default(), kind)?,
        _ => of_text(array.text().unwrap_or_default())?,
    };
    Ok((kind, values))
}

/// The values of points, and the elements that hold them; those that cannot be read are left out.
fn point_data<'a, 'i>(
    list: Node<'a, 'i>,
    storage: &Storage,
    points: usize,
) -> Vec<(Node<'a, 'i>, PointData)> {
    let normals = list.attribute("Normals");
    let mut data = Vec::new();
    for array in list.children().filter(|node| node.has_tag_name("DataArray")) {
        let Ok((kind, values)) = numbers(array, storage) else { continue };
        let components = components(array);
        if components.checked_mul(points) == Some(values.len()) && !values.is_empty() {
            let name = array.attribute("Name").unwrap_or_default().to_owned();
            let normals = components == 3 && (normals == Some(&name) || name == "Normals");
            data.push((array, PointData { name, kind, components, values, place: 0..0, normals }));
        }
    }
    data
}
