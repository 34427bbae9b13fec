use nalgebra::Rotation3;

use e57::E57Writer;

use super::*;
use crate::io::testing::{moved_copy, points_of};

const POINTS: [[f64; 3]; 3] =
    [[431_234.567_891, 4_812_345.678_9, 1.0 / 3.0], [0.1, -0.0, 5e-324], [-1e300, 2.0, 3.0]];

fn written(points: &[[f64; 3]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    E57.write_cloud(&Outgoing::of_points(points), &mut bytes).unwrap();
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
fn attributes_go_round_in_their_types() {
    use crate::io::AttributeValues as V;
    let of = |list: Vec<(&str, V)>| -> Vec<Attribute> {
        list.into_iter().map(|(name, values)| Attribute { name: name.into(), values }).collect()
    };
    let colours = |make: fn([u8; 3]) -> V| {
        vec![("red", make([255, 0, 7])), ("green", make([1, 2, 3])), ("blue", make([9, 8, 255]))]
    };
    let rest = vec![
        ("intensity", V::F64(vec![0.25, -3.5, 1e-3])),
        ("nx", V::F64(vec![1.0, 0.0, 0.6])),
        ("ny", V::F64(vec![0.0, 1.0, 0.0])),
        ("nz", V::F64(vec![0.0, 0.0, 0.8])),
    ];
    let bytes = of([colours(|c| V::U8(c.to_vec())), rest.clone()].concat());
    let shares = of([colours(|c| V::F32(c.map(|part| f32::from(part) / 300.0).to_vec())), rest].concat());
    for attributes in [bytes, shares] {
        for single in [false, true] {
            let mut file = Vec::new();
            let points = [[0.5, 1.5, -2.5], [3.25, 4.0, 5.0], [6.0, 7.0, 8.0]];
            let cloud = Outgoing { single, attributes: &attributes, ..Outgoing::of_points(&points) };
            E57.write_cloud(&cloud, &mut file).unwrap();
            let options = ReadOptions::default();
            let contents = E57.read(&file, &options).unwrap();
            assert_eq!((&contents.points[..], contents.single), (&points[..], single));
            assert_eq!(E57.attributes(&file, &options).unwrap(), attributes);
            assert_eq!(E57.left_out(&file, &options), Ok(Vec::new()));
            // A moved copy has another pose; the normals turn with it.
            let quarter = Rigid {
                rotation: Rotation3::from_axis_angle(
                    &nalgebra::Vector3::z_axis(),
                    std::f64::consts::FRAC_PI_2,
                )
                .into_inner(),
                ..Rigid::identity()
            };
            let mut moved = Vec::new();
            moved_copy(&E57, &file, &quarter, &mut moved).unwrap();
            let found = E57.attributes(&moved, &options).unwrap();
            let normal = |at: usize| found[4..].iter().map(|a| a.values.get(at).unwrap()).collect::<Vec<_>>();
            for (at, expected) in [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, 0.8]].into_iter().enumerate()
            {
                assert!(
                    normal(at).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                    "{at}: {:?}",
                    normal(at)
                );
            }
            assert_eq!(found[..4], attributes[..4]);
        }
    }
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

/// Two scans, the second of them turned by 90 degrees about z and moved.
fn two_scans() -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "{00000000-0000-4000-8000-000000000000}").unwrap();
    let kind = RecordDataType::Double { min: None, max: None };
    for number in 0..2 {
        let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
        let prototype = names.map(|name| Record { name, data_type: kind.clone() }).to_vec();
        let id = format!("{{00000000-0000-4000-8000-00000000001{number}}}");
        let mut scan = writer.add_pointcloud(&id, prototype).unwrap();
        scan.set_name(Some(format!("station {number}")));
        if number == 1 {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            scan.set_transform(Some(e57::Transform {
                rotation: e57::Quaternion { w: half, x: 0.0, y: 0.0, z: half },
                translation: e57::Translation { x: 10.0, y: 20.0, z: 30.0 },
            }));
        }
        for x in 1..=number + 2 {
            scan.add_point([f64::from(x), 0.0, 0.5].map(RecordValue::Double).to_vec()).unwrap();
        }
        scan.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    out.into_inner()
}

#[test]
fn one_scan_of_several() {
    let bytes = two_scans();
    let near = |points: &[[f64; 3]], expected: &[[f64; 3]]| {
        assert_eq!(points.len(), expected.len());
        let pairs = points.iter().flatten().zip(expected.iter().flatten());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12), "{points:?} {expected:?}");
    };
    let all = E57.read(&bytes, &ReadOptions::default()).unwrap();
    assert!(!all.single, "double precision");
    assert_eq!((all.points.len(), all.notes, all.viewpoint), (5, vec![Note::Merged { scans: 2 }], None));
    let second = E57.read(&bytes, &ReadOptions::default().of_scan(2)).unwrap();
    near(&second.points, &[[10.0, 21.0, 30.5], [10.0, 22.0, 30.5], [10.0, 23.0, 30.5]]);
    assert_eq!((second.viewpoint, second.notes), (Some([10.0, 20.0, 30.0]), vec![]));
    near(&all.points[2..], &second.points);
    let error = E57.read(&bytes, &ReadOptions::default().of_scan(3)).unwrap_err().to_string();
    assert!(error.contains("scan 3") && error.contains("2 scans"), "{error}");
    let scans = E57.scans(&bytes, &ReadOptions::default()).unwrap();
    let facts: Vec<_> =
        scans.iter().map(|scan| (scan.name.as_str(), scan.points, scan.pose.is_some())).collect();
    assert_eq!(facts, [("station 0", 2, false), ("station 1", 3, true)]);

    let motion = Rigid { translation: [100.0, 0.0, 0.0].into(), ..Rigid::identity() };
    let mut copy = Vec::new();
    E57.rewrite(&bytes, &ReadOptions::default().of_scan(2), &motion, &mut copy).unwrap();
    let moved = E57.read(&copy, &ReadOptions::default()).unwrap().points;
    near(&moved[..2], &all.points[..2]);
    near(&moved[2..3], &[[110.0, 21.0, 30.5]]);
}
