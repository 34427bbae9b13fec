use npyz::WriterBuilder;

use super::*;
use crate::io::testing::{moved_copy, points_of};

/// Arrays written by an independent implementation.
fn array<T: npyz::AutoSerialize + Copy>(shape: &[u64], order: npyz::Order, data: &[T]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .order(order)
        .writer(&mut bytes)
        .begin_nd()
        .unwrap();
    writer.extend(data.iter().copied()).unwrap();
    writer.finish().unwrap();
    bytes
}

fn with_header(text: &str, body: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes.extend(body);
    bytes
}

#[test]
fn orders_types_and_widths() {
    let expected = vec![[0.0, 1.0, 2.0], [4.0, 5.0, 6.0]];
    let c: Vec<f32> = (0..8).map(|v| v as f32).collect();
    assert_eq!(points_of(&Npy, &array(&[2, 4], npyz::Order::C, &c)).unwrap(), expected);
    let f: Vec<i32> = vec![0, 4, 1, 5, 2, 6];
    assert_eq!(points_of(&Npy, &array(&[2, 3], npyz::Order::Fortran, &f)).unwrap(), expected);
    let i: Vec<i64> = vec![0, 1, 2, 4, 5, 6];
    assert_eq!(points_of(&Npy, &array(&[2, 3], npyz::Order::C, &i)).unwrap(), expected);
}

#[test]
fn fields_and_big_endian_numbers() {
    let text = "{'descr': [('i', '|u1'), ('z', '>f4'), (\"x\", '<f8'), ('y', '>i2')],\n 'fortran_order': False, 'shape': (1,)}";
    let mut body = vec![7];
    body.extend(2.5f32.to_be_bytes());
    body.extend(0.1f64.to_le_bytes());
    body.extend((-3i16).to_be_bytes());
    assert_eq!(points_of(&Npy, &with_header(text, &body)).unwrap(), [[0.1, -3.0, 2.5]]);
    let motion = Rigid { translation: [0.0, 0.5, 0.0].into(), ..Rigid::identity() };
    let mut copy = Vec::new();
    moved_copy(&Npy, &with_header(text, &body), &motion, &mut copy).unwrap();
    assert_eq!(points_of(&Npy, &copy).unwrap(), [[0.1, -2.5, 2.5]], "the integer became a double");
    assert_eq!(copy[copy.len() - 25], 7, "and the other field is still there");
}

#[test]
fn a_header_like_that_of_numpy() {
    let mut ours = Vec::new();
    Npy.write_cloud(&Outgoing::of_points(&[[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]), &mut ours).unwrap();
    let read = npyz::NpyFile::new(&ours[..]).unwrap();
    assert_eq!((read.shape(), (ours.len() - 48) % 64), (&[2, 3][..], 0));
    assert_eq!(read.into_vec::<f64>().unwrap(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn bad_arrays() {
    let good = array(&[2, 3], npyz::Order::C, &[0.0f64; 6]);
    for length in 0..good.len() {
        assert!(points_of(&Npy, &good[..length]).is_err(), "{length}");
    }
    assert!(points_of(&Npy, &[&good[..], &[0]].concat()).is_err());
    assert!(points_of(&Npy, &array(&[6], npyz::Order::C, &[0.0f64; 6])).is_err());
    let error = points_of(&Npy, &array(&[3, 2], npyz::Order::C, &[0.0f64; 6])).unwrap_err().to_string();
    assert!(error.contains("[3, 2]") && error.contains("transpose"), "{error}");
    for (text, fact) in [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904, 3), }", "no memory"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000, 3), }", "announced"),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 1000000000000000000), }", ""),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (1, 3), }", "holds Python objects"),
        ("{'descr': [('x', '<f8', (3,))], 'fortran_order': False, 'shape': (1,), }", "announced"),
        ("{'shape': (1, 3)}", "lacks"),
        ("{'descr': '<f8", "end of a string"),
    ] {
        let read = points_of(&Npy, &with_header(text, &[]));
        if fact.is_empty() {
            assert_eq!(read, Ok(vec![]));
        } else {
            let error = read.unwrap_err().to_string();
            assert!(error.contains(fact), "{error}");
        }
    }
    let deep = "(".repeat(60_000);
    assert!(points_of(&Npy, &with_header(&format!("{{'shape': {deep}"), &[])).is_err());
}

#[test]
fn attributes_are_fields() {
    use crate::io::AttributeValues as V;
    let attributes = [
        ("red", V::U8(vec![255, 7])),
        ("label", V::I64(vec![(1 << 53) + 1, -4])),
        ("it's", V::F32(vec![0.5, 1.0])),
    ]
    .map(|(name, values)| Attribute { name: name.into(), values });
    let points = [[1.0, 2.0, 3.0], [4.0, 5.5, -6.0]];
    let mut bytes = Vec::new();
    Npy.write_cloud(&Outgoing { attributes: &attributes, ..Outgoing::of_points(&points) }, &mut bytes)
        .unwrap();
    let header = String::from_utf8_lossy(&bytes[10..]).into_owned();
    assert!(header.starts_with(
        "{'descr': [('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('red', '<u1'), ('label', '<i8'), ('it_s', '<f4')], \
         'fortran_order': False, 'shape': (2,), }"
    ), "{header}");
    assert_eq!(points_of(&Npy, &bytes).unwrap(), points);
    let found = Npy.attributes(&bytes, &ReadOptions::default()).unwrap();
    assert_eq!((found.len(), &found[..2]), (3, &attributes[..2]));
    assert_eq!((found[2].name.as_str(), &found[2].values), ("it_s", &attributes[2].values));
}
