use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::EulerXyz;

fn pose() -> Rigid {
    let rotation = EulerXyz::from_deg([12.3, -45.6, 78.9]).to_matrix();
    Rigid { rotation, translation: Vector3::new(5e5 + 0.1, -4e6 / 3.0, 1e-9) }
}

fn parse(text: &str) -> Result<PoseFile, PoseFileError> {
    PoseFile::parse(text.as_bytes(), None)
}

fn rows(numbers: usize, separator: &str) -> String {
    let matrix = pose().to_matrix4().transpose(); // nalgebra goes column by column
    matrix.iter().take(numbers).map(|v| format!("{v:.16e}")).collect::<Vec<_>>().join(separator)
}

/// 4 rows of 4.
fn matrix4() -> String {
    let row = |i: usize| (0..4).map(|j| format!("{:.16e}", pose().to_matrix4()[(i, j)])).collect::<Vec<_>>();
    (0..4).map(|i| row(i).join(" ") + "\n").collect()
}

#[test]
fn matrices_of_every_layout_give_the_same_bits() {
    let three = matrix4().lines().take(3).collect::<Vec<_>>().join("\n");
    let list = format!("[[{}]]", matrix4().trim().replace(' ', ", ").replace('\n', "],\n ["));
    let nested = list.replace('\n', "");
    for (text, layout) in [
        (matrix4(), PoseLayout::Matrix4),
        (
            format!("\u{feff}# a pose\r\n\r\n{}", matrix4().replace(' ', ", ").replace('\n', "\r\n")),
            PoseLayout::Matrix4,
        ),
        (list.clone(), PoseLayout::Matrix4),
        (matrix4().replace(' ', ";\t"), PoseLayout::Matrix4),
        (three, PoseLayout::Matrix3x4),
        (rows(16, " "), PoseLayout::Row16),
        (rows(16, ","), PoseLayout::Row16),
        (nested.clone(), PoseLayout::Row16),
        (rows(16, "\n"), PoseLayout::Row16),
        (rows(12, " ") + " # the first frame", PoseLayout::Row12),
        (
            format!("{{\"probability\": 0.9, \"target_from_source\": {nested}}}"),
            PoseLayout::Key("target_from_source"),
        ),
        (format!("{{\"target_from_source\": [{}]}}", rows(12, ", ")), PoseLayout::Key("target_from_source")),
    ] {
        let read = parse(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
        assert_eq!((read.target_from_source, read.layout), (pose(), layout), "{text}");
    }
    let inverse = pose().inverse().to_matrix4().transpose();
    let numbers = inverse.iter().map(|v| format!("{v:.16e}")).collect::<Vec<_>>().join(",");
    let read = parse(&format!("{{\"source_from_target\": [{numbers}]}}")).unwrap();
    assert_eq!(read.layout.to_string(), "`source_from_target` of JSON");
    assert!((read.target_from_source.to_matrix4() - pose().to_matrix4()).norm() < 1e-8);
}

#[test]
fn quaternions_have_an_order() {
    // A quarter turn about z: x to y.
    let turned = |read: &PoseFile| read.target_from_source.apply(&[1.0, 0.0, 0.0]);
    let close = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm() < 1e-7;
    for (text, order, titled) in [
        ("1 2 3 0 0 0.70710678 0.70710678", QuaternionOrder::Xyzw, false),
        ("1305031449.7996 1 2 3 0 0 0.70710678 0.70710678", QuaternionOrder::Xyzw, false),
        ("# timestamp tx ty tz qx qy qz qw\n0 1 2 3 0 0 0.70710678 0.70710678", QuaternionOrder::Xyzw, true),
        (
            "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n\
             7,1,2,3,0.70710678,0,0,0.70710678",
            QuaternionOrder::Wxyz,
            true,
        ),
        ("tx,ty,tz,qw,qx,qy,qz\n1,2,3,0.70710678,0,0,0.70710678", QuaternionOrder::Wxyz, true),
    ] {
        let read = parse(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        assert_eq!(read.layout, PoseLayout::Quaternion { order, titled }, "{text}");
        assert!(close(turned(&read), [1.0, 3.0, 3.0]), "{text}: {:?}", turned(&read));
    }
    let asked = PoseFile::parse(b"1 2 3 0.70710678 0 0 0.70710678", Some(QuaternionOrder::Wxyz)).unwrap();
    assert!(close(turned(&asked), [1.0, 3.0, 3.0]) && asked.layout.to_string() == "tx ty tz qw qx qy qz");

    // Parts by name need no order.
    let yaml = "transform:\n  translation:\n    x: 1.0\n    y: 2\n    z: 3\n  rotation:\n    x: 0\n    y: 0\n    \
                z: 0.70710678\n    w: 0.70710678\n";
    let json = r#"{"position": {"x": 1, "y": 2, "z": 3}, "orientation": {"w": 0.70710678, "x": 0, "y": 0, "z": 0.70710678}}"#;
    let inner = format!("{{\"header\": {{}}, \"pose\": {json}}}");
    for text in [yaml, json, &inner] {
        let read = parse(text).unwrap();
        assert_eq!(read.layout, PoseLayout::Named);
        assert!(close(turned(&read), [1.0, 3.0, 3.0]));
    }
}

#[test]
fn what_is_no_pose_is_said_with_its_figure() {
    let error = |text: &str| parse(text).unwrap_err().to_string();
    let transposed = pose().to_matrix4().transpose();
    let text = |m: &nalgebra::Matrix4<f64>| {
        m.row_iter()
            .map(|r| r.iter().map(|v| format!("{v:e} ")).collect::<String>() + "\n")
            .collect::<String>()
    };
    let message = error(&text(&transposed));
    assert!(
        message.starts_with("the matrix is transposed: its last row, [500000.1, ")
            && message.contains("matrix.T")
    );
    assert!(
        error(&text(&transposed).replace('\n', " ")).contains("transposed"),
        "16 numbers, column by column"
    );
    let mut scaled = pose().to_matrix4();
    scaled.fixed_view_mut::<3, 3>(0, 0).scale_mut(1000.0);
    assert!(error(&text(&scaled)).contains("has the scale 1000 in it"), "{}", error(&text(&scaled)));
    for (text, fact) in [
        ("1 0 0 0\n0 1 0\n", "it has 2 rows of numbers, and line 2 has 3 numbers"),
        ("1 0 0 0\n0 1 0 x\n", "line 2: \"x\" is not a finite number"),
        ("1 0 0 0\n0 1 0 0\n", "it has 2 rows of 4 numbers"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", "here it is [0.0, 0.0, 0.0, 2.0]"),
        ("1 0 0 0\n0 2 0 0\n0 0 1 0\n0 0 0 1\n", "the lengths [1.0, 2.0, 1.0]"),
        ("1 0 0 0\n0 1 0 0\n0 1 0 0\n0 0 0 1\n", "not a rotation"),
        ("0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n", "not a rotation"),
        ("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "mirror"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 1 1\n", "it has 5 rows"),
        ("1 0 0 nan\n", "finite"),
        ("0 0 0 0 0 0 2", "length 2.000000, not 1"),
        ("1 0 0 0 5 6 7", "stands before the translation"),
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n", "2 poses, a trajectory"),
        (&"1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(7), "7 poses"),
        (&"1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".repeat(3), "3 poses"),
        ("", "no numbers"),
        ("{", "not readable as JSON"),
        ("{\"error\": \"too few points\"}", "an answer without a pose: too few points"),
        ("{\"target_from_source\": null}", "null"),
        ("{\"matrix\": []}", "its keys are [\"matrix\"]"),
        ("{\"target_from_source\": [[1, 0], [0, 1]]}", "has 2 entries"),
        ("{\"target_from_source\": [\"a\", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]}", "else than numbers"),
        ("{\"target_from_source\": [1]}\n{\"target_from_source\": [1]}", "2 poses"),
    ] {
        let message = error(text);
        assert!(message.contains(fact), "{text:?}: {message}");
    }
    assert_eq!(PoseFile::parse(&[0xff, 0xfe, 0x31], None), Err(PoseFileError::NotText));
    // PowerShell writes what a program prints in UTF-16.
    let rows = "\u{feff}1 0 0 5\r\n0 1 0 6\r\n0 0 1 7\r\n0 0 0 1\r\n";
    let bytes: Vec<u8> = rows.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let read = PoseFile::parse(&bytes, None).unwrap();
    assert_eq!((read.target_from_source.translation.z, read.layout), (7.0, PoseLayout::Matrix4));
    assert!(matches!(PoseFile::parse(b"\x93NUMPY", None), Err(PoseFileError::NotRead(_))));
}

#[test]
fn arrays_of_every_shape() {
    let matrix = pose().to_matrix4().transpose();
    for (shape, layout) in [
        (&[4, 4][..], PoseLayout::Matrix4),
        (&[1, 4, 4], PoseLayout::Matrix4),
        (&[3, 4], PoseLayout::Matrix3x4),
        (&[16], PoseLayout::Row16),
        (&[1, 12], PoseLayout::Row12),
    ] {
        let mut bytes = Vec::new();
        let numbers = shape.iter().product();
        let values: Vec<f64> = matrix.iter().copied().take(numbers).collect();
        Array::write(shape, &values, &mut bytes).unwrap();
        let read = PoseFile::parse(&bytes, None).unwrap();
        assert_eq!((read.target_from_source, read.layout), (pose(), layout), "{shape:?}");
    }
    for (shape, fact) in
        [(&[2, 2][..], "2 rows of 2 numbers"), (&[2, 4, 4], "shape [2, 4, 4]"), (&[0, 4], "no numbers")]
    {
        let mut bytes = Vec::new();
        Array::write(shape, &vec![0.0; shape.iter().product()], &mut bytes).unwrap();
        let message = PoseFile::parse(&bytes, None).unwrap_err().to_string();
        assert!(message.contains(fact), "{shape:?}: {message}");
    }
}

#[test]
fn rounded_rotations_are_put_right() {
    let rotation = EulerXyz::from_deg([10.0, 20.0, 30.0]).to_matrix();
    let pose = Rigid { rotation, translation: Vector3::zeros() };
    let text: String = pose
        .to_matrix4()
        .row_iter()
        .map(|r| r.iter().map(|v| format!("{v:.4} ")).collect::<String>() + "\n")
        .collect();
    let read = parse(&text).unwrap().target_from_source;
    assert!((read.rotation.transpose() * read.rotation - Matrix3::identity()).norm() < 1e-14);
    assert!(read.angle_to_deg(&pose) < 0.01);
}

#[test]
fn every_format_reads_back_and_says_abstain() {
    for format in PoseFormat::ALL {
        assert_eq!(
            PoseFormat::of_path(std::path::Path::new(&format!("a.{}", format.name().to_uppercase()))),
            Some(format)
        );
        for abstain in [false, true] {
            let note = PoseNote { abstain, probability: Some(0.25) };
            let bytes = format.write(&pose(), &note).unwrap();
            let read = PoseFile::parse(&bytes, None).unwrap();
            let off = (read.target_from_source.to_matrix4() - pose().to_matrix4()).abs().max();
            let of_quaternion = matches!(format, PoseFormat::Tum | PoseFormat::Ros);
            assert!(if of_quaternion { off < 1e-14 } else { off == 0.0 }, "{format:?}: {off}");
            assert_eq!(read.abstained, abstain && format != PoseFormat::Npy, "{format:?}");
            if format != PoseFormat::Npy {
                let text = String::from_utf8(bytes).unwrap();
                assert_eq!(text.contains("abstain"), abstain || format == PoseFormat::Json, "{text}");
            }
        }
    }
    assert_eq!(PoseFormat::of_path(std::path::Path::new("pose")), Some(PoseFormat::Text));
    assert_eq!(PoseFormat::of_path(std::path::Path::new("pose.mat")), None);
    assert!("mat".parse::<PoseFormat>().unwrap_err().contains("kitti"));
}
