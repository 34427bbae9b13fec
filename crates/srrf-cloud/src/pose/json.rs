//! Poses in JSON: the program's own answers, matrices by name, and ROS messages.

use serde_json::{Map, Value};

use super::matrix::{pose_of_matrix, pose_of_quaternion};
use super::{PoseFile, PoseFileError, PoseLayout, QuaternionOrder};
use crate::Rigid;

/// The key of the matrix that maps source coordinates into the target frame, and of its inverse.
const KEY: &str = "target_from_source";
const INVERSE_KEY: &str = "source_from_target";

/// The pose of an object: `target_from_source`, `source_from_target`, or a message of ROS.
pub(super) fn parse(text: &str) -> Result<PoseFile, PoseFileError> {
    let mut objects = serde_json::Deserializer::from_str(text).into_iter::<Map<String, Value>>();
    let object = match objects.next() {
        Some(Ok(object)) => object,
        Some(Err(e)) => return Err(PoseFileError::Json { why: e.to_string() }),
        None => return Err(PoseFileError::Json { why: "it is empty".into() }),
    };
    // The lines of a batch.
    match objects.count() {
        0 => of_object(&object),
        more => Err(PoseFileError::Trajectory { poses: more + 1 }),
    }
}

fn of_object(object: &Map<String, Value>) -> Result<PoseFile, PoseFileError> {
    let abstained = object.get("abstain") == Some(&Value::Bool(true));
    let file = |target_from_source, layout| Ok(PoseFile { target_from_source, layout, abstained });
    match (object.get(KEY), object.get(INVERSE_KEY)) {
        (Some(Value::Null), _) => {
            return Err(PoseFileError::NoPose { why: format!("its `{KEY}` is null") });
        }
        (Some(matrix), _) => return file(of_matrix(matrix)?, PoseLayout::Key(KEY)),
        (None, Some(matrix)) => return file(of_matrix(matrix)?.inverse(), PoseLayout::Key(INVERSE_KEY)),
        (None, None) => {}
    }
    if let Some(error) = object.get("error").and_then(Value::as_str) {
        return Err(PoseFileError::NoPose { why: error.chars().take(200).collect() });
    }
    // geometry_msgs: Transform, Pose, and those with a header around them.
    let message =
        ["transform", "pose"].iter().find_map(|key| object.get(*key)?.as_object()).unwrap_or(object);
    let part = |names: [&str; 2]| names.iter().find_map(|name| message.get(*name)?.as_object());
    if let (Some(place), Some(turn)) = (part(["translation", "position"]), part(["rotation", "orientation"]))
    {
        let number = |object: &Map<String, Value>, key: &str| object.get(key).and_then(Value::as_f64);
        let numbers = ["x", "y", "z"].map(|key| number(place, key));
        let turn = ["x", "y", "z", "w"].map(|key| number(turn, key));
        if let ([Some(x), Some(y), Some(z)], [Some(a), Some(b), Some(c), Some(d)]) = (numbers, turn) {
            let pose = pose_of_quaternion([x, y, z, a, b, c, d], QuaternionOrder::Xyzw)?;
            return file(pose, PoseLayout::Named);
        }
    }
    let keys: Vec<&str> = object.keys().map(String::as_str).take(12).collect();
    Err(PoseFileError::NoKey { keys: format!("{keys:?}") })
}

/// A matrix as 4 or 3 lists of 4, or as one list of 16 or 12.
fn of_matrix(value: &Value) -> Result<Rigid, PoseFileError> {
    let shape = |what: String| PoseFileError::Shape { rows: what };
    let list = value.as_array().ok_or_else(|| shape(format!("`{KEY}` is no list")))?;
    let rows: Vec<&Value> = list.iter().collect();
    let nested = rows.iter().all(|row| row.is_array());
    let flat: Vec<&Value> = match nested {
        true if matches!(rows.len(), 3 | 4)
            && rows.iter().all(|row| row.as_array().is_some_and(|r| r.len() == 4)) =>
        {
            rows.iter().filter_map(|row| row.as_array()).flatten().collect()
        }
        false if matches!(rows.len(), 12 | 16) => rows,
        _ => return Err(shape(format!("`{KEY}` has {} entries", list.len()))),
    };
    let numbers: Option<Vec<f64>> = flat.iter().map(|number| number.as_f64()).collect();
    pose_of_matrix(&numbers.ok_or_else(|| shape(format!("`{KEY}` holds something else than numbers")))?)
}
