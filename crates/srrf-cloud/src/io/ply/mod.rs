//! PLY, the Stanford polygon format: text, and binary of both byte orders.

mod attributes;
mod body;
mod cursor;
mod faces;
mod foreign;
mod header;
mod rewrite;

use std::io::{self, Write};

use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions};
use crate::Rigid;

/// PLY files; the points are the `x`, `y` and `z` of the element `vertex`, whatever else it and the
/// other elements hold. Written as binary little endian, in the precision that is asked for. A moved copy keeps
/// faces, colours and all other properties as they are; normals (`nx`, `ny`, `nz`) are turned.
pub(super) struct Ply;

impl CloudFormat for Ply {
    fn name(&self) -> &'static str {
        "ply"
    }

    fn extensions(&self) -> &[&'static str] {
        &["ply"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        body::read(bytes, options)
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        attributes::read(bytes, options)
    }

    fn left_out(&self, bytes: &[u8], _: &ReadOptions) -> Result<Vec<String>, FormatError> {
        attributes::left_out(bytes)
    }

    fn keeps(&self, attribute: &Attribute, _: &Outgoing<'_>) -> bool {
        attributes::keeps(attribute)
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        attributes::write(cloud, out)
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        rewrite::rewrite(bytes, options, motion, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::{moved_copy, points_of};

    const POINTS: [[f64; 3]; 2] = [[1.5, -2.0, 0.25], [4.0, 5.0, -6.5]];

    fn header(format: &str) -> String {
        format!(
            "ply\r\nformat {format} 1.0\ncomment a face before the vertices\nelement face 1\n\
             property list uchar short vertex_indices\nelement vertex 2\nproperty uchar red\n\
             property float y\nproperty float x\nproperty double z\nelement edge 9\nproperty int a\nend_header\n"
        )
    }

    fn binary(big_endian: bool) -> Vec<u8> {
        let mut bytes =
            header(if big_endian { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |value: &[u8]| {
            let mut value = value.to_vec();
            if big_endian {
                value.reverse();
            }
            bytes.extend(value);
        };
        put(&[3]);
        [0i16, 1, 0].iter().for_each(|i| put(&i.to_le_bytes()));
        for [x, y, z] in POINTS {
            put(&[200]);
            put(&(y as f32).to_le_bytes());
            put(&(x as f32).to_le_bytes());
            put(&z.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn three_encodings() {
        let text = format!("{}3 0 1 0\n200 -2 1.5 0.25\n200 5 4\n -6.5\n", header("ascii"));
        assert_eq!(points_of(&Ply, text.as_bytes()).unwrap(), POINTS);
        assert_eq!(points_of(&Ply, &binary(false)).unwrap(), POINTS);
        assert_eq!(points_of(&Ply, &binary(true)).unwrap(), POINTS);
    }

    #[test]
    fn files_cut_short() {
        for big_endian in [false, true] {
            let whole = binary(big_endian);
            for length in 0..whole.len() {
                assert!(points_of(&Ply, &whole[..length]).is_err(), "{length}");
            }
        }
        let error = points_of(&Ply, &binary(false)[..binary(false).len() - 1]).unwrap_err().to_string();
        assert!(error.contains("2 elements `vertex` announced, 1 found"), "{error}");
    }

    #[test]
    fn headers_that_lie() {
        let head = |body: &str| format!("ply\nformat binary_little_endian 1.0\n{body}\nend_header\n");
        let error = |body: &str| points_of(&Ply, head(body).as_bytes()).unwrap_err().to_string();
        let axes = "property float x\nproperty float y\nproperty float z";
        assert!(error(&format!("element vertex 18446744073709551615\n{axes}")).contains("cut short"));
        assert!(error(&format!("element vertex -3\n{axes}")).contains("line 3"));
        assert!(error("element vertex 3\nproperty float x\nproperty float y").contains("lacks"));
        assert!(error("element face 0\nproperty list uchar int i").contains("no element `vertex`"));
        assert!(error("property float x").contains("line 3"));
        assert!(
            error("element vertex 3\nproperty list quad int x").contains("line 4: \"quad\" is not a type")
        );
        // Rows without properties would be free of bytes: they are passed over.
        assert!(
            error(&format!("element ghost 18446744073709551615\nelement vertex 9\n{axes}")).contains("cut")
        );
        assert!(points_of(&Ply, b"solid").is_err() && points_of(&Ply, b"").is_err());
        assert!(points_of(&Ply, b"ply\nelement vertex 0\nend_header\n").is_err());
    }

    #[test]
    fn a_moved_copy_keeps_the_rest() {
        let motion = Rigid {
            rotation: nalgebra::Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            translation: [0.25, 1e6 + 0.1, 0.0].into(),
        };
        let copy = |bytes: &[u8], motion: &Rigid| {
            let mut out = Vec::new();
            moved_copy(&Ply, bytes, motion, &mut out).unwrap();
            out
        };
        let text = "ply\r\nformat ascii 1.0\nelement vertex 2\nproperty float nz\nproperty float x\nproperty float ny\n\
                    property float y\nproperty uchar red\nproperty float nx\nproperty int z\nelement face 1\n\
                    property list uchar int vertex_indices\nend_header\n0 1.50 0 -2 7 1.0 3\r\n1 nan 0 5 8  0 9\n2 0 1\n";
        let expected =
            text.replace("float y", "double y").replace("0 1.50 0 -2 7 1.0 3", "0 2.25 1 1000001.6 7 0 3");
        assert_eq!(String::from_utf8(copy(text.as_bytes(), &motion)).unwrap(), expected);
        for bytes in [binary(false), binary(true)] {
            assert_eq!(copy(&bytes, &Rigid::identity()), bytes);
            let moved = copy(&bytes, &motion);
            assert_eq!(points_of(&Ply, &moved).unwrap(), POINTS.map(|p| motion.apply(&p)));
            // y became a double in each of two rows; the word `double` is longer by one letter.
            assert_eq!(moved.len(), bytes.len() + 2 * 4 + 1);
            assert_eq!(copy(&moved, &motion.inverse()).len(), moved.len());
        }
    }

    #[test]
    fn types_that_ply_does_not_have() {
        use crate::io::{AttributeValues as V, Note};
        let head = |format: &str, property: &str, rest: &str| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty {property}\nproperty float y\n\
                 property float z\n{rest}end_header\n"
            )
        };
        let binary = |property: &str, value: &[u8], faces: bool| {
            let list = "element face 1\nproperty list uchar int vertex_indices\n";
            let mut bytes =
                head("binary_little_endian", property, if faces { list } else { "" }).into_bytes();
            for [x, y, z] in POINTS.map(|p| p.map(|c| c as f32)) {
                bytes.extend(x.to_le_bytes());
                bytes.extend(value);
                bytes.extend([y, z].map(f32::to_le_bytes).concat());
            }
            if faces {
                bytes.push(3);
                bytes.extend([0i32, 1, 0].map(i32::to_le_bytes).concat());
            }
            bytes
        };
        let options = ReadOptions::default();
        for faces in [false, true] {
            for (property, value, values) in [
                ("bool b", &[1][..], V::U8(vec![1; 2])),
                ("long b", &7i32.to_le_bytes(), V::I32(vec![7; 2])),
                ("long b", &(-7i64).to_le_bytes(), V::I64(vec![-7; 2])),
                ("ulong b", &9u64.to_le_bytes(), V::U64(vec![9; 2])),
                ("half b", &0x3c00u16.to_le_bytes(), V::F32(vec![1.0; 2])),
            ] {
                let bytes = binary(property, value, faces);
                let contents = Ply.read(&bytes, &options).unwrap();
                assert_eq!((&contents.points[..], contents.notes.len()), (&POINTS[..], 0), "{property}");
                assert_eq!(Ply.attributes(&bytes, &options).unwrap()[0].values, values, "{property}");
            }
            for size in [1, 2, 4, 8] {
                let bytes = binary("quad b", &vec![9; size], faces);
                let contents = Ply.read(&bytes, &options).unwrap();
                assert_eq!(contents.points, POINTS);
                let [Note::Ignored { what }] = &contents.notes[..] else { panic!("{:?}", contents.notes) };
                assert_eq!(what, "the property `b`, whose type `quad` PLY does not have");
                assert_eq!(Ply.attributes(&bytes, &options), Ok(vec![]));
                assert_eq!(Ply.left_out(&bytes, &options), Ok(vec!["b".to_owned()]));
            }
        }
        let text = format!("{}1.5 many -2 0.25\n4 few 5 -6.5\n", head("ascii", "string b", ""));
        let contents = Ply.read(text.as_bytes(), &options).unwrap();
        assert_eq!((&contents.points[..], contents.notes.len()), (&POINTS[..], 1));
        // Nothing tells the size, or it is the place.
        for (bytes, facts) in [
            (
                binary("quad b", &[9; 3], false),
                ["`b` of the element `vertex` has the type `quad`", "no size of it fits"],
            ),
            (
                binary("long b", &[9; 2], true),
                ["`b` of the element `vertex` has the type `long`", "leave that property out"],
            ),
            (
                binary("float b\nproperty quad c\nproperty trio d", &[9; 6], true),
                ["`c` of", "one more such type"],
            ),
        ] {
            let error = Ply.read(&bytes, &options).unwrap_err().to_string();
            assert!(facts.iter().all(|fact| error.contains(fact)), "{error}");
        }
        let place = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty quad x\nproperty float y\n\
                     property float z\nend_header\n";
        let error = Ply.read(&[place.as_bytes(), &[0; 16]].concat(), &options).unwrap_err().to_string();
        assert!(error.contains("the coordinate `x` has the type `quad`"), "{error}");
        let empty = head("binary_little_endian", "quad b", "").replace("vertex 2", "vertex 0");
        let error = Ply.read(empty.as_bytes(), &options).unwrap_err().to_string();
        assert!(error.contains("several sizes of it fit"), "{error}");
    }

    #[test]
    fn rows_that_are_too_many() {
        let text = format!("{}3 0 1 0\n200 -2 1.5 0.25\n200 5 4 -6.5\n", header("ascii"));
        let (start, end) = text.split_once("element edge").unwrap();
        let body = end.split_once("end_header\n").unwrap().1;
        let only = format!("{start}end_header\n{body}");
        assert_eq!(points_of(&Ply, only.as_bytes()).unwrap(), POINTS);
        let error = points_of(&Ply, format!("{only}200 5 4 -6.5\n").as_bytes()).unwrap_err().to_string();
        assert!(error.contains("more rows follow"), "{error}");
    }
}
