use super::*;
use crate::io::testing::points_of;

const POINTS: [[f64; 3]; 4] = [
    [431_234.567, 4_812_345.678, 12.5],
    [431_250.0, 4_812_300.25, 90.125],
    [431_234.001, 4_812_345.0, -3.5],
    [431_240.0, 4_812_320.0, 0.0],
];

fn written(format: &dyn CloudFormat, points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    format.write_cloud(&Outgoing::of_points(points), &mut bytes).unwrap();
    bytes
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A file of version 1.4 with 64-bit counts, points of format 7 with colours, one extra byte, and an
/// extended record behind the points.
fn version_1_4() -> Vec<u8> {
    let mut bytes = vec![0; 375];
    bytes[..4].copy_from_slice(b"LASF");
    bytes[24..26].copy_from_slice(&[1, 4]);
    bytes[94..96].copy_from_slice(&375u16.to_le_bytes());
    bytes[96..100].copy_from_slice(&375u32.to_le_bytes());
    bytes[104] = 7;
    bytes[105..107].copy_from_slice(&37u16.to_le_bytes());
    bytes[247..255].copy_from_slice(&(POINTS.len() as u64).to_le_bytes());
    let axes = [0, 1, 2].map(|axis| LasAxis { scale: 0.001, offset: POINTS[3][axis] });
    header::put_axes(&mut bytes, &axes, &POINTS);
    for (index, point) in POINTS.iter().enumerate() {
        let mut record = [index as u8 + 1; 37];
        put_points(std::slice::from_ref(point), &axes, 37, &mut record);
        bytes.extend(record);
    }
    let at = bytes.len() as u64;
    bytes[235..243].copy_from_slice(&at.to_le_bytes());
    bytes[243..247].copy_from_slice(&1u32.to_le_bytes());
    bytes.extend(b"an extended record, as far as anybody here knows");
    bytes
}

/// The same, compressed in layers.
fn version_1_4_zipped() -> Vec<u8> {
    let plain = version_1_4();
    let items = laz::LazItemRecordBuilder::default_for_point_format_id(7, 1).unwrap();
    let vlr = laz::LazVlr::from_laz_items(items);
    let content = laz_record::vlr_bytes(&vlr).unwrap();
    let mut bytes = plain[..375].to_vec();
    bytes[104] |= 0x80;
    bytes[100..104].copy_from_slice(&1u32.to_le_bytes());
    let mut record = vec![0; 54];
    header::put_word(&mut record, 2, b"laszip encoded");
    header::put_word(&mut record, 18, &22204u16.to_le_bytes());
    header::put_word(&mut record, 20, &(content.len() as u16).to_le_bytes());
    bytes.extend(record);
    bytes.extend(content);
    let points_at = bytes.len() as u32;
    bytes[96..100].copy_from_slice(&points_at.to_le_bytes());
    zipped::compress(&mut bytes, vlr, &plain[375..375 + 4 * 37]).unwrap();
    let at = bytes.len() as u64;
    bytes[235..243].copy_from_slice(&at.to_le_bytes());
    bytes.extend(&plain[375 + 4 * 37..]);
    bytes
}

#[test]
fn written_clouds_keep_a_billionth_of_their_size() {
    for format in [&LAS as &dyn CloudFormat, &LAZ] {
        let bytes = written(format, &POINTS);
        assert!(format.recognises(&bytes));
        assert!(distance(&points_of(format, &bytes).unwrap(), &POINTS) < 1e-7);
        assert_eq!(points_of(format, &written(format, &[[1e6, -2.5, 0.0]])).unwrap(), [[1e6, -2.5, 0.0]]);
        assert!(
            format
                .write_cloud(&Outgoing::of_points(&[[1e300, 0.0, 0.0], [0.0; 3]]), &mut Vec::new())
                .is_err()
        );
    }
    assert!(!LAS.recognises(&written(&LAZ, &POINTS)));
    let many: Vec<[f64; 3]> = (0..60_001).map(|i| [f64::from(i) * 0.01, f64::from(i % 7), 1.0]).collect();
    let bytes = written(&LAZ, &many);
    assert!(bytes.len() < many.len() * 6 && distance(&points_of(&LAZ, &bytes).unwrap(), &many) < 1e-6);
}

#[test]
fn a_moved_copy_keeps_the_rest() {
    let motion = Rigid {
        rotation: nalgebra::Rotation3::from_euler_angles(0.1, -0.2, 0.3).into_inner(),
        translation: [1000.0, -2000.0, 5.0].into(),
    };
    for bytes in [version_1_4(), version_1_4_zipped(), written(&LAS, &POINTS), written(&LAZ, &POINTS)] {
        let old = points_of(&LAS, &bytes).unwrap();
        assert!(distance(&old, &POINTS) < 1e-3);
        let new: Vec<[f64; 3]> = old.iter().map(|p| motion.apply(p)).collect();
        let copy = rewritten(&bytes, &ReadOptions::default(), &motion).unwrap();
        assert!(distance(&points_of(&LAS, &copy).unwrap(), &new) <= 0.000_011);
        assert_eq!(rewritten(&bytes, &ReadOptions::default(), &Rigid::identity()).unwrap(), bytes);
        let (before, after) = (LasHeader::parse(&bytes).unwrap(), LasHeader::parse(&copy).unwrap());
        let (a, b) = (
            records(&before, &bytes, &ReadOptions::default()).unwrap(),
            records(&after, &copy, &ReadOptions::default()).unwrap(),
        );
        for (a, b) in a.chunks(before.record_length).zip(b.chunks(after.record_length)) {
            assert_eq!(a[12..], b[12..], "attributes");
        }
        assert_eq!(before.extended_records(&bytes), after.extended_records(&copy));
    }
}

#[test]
fn damage_is_found() {
    for bytes in [version_1_4(), version_1_4_zipped(), written(&LAS, &POINTS), written(&LAZ, &POINTS)] {
        let end = if bytes.ends_with(b"knows") { bytes.len() - 80 } else { bytes.len() - 40 };
        for length in 0..end.min(375) {
            assert!(points_of(&LAS, &bytes[..length]).is_err(), "{length}");
        }
        let mut many = bytes.clone();
        let count = if bytes[25] == 4 { 247 } else { 107 };
        many[count..count + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(points_of(&LAS, &many).unwrap_err().to_string().contains("4294967295 points"));
        let mut scale = bytes;
        scale[131..139].copy_from_slice(&f64::NAN.to_le_bytes());
        assert!(points_of(&LAS, &scale).unwrap_err().to_string().contains("scales"));
    }
}

#[test]
fn laz_of_the_first_laszip_is_named() {
    let mut bytes = Vec::new();
    LAZ.write_cloud(&Outgoing::of_points(&POINTS), &mut bytes).unwrap();
    let record = bytes.windows(14).position(|word| word == b"laszip encoded").unwrap() - 2;
    assert_eq!(bytes[record + 54..][..2], [2, 0], "point by point, in chunks");
    bytes[record + 54] = 1;
    let error = points_of(&LAZ, &bytes).unwrap_err().to_string();
    assert!(error.contains("LASzip 1") && error.contains("`pdal translate`"), "{error}");
}
