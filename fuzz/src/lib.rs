//! What every fuzzer checks of a parser.

use srrf_cloud::Rigid;
use srrf_cloud::io::{CloudFile, IoError};
use srrf_cloud::pose::{PoseFile, PoseFormat, PoseNote, QuaternionOrder};

/// Names of the parsers, one fuzzer each.
pub const FORMATS: [&str; 12] =
    ["ply", "pcd", "xyz", "npy", "npz", "obj", "off", "stl", "kitti", "las", "laz", "e57"];

/// Those that came later, of which the corpus holds nothing yet.
pub const NEWER: [&str; 8] = ["ptx", "pts", "vtk", "vtp", "glb", "gltf", "mcap", "parquet"];

/// Reads `bytes` as `format` (or as what they look like). Where that gives points, a copy that does
/// not move holds the same ones, and a copy that moves holds as many.
///
/// # Panics
/// Where the parser does not keep its promises.
pub fn check(format: Option<&str>, bytes: &[u8]) {
    let Ok(file) = CloudFile::from_reader(&mut &bytes[..], format) else { return };
    let Ok(points) = file.points() else { return };
    let motion = Rigid {
        rotation: nalgebra::Rotation3::from_euler_angles(0.1, -0.2, 0.3).into_inner(),
        translation: [10.0, -0.5, 1.0].into(),
    };
    for (motion, still) in [(Rigid::identity(), true), (motion, false)] {
        let mut copy = Vec::new();
        match file.write_transformed_to(&mut copy, None, &motion) {
            Ok(_) => {}
            // Single precision may not be enough.
            Err(IoError::Write { .. }) => continue,
            Err(error) => panic!("read, but not copied: {error}"),
        }
        let read = CloudFile::from_reader(&mut &copy[..], Some(file.format())).and_then(|file| file.points());
        let read = read.unwrap_or_else(|error| panic!("copied, but not read: {error}"));
        // Corners of STL that come to lie in one place are one point.
        assert!(
            read.len() == points.len() || (file.format() == "stl" && !still),
            "{} of {}",
            read.len(),
            points.len()
        );
        let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
        assert!(!still || read.iter().flatten().zip(points.iter().flatten()).all(same), "other points");
    }
}

/// Reads `bytes` as a pose. Where that gives one, it is a rotation, and a file of every format gives it back.
///
/// # Panics
/// Where the parser does not keep its promises.
pub fn check_pose(bytes: &[u8]) {
    for order in [None, Some(QuaternionOrder::Wxyz)] {
        let Ok(read) = PoseFile::parse(bytes, order) else { continue };
        let pose = read.target_from_source;
        assert!(pose.rotation.iter().chain(&pose.translation).all(|v| v.is_finite()), "not finite: {pose:?}");
        let off = (pose.rotation.transpose() * pose.rotation - nalgebra::Matrix3::identity()).abs().max();
        assert!(off < 1e-8 && pose.rotation.determinant() > 0.0, "no rotation: {pose:?}");
        for format in PoseFormat::ALL {
            let note = PoseNote { abstain: true, probability: Some(0.5) };
            let Ok(written) = format.write(&pose, &note) else { panic!("{format:?}: not written") };
            let again = PoseFile::parse(&written, None).unwrap_or_else(|e| panic!("{format:?}: {e}"));
            let turned = (again.target_from_source.rotation - pose.rotation).abs().max();
            let far = (again.target_from_source.translation - pose.translation).abs().max();
            let most = pose.translation.abs().max();
            assert!(turned < 1e-7 && far <= 1e-12 * most, "{format:?}: {pose:?} became {again:?}");
            assert!(again.abstained || format == PoseFormat::Npy, "{format:?}");
        }
    }
}
