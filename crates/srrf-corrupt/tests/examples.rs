//! The examples do what they say.

#[path = "../examples/own_corruption.rs"]
mod own_corruption;

#[test]
fn a_corruption_of_ones_own_makes_pairs() {
    own_corruption::main().unwrap();
}
