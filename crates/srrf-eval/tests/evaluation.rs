//! A whole evaluation through the program: files in, files out. Only classical methods are run, so
//! that it is quick.

mod common;

use common::{results, row, run, scores};

const SMALL: [&str; 10] = [
    "--shapes",
    "6",
    "--points",
    "256",
    "--corruptions",
    "clean,shear",
    "--severities",
    "1,4",
    "--methods",
    "identity,icp,oracle",
];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], more].concat()
}

#[test]
fn the_report_is_complete_and_consistent() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &SMALL);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("data: procedural shapes"), "{text}");
    assert!(text.lines().nth(1).unwrap().contains("seed: 1"), "{text}");
    assert!(text.contains("Rotation RMSE") && text.contains("| shear "), "{text}");
    for file in ["table.md", "table.csv", "results.json", "curves_rmse_r.svg", "curves_recall.svg"] {
        assert!(folder.path().join("report").join(file).is_file(), "{file}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("report/results.json")).unwrap()).unwrap();
    // 3 groups and 2 means, 3 methods; 3 groups of 6 pairs.
    assert_eq!(json["summary"].as_array().unwrap().len(), 15);
    assert_eq!(json["pairs"].as_array().unwrap().len(), 18);
    assert_eq!(json["meta"]["seed"], 1);
    for row in json["summary"].as_array().unwrap() {
        let value = |key: &str| row[key].as_f64().unwrap();
        assert!(value("mae_r") <= value("rmse_r") && value("mae_t") <= value("rmse_t"));
        assert!(row["severity"] == "mean" || (value("rmse_r").powi(2) - value("mse_r")).abs() < 1e-9);
    }
    // The summary can be had from the pairs.
    let errors: Vec<f64> = json["pairs"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| p["corruption"] == "shear" && p["severity"] == 4)
        .flat_map(|p| p["methods"]["icp"]["error_euler_deg"].as_array().unwrap().clone())
        .map(|e| e.as_f64().unwrap())
        .collect();
    assert_eq!(errors.len(), 18);
    let rmse = (errors.iter().map(|e| e * e).sum::<f64>() / 18.0).sqrt();
    assert!((rmse - row(&json, "shear", 4, "icp")["rmse_r"].as_f64().unwrap()).abs() < 1e-9);
    // Exact correspondences find clean poses exactly, and sheared ones worse the more they shear.
    let oracle = |corruption: &str, severity: u8| {
        row(&json, corruption, severity, "oracle")["rmse_r"].as_f64().unwrap()
    };
    assert!(oracle("clean", 0) < 1e-6 && oracle("clean", 0) < oracle("shear", 1));
    assert!(oracle("shear", 1) < oracle("shear", 4));
}

#[test]
fn threads_change_nothing_and_seeds_do() {
    let folder = tempfile::tempdir().unwrap();
    let one = scores(&results(folder.path(), &with(&["--threads", "1"])));
    let two = scores(&results(folder.path(), &with(&["--threads", "2"])));
    assert_eq!(one, two);
    let other = scores(&results(folder.path(), &with(&["--seed", "2"])));
    assert_ne!(one, other);
}

#[test]
fn exported_pairs_score_as_the_pairs_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let direct = results(folder.path(), &with(&["--export-pairs", "pairs.npz"]));
    let read = results(folder.path(), &["--pairs", "pairs.npz", "--methods", "identity,icp,oracle"]);
    for (group, corruption, severity) in
        [("clean", "clean", 0), ("shear_s1", "shear", 1), ("shear_s4", "shear", 4)]
    {
        for method in ["identity", "icp", "oracle"] {
            for key in ["rmse_r", "mae_t", "median_rot_deg", "recall", "chamfer", "pairs"] {
                let a = row(&direct, corruption, severity, method)[key].as_f64().unwrap();
                for severity in [serde_json::json!(0), serde_json::json!("mean")] {
                    let b = row(&read, group, severity, method)[key].as_f64().unwrap();
                    assert!((a - b).abs() < 1e-9, "{group} {method} {key}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn transforms_of_another_tool_are_scored() {
    let folder = tempfile::tempdir().unwrap();
    let json = results(folder.path(), &with(&["--export-pairs", "pairs.npz"]));
    // A tool that knows the rotation of every pair but one, and no translation.
    let matrix = |pair: &serde_json::Value| {
        let angles: Vec<f64> =
            pair["true_euler_deg"].as_array().unwrap().iter().map(|a| a.as_f64().unwrap()).collect();
        let r = srrf_cloud::EulerXyz::from_deg([angles[0], angles[1], angles[2]]).to_matrix();
        let row = |i: usize| serde_json::json!([r[(i, 0)], r[(i, 1)], r[(i, 2)], 0.0]);
        serde_json::json!([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
    };
    let mut all: Vec<serde_json::Value> = json["pairs"].as_array().unwrap().iter().map(matrix).collect();
    all[0] = serde_json::Value::Null;
    std::fs::write(folder.path().join("mytool.json"), serde_json::to_string(&all).unwrap()).unwrap();
    // The same file serves the pairs made again, and the exported pairs.
    let again = results(folder.path(), &with(&["--transforms", "mytool.json"]));
    assert!(row(&again, "shear", 4, "mytool")["rmse_r"].as_f64().unwrap() < 1e-9);
    assert_eq!(row(&again, "clean", 0, "mytool")["failed"], 1);
    let identity = row(&again, "shear", 4, "identity")["rmse_t"].clone();
    assert_eq!(row(&again, "shear", 4, "mytool")["rmse_t"], identity);
    let read = results(
        folder.path(),
        &["--pairs", "pairs.npz", "--transforms", "mytool.json", "--methods", "identity"],
    );
    assert!(row(&read, "shear_s4", 0, "mytool")["rmse_r"].as_f64().unwrap() < 1e-9);
}

#[test]
fn protocol_switches_change_the_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let base = [
        "--shapes",
        "4",
        "--points",
        "256",
        "--methods",
        "icp",
        "--corruptions",
        "gaussian",
        "--severities",
        "3",
    ];
    let plain = scores(&results(folder.path(), &base));
    for more in [
        &["--independent"][..],
        &["--corrupt", "target"],
        &["--rotation", "so3"],
        &["--rotation", "dcp"],
        &["--translation", "0.1"],
    ] {
        assert_ne!(plain, scores(&results(folder.path(), &[&base[..], more].concat())), "{more:?}");
    }
}
