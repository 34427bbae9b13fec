//! The page that shows an answer.

use nalgebra::{Matrix3, Vector3};
use pyo3::prelude::*;
use serde_json::Value;
use srrf_cloud::Rigid;
use srrf_view::{Number, Page, Pair, Pose, Up};

use crate::cloud::Cloud;
use crate::refusal::{Fault, Refusal};

/// A page for any browser: both clouds, the pose, and the figures of an answer in JSON.
#[pyfunction]
pub fn page(
    answer: &str,
    source: &Cloud,
    target: &Cloud,
    unit: &str,
    up: Option<&str>,
) -> Result<String, Refusal> {
    let value: Value = serde_json::from_str(answer)
        .map_err(|e| Refusal::new(Fault::Internal, format!("an answer that cannot be read: {e}")))?;
    let axis = |name: &str| {
        let known = Up::ALL.into_iter().find(|up| up.name() == name);
        known.ok_or_else(|| Refusal::new(Fault::Option, format!("up is `{name}`: use z, y, x, -z, -y or -x")))
    };
    let up = up.map(axis).transpose()?;
    let title = format!("{} to {}", source.name, target.name);
    let mut pair = Pair::new(&*title, &source.points, &target.points).unit(unit);
    if let Some(up) = up {
        pair = pair.up(up);
    }
    if let Some(pose) = pose(&value["target_from_source"]) {
        pair = pair.pose(Pose::new("result", pose));
    }
    let verdict = if value["abstain"] == true { "abstain" } else { "probably right" };
    let percent = |number: &Value| format!("{:.0} %", 100.0 * number.as_f64().unwrap_or(f64::NAN));
    let evidence = &value["evidence"];
    pair = pair
        .number(Number::text("Verdict", format!("{verdict} ({})", percent(&value["probability"]))))
        .number(Number::text("Source points near the target", percent(&evidence["fitness"])))
        .number(Number::text("Target points near the source", percent(&evidence["overlap_target"])));
    if let Some(rmse) = evidence["inlier_rmse"].as_f64() {
        pair = pair.number(Number::new("RMSE of the inliers", rmse));
    }
    if let Some(start) = value["start"].as_str() {
        pair = pair.number(Number::text("Start", start.to_owned()));
    }
    for warning in value["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        pair = pair.warning(warning);
    }
    Ok(Page::new(title.clone()).pair(pair).to_html())
}

/// A pose from 4 rows of 4.
fn pose(rows: &Value) -> Option<Rigid> {
    let at = |r: usize, c: usize| rows.get(r)?.get(c)?.as_f64();
    let numbers: Option<Vec<f64>> = (0..12).map(|i| at(i / 4, i % 4)).collect();
    let m = numbers?;
    Some(Rigid {
        rotation: Matrix3::from_fn(|r, c| m[4 * r + c]),
        translation: Vector3::from_fn(|r, _| m[4 * r + 3]),
    })
}
