//! The three levels of the library, as the examples show them.
#![allow(dead_code, reason = "the examples' own `main`s")]

#[path = "../examples/many_sources.rs"]
mod many_sources;
#[path = "../examples/own_parts.rs"]
mod own_parts;
#[path = "../examples/two_files.rs"]
mod two_files;

#[test]
fn one_call() {
    let (outcome, error_deg) = two_files::on_generated_files().unwrap();
    assert!(error_deg < 1.0, "{error_deg}");
    assert_eq!(outcome.points.source, 3000);
}

#[test]
fn a_prepared_target() {
    let (map, scans) = many_sources::map_and_scans(4).unwrap();
    let outcomes = many_sources::register_all(&map, &scans).unwrap();
    for ((_, truth), outcome) in scans.iter().zip(&outcomes) {
        let error = outcome.target_from_source.angle_to_deg(truth);
        assert!(error < 2.0, "{error}");
    }
}

#[test]
fn parts_of_ones_own() {
    let (coarse, refined) = own_parts::run(srrf_corrupt::Severity::try_from(3).unwrap()).unwrap();
    assert!(coarse > 0.5 && refined < 0.5, "{coarse} {refined}");
}
