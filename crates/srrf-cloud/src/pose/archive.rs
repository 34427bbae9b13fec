//! Poses in `.npz` archives.

use super::{PoseFile, PoseFileError, PoseLayout, QuaternionOrder, of_array};
use crate::io::{Array, parse_npz};

/// Usual names of a matrix that is a pose, in small letters.
const NAMES: [&str; 10] = [
    "pose",
    "t",
    "tf",
    "transform",
    "transformation",
    "matrix",
    "estimate",
    "arr_0",
    "initial",
    "t_target_source",
];
/// Usual names of a rotation, and of a translation.
const ROTATIONS: [&str; 4] = ["r", "rot", "rotation", "rotation_matrix"];
const TRANSLATIONS: [&str; 5] = ["t", "trans", "translation", "position", "tvec"];

/// The pose in an archive: the array `target_from_source`, the inverse of `source_from_target`, the only array with the
/// shape of a pose or the only one of them with a usual name, or a rotation and a translation.
pub(super) fn parse(bytes: &[u8], order: Option<QuaternionOrder>) -> Result<PoseFile, PoseFileError> {
    let npz = parse_npz(bytes)?;
    let named = |names: Vec<&str>, pose: PoseFile| PoseFile {
        layout: PoseLayout::Arrays(names.into_iter().map(str::to_owned).collect()),
        ..pose
    };
    let key = |wanted: &str| npz.arrays.get_key_value(wanted);
    if let Some((name, array)) = key("target_from_source") {
        return Ok(named(vec![name], of_array(array, order)?));
    }
    if let Some((name, array)) = key("source_from_target") {
        let pose = of_array(array, order)?;
        let target_from_source = pose.target_from_source.inverse();
        return Ok(named(vec![name], PoseFile { target_from_source, ..pose }));
    }
    let usual = |list: &[&str], name: &str| list.contains(&name.to_ascii_lowercase().as_str());
    let poses = || npz.arrays.iter().filter(|(_, array)| is_pose(array));
    let mut by_name = poses().filter(|(name, _)| usual(&NAMES, name));
    let one = match (poses().count(), npz.arrays.len(), by_name.next(), by_name.next()) {
        (1, ..) => poses().next(),
        // So that its own error tells what is wrong with it.
        (0, 1, ..) => npz.arrays.iter().next(),
        (_, _, Some(one), None) => Some(one),
        _ => None,
    };
    if let Some((name, array)) = one {
        return Ok(named(vec![name], of_array(array, order)?));
    }
    let part = |list: &[&str], size: usize| {
        let mut fitting =
            npz.arrays.iter().filter(|(name, array)| usual(list, name) && array.values.len() == size);
        fitting.next().filter(|_| fitting.next().is_none())
    };
    if let (0, Some((r, turn)), Some((t, place))) =
        (poses().count(), part(&ROTATIONS, 9), part(&TRANSLATIONS, 3))
    {
        let rows = turn.values.chunks(3).zip(&place.values);
        let values = rows.flat_map(|(row, t)| row.iter().copied().chain([*t])).collect();
        return Ok(named(vec![r, t], of_array(&Array { shape: vec![3, 4], values }, order)?));
    }
    Err(PoseFileError::Archive { poses: poses().count(), names: format!("{:?}", npz.names) })
}

/// Whether an array has the shape of one pose.
fn is_pose(array: &Array) -> bool {
    let shape: Vec<usize> = array.shape.iter().copied().filter(|&axis| axis != 1).collect();
    matches!(shape[..], [4, 4] | [3, 4] | [16] | [12] | [7])
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::io::NpzWriter;
    use crate::{EulerXyz, Rigid};

    fn truth() -> Rigid {
        let rotation = EulerXyz::from_deg([10.0, -40.0, 75.0]).to_matrix();
        Rigid { rotation, translation: Vector3::new(1.5, -2.25, 300.125) }
    }

    fn matrix(rows: usize, pose: &Rigid) -> Array {
        let values = pose.to_matrix4().transpose().iter().copied().take(4 * rows).collect();
        Array { shape: vec![rows, 4], values }
    }

    fn read(arrays: &[(&str, Array)]) -> Result<PoseFile, PoseFileError> {
        let mut bytes = Vec::new();
        let mut writer = NpzWriter::new(&mut bytes);
        for (name, array) in arrays {
            writer.array(name, &array.shape, &array.values).unwrap();
        }
        writer.finish().unwrap();
        PoseFile::parse(&bytes, None)
    }

    #[test]
    fn the_array_that_is_a_pose() {
        let other = || Array { shape: vec![2, 3], values: vec![0.5; 6] };
        let wrong = || matrix(4, &Rigid::identity());
        let inverse = truth().inverse();
        let part = |shape: &[usize], values: &[f64]| Array { shape: shape.to_vec(), values: values.to_vec() };
        let turn: Vec<f64> = truth().rotation.transpose().iter().copied().collect();
        let place = [1.5, -2.25, 300.125];
        for (arrays, used) in [
            (vec![("foo", matrix(4, &truth()))], "foo"),
            (vec![("points", other()), ("foo", matrix(3, &truth()))], "foo"),
            (vec![("a", wrong()), ("T", matrix(4, &truth()))], "T"),
            (vec![("T", wrong()), ("target_from_source", matrix(4, &truth()))], "target_from_source"),
            (vec![("source_from_target", matrix(4, &inverse))], "source_from_target"),
            (
                vec![("R", part(&[3, 3], &turn)), ("t", part(&[3], &place)), ("n", other())],
                "R and the array t",
            ),
            (vec![("rotation", part(&[3, 3], &turn)), ("translation", part(&[3, 1], &place))], "translation"),
        ] {
            let read = read(&arrays).unwrap();
            let off = (read.target_from_source.to_matrix4() - truth().to_matrix4()).abs().max();
            assert!(off < 1e-12, "{used}: {off}");
            assert!(read.layout.to_string().contains(used), "{}", read.layout);
        }
        let error = |arrays: &[(&str, Array)]| read(arrays).unwrap_err().to_string();
        let two = error(&[("a", wrong()), ("b", wrong())]);
        assert!(
            two.contains("2 of its arrays") && two.contains("\"b\"") && two.contains("target_from_source"),
            "{two}"
        );
        let none = error(&[("a", other()), ("b", other())]);
        assert!(none.contains("none of its arrays"), "{none}");
        assert!(error(&[("a", other())]).contains("it has 2 rows of 3 numbers"), "its own error");
        assert!(PoseFile::parse(b"PK\x03\x04", None).unwrap_err().to_string().contains("not an NPZ archive"));
    }
}
