//! The example runs, and its method has a row like any other.

#[path = "../examples/own_method.rs"]
mod own_method;

use srrf_eval::{SeverityKey, TableRow};

#[test]
fn a_method_of_ones_own_is_a_row() {
    let summary = own_method::score().unwrap();
    let names: Vec<String> = summary.methods().into_iter().map(TableRow::to_string).collect();
    assert_eq!(names, ["icp", "oracle", "centroids"]);
    for corruption in ["clean", "cutout", "gaussian"] {
        let scores = |name: &'static str| {
            summary.get(corruption, SeverityKey::Mean, &TableRow::method(name)).unwrap().scores
        };
        assert_eq!((scores("centroids").pairs, scores("centroids").failed), (5, 0));
        // It never turns, so it is as wrong in rotation as the identity: chance level.
        assert!(scores("centroids").rmse_r > 10.0);
    }
}
