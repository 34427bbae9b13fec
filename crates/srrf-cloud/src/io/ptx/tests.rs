use nalgebra::Rotation3;

use super::*;
use crate::io::testing::points_of;

/// Two scans of 2 x 3 and 1 x 2 points; the second stands at (10, 20, 30), turned by 90 degrees about z.
const TWO: &str = "2\n3\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\
                   1.5 2 3 0.25\n4 5 6 0.5\n0 0 0 0.5\n7 8 9 1\n1 1 1 0\n2 2 2 0.125\n\
                   1\n2\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n\
                   1 0 0 0.5 10 20 30\n0 2 0 0.75 40 50 60\n";

fn scan(number: usize) -> ReadOptions {
    ReadOptions::default().of_scan(number)
}

#[test]
fn scans_stand_where_their_poses_say() {
    assert!(Ptx.recognises(TWO.as_bytes()));
    let all = Ptx.read(TWO.as_bytes(), &ReadOptions::default()).unwrap();
    let finite: Vec<[f64; 3]> = all.points.iter().copied().filter(|p| !p[0].is_nan()).collect();
    let second = [[10.0, 21.0, 30.0], [8.0, 20.0, 30.0]];
    assert_eq!((all.points.len(), finite.len()), (8, 7), "a beam did not come back");
    assert_eq!(finite[0], [1.5, 2.0, 3.0]);
    assert_eq!(finite[5..], second);
    assert_eq!((all.notes, all.viewpoint, all.grid), (vec![Note::Merged { scans: 2 }], None, None));

    let one = Ptx.read(TWO.as_bytes(), &scan(2)).unwrap();
    assert_eq!((one.points.as_slice(), one.viewpoint), (&second[..], Some([10.0, 20.0, 30.0])));
    let first = Ptx.read(TWO.as_bytes(), &scan(1)).unwrap();
    assert_eq!((first.grid, first.notes), (Some([3, 2]), vec![]));
    let error = Ptx.read(TWO.as_bytes(), &scan(3)).unwrap_err().to_string();
    assert!(error.contains("scan 3") && error.contains("2 scans"), "{error}");

    let entries = Ptx.scans(TWO.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(entries.iter().map(|entry| entry.points).collect::<Vec<_>>(), [6, 2]);
    assert_eq!(entries[1].pose.unwrap().apply(&[1.0, 0.0, 0.0]), [10.0, 21.0, 30.0]);
}

#[test]
fn intensities_and_colours() {
    let of = |number| Ptx.attributes(TWO.as_bytes(), &scan(number)).unwrap();
    let values = AttributeValues::F32(vec![0.25, 0.5, 0.5, 1.0, 0.0, 0.125]);
    assert_eq!(of(1), [Attribute { name: "intensity".into(), values }]);
    let names: Vec<String> = of(2).into_iter().map(|attribute| attribute.name).collect();
    assert_eq!(names, ["intensity", "red", "green", "blue"]);
    assert_eq!(of(2)[2].values, AttributeValues::U8(vec![20, 50]));
    let both = Ptx.attributes(TWO.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(both.len(), 1, "only what all points have");
    assert_eq!(both[0].values.len(), 8);
}

#[test]
fn a_moved_copy_has_other_matrices() {
    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.1, -0.2, 0.3).into_inner(),
        translation: [1.0, -2.0, 5.0].into(),
    };
    let mut same = Vec::new();
    Ptx.rewrite(TWO.as_bytes(), &ReadOptions::default(), &Rigid::identity(), &mut same).unwrap();
    assert_eq!(same, TWO.as_bytes());
    let mut copy = Vec::new();
    Ptx.rewrite(TWO.as_bytes(), &ReadOptions::default(), &motion, &mut copy).unwrap();
    let (old, new) = (points_of(&Ptx, TWO.as_bytes()).unwrap(), points_of(&Ptx, &copy).unwrap());
    assert_eq!(old.len(), new.len());
    for (old, new) in old.iter().zip(&new).filter(|(old, _)| !old[0].is_nan()) {
        let expected = motion.apply(old);
        assert!((0..3).all(|axis| (expected[axis] - new[axis]).abs() < 1e-12), "{expected:?} {new:?}");
    }
    assert!(String::from_utf8(copy).unwrap().contains("7 8 9 1\n1 1 1 0\n"), "points stay");
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let error = |from: &str, to: &str| {
        assert!(TWO.contains(from));
        points_of(&Ptx, TWO.replacen(from, to, 1).as_bytes()).unwrap_err().to_string()
    };
    assert!(error("1 0 0 0\n0 1 0 0", "2 0 0 0\n0 1 0 0").contains("no rotation"));
    assert!(error("1 0 0 0\n0 1 0 0", "1e999 0 0 0\n0 1 0 0").contains("no rotation"), "fuzzing found it");
    assert!(error("1 0 0 0\n", "1 0 0 7\n").contains("last line"));
    assert!(error("7 8 9 1", "7 8 nine 1").starts_with("line 14: \"nine\""));
    assert!(error("7 8 9 1", "7 8").starts_with("line 14: 2 numbers"));
    assert!(error("2\n3\n", "2\n4\n").contains("line"), "the header of scan 2 is read as a point");
    assert!(error("0 2 0 0.75 40 50 60\n", "").contains("2 points of scan 2 announced, 1 found"));
    let huge = TWO.replacen("2\n3\n", "4294967296\n4294967297\n", 1);
    assert!(points_of(&Ptx, huge.as_bytes()).unwrap_err().to_string().contains("more points"));
    for cut in [0, 1, 20, 60, 100, TWO.len() - 20] {
        let read = points_of(&Ptx, &TWO.as_bytes()[..cut]);
        assert!(cut == 0 || read.is_err(), "{cut}");
    }
}
