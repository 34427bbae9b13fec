use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use nalgebra::Rotation3;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::*;
use crate::io::testing::points_of;

const POINTS: [[f64; 3]; 5] =
    [[0.0, 0.5, 0.25], [1.0, 0.0, -2.5], [1.0, 1.0, 0.0], [0.0, 1.0, 3.0], [7.0, 8.0, 1e-3]];
const FACES: [[u32; 3]; 3] = [[0, 1, 2], [0, 2, 3], [4, 0, 1]];

fn contents(format: &dyn CloudFormat, bytes: &[u8]) -> Result<Contents, FormatError> {
    format.read(bytes, &ReadOptions::default())
}

/// Numbers in big endian or as text.
fn put<T: ToString>(file: &mut Vec<u8>, binary: bool, values: &[T], bytes: impl Fn(&T) -> Vec<u8>) {
    for value in values {
        if binary {
            file.extend(bytes(value));
        } else {
            file.extend(format!("{} ", value.to_string()).into_bytes());
        }
    }
    file.push(b'\n');
}

/// A quad and a triangle with colours, normals, a field and cell values around them, as VTK writes it.
fn polydata(binary: bool, version5: bool) -> Vec<u8> {
    let kind = if binary { "BINARY" } else { "ASCII" };
    let mut file =
        format!("# vtk DataFile Version {}\nmade here\n{kind}\n", if version5 { "5.1" } else { "3.0" })
            .into_bytes();
    let text = |file: &mut Vec<u8>, text: &str| file.extend(text.as_bytes());
    text(&mut file, "DATASET POLYDATA\nFIELD FieldData 1\nTimeValue 1 1 double\n");
    put(&mut file, binary, &[0.5f64], |v| v.to_be_bytes().to_vec());
    text(&mut file, "POINTS 5 float\n");
    let coordinates: Vec<f32> = POINTS.iter().flatten().map(|&c| c as f32).collect();
    put(&mut file, binary, &coordinates, |v| v.to_be_bytes().to_vec());
    text(&mut file, "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 9\n\n");
    let int = |v: &i32| v.to_be_bytes().to_vec();
    let long = |v: &i64| v.to_be_bytes().to_vec();
    if version5 {
        text(&mut file, "POLYGONS 3 7\nOFFSETS vtktypeint64\n");
        put(&mut file, binary, &[0i64, 4, 7], long);
        text(&mut file, "CONNECTIVITY vtktypeint64\n");
        put(&mut file, binary, &[0i64, 1, 2, 3, 4, 0, 1], long);
    } else {
        text(&mut file, "POLYGONS 2 9\n");
        put(&mut file, binary, &[4, 0, 1, 2, 3, 3, 4, 0, 1], int);
    }
    text(&mut file, "CELL_DATA 2\nSCALARS id int 1\nLOOKUP_TABLE default\n");
    put(&mut file, binary, &[7, 8], int);
    text(&mut file, "POINT_DATA 5\nNORMALS normals float\n");
    let normals: Vec<f32> = [1.0, 0.0, 0.0].repeat(5);
    put(&mut file, binary, &normals, |v| v.to_be_bytes().to_vec());
    text(&mut file, "SCALARS intensity%20%25 unsigned_short\nLOOKUP_TABLE default\n");
    put(&mut file, binary, &[1u16, 2, 3, 4, 500], |v| v.to_be_bytes().to_vec());
    text(&mut file, "FIELD more 1\nRGB 3 5 unsigned_char\n");
    put(&mut file, binary, &(0u8..15).collect::<Vec<_>>(), |&v| vec![v]);
    file
}

#[test]
fn legacy_files_in_text_and_binary() {
    for (binary, version5) in [(false, false), (true, false), (false, true), (true, true)] {
        let bytes = polydata(binary, version5);
        assert!(Vtk.recognises(&bytes));
        let read = contents(&Vtk, &bytes).unwrap();
        let single = POINTS.map(|point| point.map(|c| f64::from(c as f32)));
        let single = if binary { single } else { POINTS };
        assert_eq!(read.points, single, "binary {binary}, version 5 {version5}");
        assert_eq!((read.faces.as_slice(), read.single, read.notes), (&FACES[..], true, vec![]));
        let attributes = Vtk.attributes(&bytes, &ReadOptions::default()).unwrap();
        let names: Vec<&str> = attributes.iter().map(|attribute| attribute.name.as_str()).collect();
        assert_eq!(names, ["nx", "ny", "nz", "intensity %", "red", "green", "blue"]);
        assert_eq!(attributes[3].values, crate::io::AttributeValues::U16(vec![1, 2, 3, 4, 500]));
        assert_eq!(attributes[5].values, crate::io::AttributeValues::U8(vec![1, 4, 7, 10, 13]));
        for cut in (0..bytes.len() - 40).step_by(13) {
            let read = points_of(&Vtk, &bytes[..cut]);
            // The last number of a text that is cut short may be a shorter one.
            assert!(!binary || read.is_err() || read.unwrap() == single, "{cut}");
        }
    }
}

#[test]
fn grids_and_cells() {
    let grid = "# vtk DataFile Version 2.0\n\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS 2 3 1\nPOINTS 6 double\n\
                0 0 0 1 0 0\n0 1 0 1 1 0\n0 2 0 1 2 0\nPOINT_DATA 6\nTEXTURE_COORDINATES t 2 float\n";
    let grid = format!("{grid}0 0 1 0 0 1 1 1 0 2 1 2\n");
    let read = contents(&Vtk, grid.as_bytes()).unwrap();
    assert_eq!((read.points[5], read.grid, read.single), ([1.0, 2.0, 0.0], Some([2, 3]), false));
    let wrong = contents(&Vtk, grid.replace("2 3 1", "2 2 1").as_bytes()).unwrap_err().to_string();
    assert!(wrong.contains("2 x 2 x 1"), "{wrong}");

    let cells = "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 0 1\n\
                 CELLS 4 17\n3 0 1 2\n4 0 1 2 3\n4 0 1 2 4\n2 0 1\nCELL_TYPES 4\n5 8 10 3\n";
    let read = contents(&Vtk, cells.as_bytes()).unwrap();
    let note = crate::io::Note::LoosePoints { points: 1 };
    assert_eq!((read.faces, read.notes), (vec![[0, 1, 2], [0, 1, 3], [0, 3, 2]], vec![note]));

    let unknown = contents(&Vtk, format!("{cells}SELECTION 1 2\n").as_bytes()).unwrap();
    let what = "all from \"SELECTION\" on".to_owned();
    assert_eq!((unknown.faces.len(), &unknown.notes[1]), (3, &crate::io::Note::Ignored { what }));

    for (from, to, fact) in [
        ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS", "has no points of its own"),
        ("ASCII", "EBCDIC", "neither ASCII nor BINARY"),
        ("3 0 1 2", "3 0 1 9", "names point 9 of 5"),
        ("3 0 1 2", "30 0 1 2", "a cell of 30 corners"),
        ("POINTS 5 float", "POINTS 5 quad", "\"quad\" is no type"),
        ("POINTS 5 float", "POINTS five float", "\"five\" where the number of points"),
        ("POINTS 5 float", "POINTS 99999999999 float", "take"),
        ("# vtk DataFile", "# foo DataFile", "does not begin with"),
    ] {
        let error = contents(&Vtk, cells.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(fact), "{to}: {error}");
    }
}

/// How the arrays of an XML file are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ArrayStorage {
    Text,
    Inline,
    InlineZipped,
    Raw,
    RawZipped,
    AppendedBase64,
}

/// A quad and a triangle with normals and intensities.
fn vtp(kept: ArrayStorage, long: bool, big: bool) -> Vec<u8> {
    let zipped = matches!(kept, ArrayStorage::InlineZipped | ArrayStorage::RawZipped);
    let word = |value: usize| match (long, big) {
        (true, true) => (value as u64).to_be_bytes().to_vec(),
        (true, false) => (value as u64).to_le_bytes().to_vec(),
        (false, true) => (value as u32).to_be_bytes().to_vec(),
        (false, false) => (value as u32).to_le_bytes().to_vec(),
    };
    let mut appended: Vec<u8> = Vec::new();
    let mut array = |kind: &str, name: &str, components: usize, values: &[f64]| {
        let mut bytes = Vec::new();
        for &value in values {
            match kind {
                "Float32" if big => bytes.extend((value as f32).to_be_bytes()),
                "Float32" => bytes.extend((value as f32).to_le_bytes()),
                _ if big => bytes.extend((value as i32).to_be_bytes()),
                _ => bytes.extend((value as i32).to_le_bytes()),
            }
        }
        // Blocks of 24 bytes.
        let (mut header, mut body) = (word(bytes.len()), bytes.clone());
        if zipped {
            let blocks: Vec<Vec<u8>> = bytes
                .chunks(24)
                .map(|block| {
                    let mut zip = ZlibEncoder::new(Vec::new(), Compression::default());
                    zip.write_all(block).unwrap();
                    zip.finish().unwrap()
                })
                .collect();
            header = [word(blocks.len()), word(24), word(bytes.len() % 24)].concat();
            blocks.iter().for_each(|block| header.extend(word(block.len())));
            body = blocks.concat();
        }
        let head = format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        let at = appended.len();
        match kept {
            ArrayStorage::Text => {
                let text: Vec<String> = values.iter().map(f64::to_string).collect();
                return format!("{head} format=\"ascii\">\n{}\n</DataArray>\n", text.join(" "));
            }
            ArrayStorage::Inline => {
                let text = STANDARD.encode([header, body].concat());
                return format!("{head} format=\"binary\">\n  {text}\n</DataArray>");
            }
            ArrayStorage::InlineZipped => {
                let text = STANDARD.encode(header) + &STANDARD.encode(body);
                return format!("{head} format=\"binary\">{text}</DataArray>");
            }
            ArrayStorage::Raw | ArrayStorage::RawZipped => appended.extend([header, body].concat()),
            ArrayStorage::AppendedBase64 => {
                appended.extend(STANDARD.encode([header, body].concat()).into_bytes())
            }
        }
        format!("{head} format=\"appended\" offset=\"{at}\"/>")
    };
    let flat: Vec<f64> = POINTS.iter().flatten().copied().collect();
    let points = array("Float32", "Points", 3, &flat);
    let corners = array("Int32", "connectivity", 1, &[0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 1.0]);
    let offsets = array("Int32", "offsets", 1, &[4.0, 7.0]);
    let normals = array("Float32", "n", 3, &[0.0, 1.0, 0.0].repeat(5));
    let values = array("Int32", "Intensity", 1, &[5.0, 6.0, 7.0, 8.0, 9.0]);
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"{}\"{}{}>\n<PolyData>\n\
         <Piece NumberOfPoints=\"5\" NumberOfPolys=\"2\">\n<PointData Normals=\"n\">{normals}{values}</PointData>\n\
         <Points>{points}</Points>\n<Polys>{corners}{offsets}</Polys>\n</Piece>\n</PolyData>\n",
        if big { "BigEndian" } else { "LittleEndian" },
        if long { " header_type=\"UInt64\"" } else { "" },
        if zipped { " compressor=\"vtkZLibDataCompressor\"" } else { "" },
    )
    .into_bytes();
    if !appended.is_empty() {
        let encoding = if kept == ArrayStorage::AppendedBase64 { "base64" } else { "raw" };
        file.extend(format!("<AppendedData encoding=\"{encoding}\">\n _").into_bytes());
        file.extend(appended);
        file.extend(b"\n</AppendedData>\n");
    }
    file.extend(b"</VTKFile>\n");
    file
}

const KEPT: [ArrayStorage; 6] = [
    ArrayStorage::Text,
    ArrayStorage::Inline,
    ArrayStorage::InlineZipped,
    ArrayStorage::Raw,
    ArrayStorage::RawZipped,
    ArrayStorage::AppendedBase64,
];

#[test]
fn xml_files_of_every_encoding() {
    let single = POINTS.map(|point| point.map(|c| f64::from(c as f32)));
    for kept in KEPT {
        for (long, big) in [(false, false), (true, false), (false, true), (true, true)] {
            let bytes = vtp(kept, long, big);
            assert!(VTP.recognises(&bytes));
            let read = contents(&VTP, &bytes).unwrap();
            let expected = if kept == ArrayStorage::Text { POINTS } else { single };
            assert_eq!(read.points, expected, "{kept:?}, long {long}, big endian {big}");
            assert_eq!((read.faces.as_slice(), read.single), (&FACES[..], true), "{kept:?}");
            let attributes = VTP.attributes(&bytes, &ReadOptions::default()).unwrap();
            let names: Vec<&str> = attributes.iter().map(|attribute| attribute.name.as_str()).collect();
            assert_eq!(names, ["nx", "ny", "nz", "intensity"]);
            assert_eq!(attributes[3].values, crate::io::AttributeValues::I32(vec![5, 6, 7, 8, 9]));
            for cut in (0..bytes.len() - 60).step_by(17) {
                let read = points_of(&VTP, &bytes[..cut]);
                assert!(read.is_err() || read.unwrap() == expected, "{kept:?} {cut}");
            }
        }
    }
}

#[test]
fn what_xml_files_cannot_be() {
    let text = String::from_utf8(vtp(ArrayStorage::Text, false, false)).unwrap();
    for (from, to, fact) in [
        ("type=\"PolyData\"", "type=\"ImageData\"", "has no points of its own"),
        ("NumberOfPoints=\"5\"", "NumberOfPoints=\"6\"", "\"6\" points announced, 5 found"),
        ("4 0 1\n", "5 0 1\n", "names point 5 of 5"),
        ("\n4 7\n", "\n4 9\n", "ends at 9 of 7"),
        (
            "Name=\"Points\" NumberOfComponents=\"3\"",
            "Name=\"Points\" NumberOfComponents=\"2\"",
            "no x, y and z",
        ),
        ("</PolyData>", "</PolyDate>", "the XML is damaged"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = contents(&VTP, text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.contains(fact), "{to}: {error}");
    }
    // What packs arrays says nothing of those that are text.
    let packed = |bytes: Vec<u8>| {
        let place = bytes.windows(5).position(|word| word == b" byte").unwrap();
        let mut packed = bytes;
        packed.splice(place..place, b" compressor=\"otherDataCompressor\"".iter().copied());
        contents(&VTP, &packed)
    };
    assert_eq!(
        packed(text.clone().into_bytes()).unwrap().points,
        contents(&VTP, text.as_bytes()).unwrap().points
    );
    for kept in [ArrayStorage::Inline, ArrayStorage::Raw] {
        let error = packed(vtp(kept, false, false)).unwrap_err().to_string();
        assert!(error.contains("\"otherDataCompressor\" are not supported"), "{error}");
    }
    // Few bytes that ask for many numbers: the same array again and again.
    let mut bytes = vtp(ArrayStorage::Raw, false, false);
    let place = bytes.windows(9).position(|w| w == b"</Points>").unwrap();
    let piece = "</Points></Piece><Piece><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" \
                 format=\"appended\" offset=\"144\"/>"
        .repeat(3000);
    bytes.splice(place..place, piece.into_bytes());
    assert!(contents(&VTP, &bytes).is_err());
}

#[test]
fn what_is_written_reads_back() {
    let points = [[431_234.567, -0.0, 5e-324], [0.1, 0.2, -1e300]];
    for format in [&Vtk as &dyn CloudFormat, &VTP, &VTU] {
        let mut bytes = Vec::new();
        format.write_cloud(&Outgoing::of_points(&points), &mut bytes).unwrap();
        assert!(format.recognises(&bytes));
        let read = contents(format, &bytes).unwrap();
        assert_eq!((read.points.as_slice(), read.single, read.faces), (&points[..], false, vec![]));
    }
    let refused = VTS.write_cloud(&Outgoing::of_points(&points), &mut Vec::new()).unwrap_err().to_string();
    assert!(refused.contains("write .vtp"), "{refused}");
}

#[test]
fn moved_copies_keep_the_rest() {
    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2).into_inner(),
        translation: [10.0, -0.5, 1.0].into(),
    };
    let mut files: Vec<(&dyn CloudFormat, Vec<u8>)> =
        KEPT.iter().map(|&kept| (&VTP as &dyn CloudFormat, vtp(kept, true, false))).collect();
    for binary in [false, true] {
        files.push((&Vtk, polydata(binary, false)));
    }
    for (format, bytes) in files {
        let options = ReadOptions::default();
        let (mut copy, mut same) = (Vec::new(), Vec::new());
        format.rewrite(&bytes, &options, &Rigid::identity(), &mut same).unwrap();
        assert_eq!(same, bytes);
        format.rewrite(&bytes, &options, &motion, &mut copy).unwrap();
        let (old, new) = (contents(format, &bytes).unwrap(), contents(format, &copy).unwrap());
        for (old, new) in old.points.iter().zip(&new.points) {
            let expected = motion.apply(old);
            assert!((0..3).all(|axis| (expected[axis] - new[axis]).abs() < 1e-5), "{expected:?} {new:?}");
        }
        assert_eq!((old.faces, old.points.len()), (new.faces, new.points.len()));
        let attributes = |bytes: &[u8]| format.attributes(bytes, &options).unwrap();
        let (before, after) = (attributes(&bytes), attributes(&copy));
        assert_eq!(before[3..], after[3..]);
        // Normals along x lie along y now, those along y along -x.
        let normal: Vec<f64> = after[..3].iter().map(|n| n.values.get(4).unwrap()).collect();
        let expected = if format.name() == "vtk" { [0.0, 1.0, 0.0] } else { [-1.0, 0.0, 0.0] };
        assert!((0..3).all(|axis| (normal[axis] - expected[axis]).abs() < 1e-6), "{normal:?}");
    }
}

/// Few bytes that say that they unpack to many are refused before any of them is.
#[test]
fn claims_of_packed_arrays_are_checked() {
    let file = |size: u32, blocks: u32| {
        let mut zip = ZlibEncoder::new(Vec::new(), Compression::default());
        zip.write_all(&[0; 36]).unwrap();
        let block = zip.finish().unwrap();
        let header = [blocks, size, 0, block.len() as u32].map(u32::to_le_bytes).concat();
        let mut bytes = b"<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
            compressor=\"vtkZLibDataCompressor\"><PolyData><Piece NumberOfPoints=\"3\"><Points>\
            <DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\
            </Points></Piece></PolyData><AppendedData encoding=\"raw\">_"
            .to_vec();
        bytes.extend([header, block].concat());
        bytes.extend(b"</AppendedData></VTKFile>");
        bytes
    };
    assert_eq!(points_of(&VTP, &file(36, 1)).unwrap(), [[0.0; 3]; 3]);
    let limited = ReadOptions { max_memory: Some(1 << 20), ..ReadOptions::default() };
    let huge = VTP.read(&file(4_000_000_000, 1), &limited).unwrap_err();
    assert!(matches!(huge, FormatError::Memory { needed: 12_000_000_000.., limit: 1_048_576, .. }), "{huge}");
    for (size, blocks) in [(u32::MAX, 1), (36, u32::MAX), (1 << 30, 1)] {
        assert!(points_of(&VTP, &file(size, blocks)).is_err(), "{size} {blocks}");
    }
}
