#!/usr/bin/env bash
# tobj 4.0.5 (crates.io): a Wavefront OBJ of vertices alone, as scanners and MeshLab write point clouds, gives a model of no positions.
# Guess before the first run: one model with the positions. Seen: `Ok` with one empty model for five `v` lines; one face brings
# back its three corners, and the two vertices that no face names are gone. Count what was read against the `v` lines.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "probe"
version = "0.0.0"
edition = "2021"
[dependencies]
tobj = "=4.0.5"
TOML
cat > src/main.rs <<'RUST'
fn read(text: &str) -> (usize, usize) {
    let none = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), none).expect("valid OBJ");
    (models.len(), models.iter().map(|m| m.mesh.positions.len() / 3).sum())
}

fn main() {
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\n";
    let (alone, with_face) = (read(points), read(&format!("{points}f 1 2 3\n")));
    println!("tobj 4.0.5: models and positions of 5 vertices: {alone:?}; with one face: {with_face:?}");
    std::process::exit(i32::from((alone, with_face) != ((1, 0), (1, 3))));
}
RUST
CARGO_TARGET_DIR=$folder/target cargo run --quiet
