use super::*;
use crate::io::testing::{moved_copy, points_of};

const HEAD: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS normal_y rgb z hist x normal_x normal_z y\nSIZE 4 4 8 2 4 4 4 2\n\
                    TYPE F U F U F F F I\nCOUNT 1 1 1 2 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";
const POINTS: [[f64; 3]; 2] = [[1.5, -2.0, 0.1], [4.0, 5.0, -6.5]];

/// The columns of each field, as bytes of each point.
fn columns() -> Vec<Vec<Vec<u8>>> {
    let f4 = |values: [f64; 2]| values.map(|v| (v as f32).to_le_bytes().to_vec()).to_vec();
    vec![
        f4([0.0, 1.0]),
        vec![vec![1, 2, 3, 4], vec![5, 6, 7, 8]],
        POINTS.map(|p| p[2].to_le_bytes().to_vec()).to_vec(),
        vec![vec![9, 8, 7, 6], vec![5, 4, 3, 2]],
        f4(POINTS.map(|p| p[0])),
        f4([1.0, 0.0]),
        f4([0.0, 0.0]),
        POINTS.map(|p| (p[1] as i16).to_le_bytes().to_vec()).to_vec(),
    ]
}

fn binary() -> Vec<u8> {
    let mut bytes = format!("{HEAD}DATA binary\n").into_bytes();
    (0..2).for_each(|point| columns().iter().for_each(|column| bytes.extend(&column[point])));
    bytes
}

fn compressed() -> Vec<u8> {
    let body: Vec<u8> = columns().into_iter().flatten().flatten().collect();
    let packed = lzf::compress(&body);
    let mut bytes = format!("{HEAD}DATA binary_compressed\n").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend((body.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

fn ascii() -> Vec<u8> {
    format!("{HEAD}DATA ascii\n0 1 0.1 8 9 1.5 1 0 -2\r\n1 5 -6.5 4 5 4 0 0 5\n").into_bytes()
}

#[test]
fn three_encodings() {
    for bytes in [ascii(), binary(), compressed()] {
        assert!(Pcd.recognises(&bytes));
        assert_eq!(points_of(&Pcd, &bytes).unwrap(), POINTS);
    }
}

/// Written by the Point Cloud Library's rules by hand: LZF of 12 bytes in one plain run.
#[test]
fn a_compressed_file_by_hand() {
    let mut bytes = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA binary_compressed\n".to_vec();
    bytes.extend([13, 0, 0, 0, 12, 0, 0, 0, 11]);
    [1.0f32, 2.0, 3.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    assert_eq!(points_of(&Pcd, &bytes).unwrap(), [[1.0, 2.0, 3.0]]);
}

#[test]
fn a_moved_copy_keeps_the_rest() {
    let motion = Rigid {
        rotation: nalgebra::Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        translation: [0.25, 0.5, 0.0].into(),
    };
    let expected = POINTS.map(|p| motion.apply(&p));
    for bytes in [ascii(), binary(), compressed()] {
        let mut same = Vec::new();
        moved_copy(&Pcd, &bytes, &Rigid::identity(), &mut same).unwrap();
        assert_eq!(same, bytes);
        let mut copy = Vec::new();
        moved_copy(&Pcd, &bytes, &motion, &mut copy).unwrap();
        assert_eq!(points_of(&Pcd, &copy).unwrap(), expected);
        let head = header::PcdHeader::parse(&copy).unwrap();
        let sizes: Vec<usize> = head.fields.iter().map(header::Field::bytes).collect();
        assert_eq!(sizes, [4, 4, 8, 4, 4, 4, 4, 8], "y needs a fraction now; x does not need more");
        if head.encoding != header::PcdEncoding::Ascii {
            let table = body::PcdTable::new(&copy, &head, &ReadOptions::default()).unwrap();
            let normals = table.triples(&head, head.triple(["normal_x", "normal_y", "normal_z"]).unwrap());
            assert_eq!(normals, [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]);
            let at = table.place(3, 1);
            assert_eq!(&table.bytes[at..at + 4], &[5, 4, 3, 2]);
        } else {
            let text = String::from_utf8(copy).unwrap();
            assert!(
                text.ends_with("ascii\n1 1 0.1 8 9 2.25 0 0 2\r\n0 5 -6.5 4 5 -4.75 -1 0 4.5\n"),
                "{text}"
            );
        }
    }
}

#[test]
fn files_cut_short() {
    for bytes in [ascii(), binary(), compressed()] {
        for length in 0..bytes.len() - 2 {
            assert!(points_of(&Pcd, &bytes[..length]).is_err(), "{length}");
        }
    }
    let error = points_of(&Pcd, &binary()[..binary().len() - 1]).unwrap_err().to_string();
    assert!(error.contains("2 points of 34 bytes announced"), "{error}");
}

#[test]
fn headers_that_lie() {
    let error = |from: &str, to: &str, bytes: Vec<u8>| {
        let text: Vec<u8> = bytes.iter().map(|&b| if b.is_ascii() { b } else { 0 }).collect();
        let at = String::from_utf8(text).unwrap().find(from).unwrap();
        let changed = [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat();
        points_of(&Pcd, &changed).unwrap_err().to_string()
    };
    assert!(error("WIDTH 2", "WIDTH 3", ascii()).contains("must agree"));
    assert!(error("SIZE 4 4", "SIZE 4", ascii()).contains("SIZE has 7 words"));
    assert!(error("TYPE F", "TYPE Q", ascii()).contains("type \"Q\""));
    assert!(error(" x ", " w ", ascii()).contains("lacks x"));
    assert!(error("DATA ascii", "DATA text", ascii()).contains("line 11"));
    assert!(error("0 1 0.1", "0 0.1", ascii()).contains("line 12: 8 words where 9"));
    assert!(error("0.1", "0,1", ascii()).contains("with a point"));
    let huge =
        "WIDTH 1000000000000000000\nHEIGHT 1\nPOINTS 1000000000000000000\nCOUNT 1 1 1 4294967296 1 1 1 1";
    for bytes in [ascii(), binary(), compressed()] {
        let lie = error("WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2", huge, bytes);
        assert!(lie.contains("announced") || lie.contains("words"), "{lie}");
    }
    assert!(error("POINTS 2", "WIDTH 1\nPOINTS 1", binary()).contains("correct POINTS"));
}
