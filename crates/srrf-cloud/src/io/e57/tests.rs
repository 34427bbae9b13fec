use nalgebra::Rotation3;

use super::*;
use crate::io::testing::{moved_copy, points_of};

const POINTS: [[f64; 3]; 3] =
    [[431_234.567_891, 4_812_345.678_9, 1.0 / 3.0], [0.1, -0.0, 5e-324], [-1e300, 2.0, 3.0]];

fn written(points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    E57.write(points, &mut bytes).unwrap();
    bytes
}

#[test]
fn goes_round_exactly() {
    let bytes = written(&POINTS);
    assert!(E57.recognises(&bytes));
    let read = points_of(&E57, &bytes).unwrap();
    assert!(read.iter().flatten().zip(POINTS.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
    let many: Vec<[f64; 3]> = (0..20_011).map(|i| [f64::from(i), 0.1, -f64::from(i)]).collect();
    assert_eq!(points_of(&E57, &written(&many)).unwrap(), many);
}

#[test]
fn a_moved_copy_has_other_poses() {
    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.1, -0.2, 0.3).into_inner(),
        translation: [1000.0, -2000.0, 5.0].into(),
    };
    let points: Vec<[f64; 3]> = (0..500).map(|i| [f64::from(i), 0.1, -f64::from(i)]).collect();
    let mut once = Vec::new();
    moved_copy(&E57, &written(&points), &motion, &mut once).unwrap();
    let mut back = Vec::new();
    moved_copy(&E57, &once, &motion.inverse(), &mut back).unwrap();
    let near = |bytes: &[u8], motion: &Rigid| {
        let read = points_of(&E57, bytes).unwrap();
        assert_eq!(read.len(), points.len());
        let pairs = read.iter().flatten().copied().zip(points.iter().flat_map(|p| motion.apply(p)));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-9
    };
    assert!(near(&once, &motion) && near(&back, &Rigid::identity()));
    E57Reader::validate_crc(Cursor::new(&once)).unwrap();
    assert!(once.len() <= written(&points).len() + 1024, "the old XML is gone");
}

#[test]
fn damage_is_found() {
    let bytes = written(&POINTS);
    for length in 0..bytes.len() {
        assert!(points_of(&E57, &bytes[..length]).is_err(), "{length}");
    }
    let mut huge = bytes.clone();
    huge[32..40].copy_from_slice(&40_000_000u64.to_le_bytes());
    assert!(points_of(&E57, &huge).unwrap_err().to_string().contains("40000000 bytes"));
    let xml = E57Reader::new(Cursor::new(&bytes)).unwrap().xml().to_owned();
    for (from, to) in
        [("recordCount=\"3\"", "recordCount=\"1000000000000000000\""), ("cartesianX", "cartesianQ")]
    {
        assert!(xml.contains(from), "{xml}");
        assert!(points_of(&E57, &pages::with_xml(&bytes, &xml.replace(from, to)).unwrap()).is_err());
    }
}
