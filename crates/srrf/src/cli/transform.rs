//! Poses in text files: 4 rows of 4, as `numpy.savetxt` and most other tools write them.

use std::fmt::Write;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use srrf_cloud::Rigid;

use srrf_args::Failure;

/// How far `R^T R` may be from the identity in files: what rows of four decimals come to.
const TOLERANCE: f64 = 1e-3;
/// Rotations that are this exact stay as they are.
const EXACT: f64 = 1e-9;

/// 4 rows of 4 with 17 significant digits, which give the same bits when they are read.
pub fn to_text(pose: &Rigid) -> String {
    let matrix = pose.to_matrix4();
    let mut text = String::new();
    for row in matrix.row_iter() {
        let numbers: Vec<String> = row.iter().map(|v| format!("{v:.16e}")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", numbers.join(" "));
    }
    text
}

/// Reads a pose from a file.
///
/// # Errors
/// [`Failure::usage`], which names the file, the line and what is wrong with it.
pub fn read(path: &Path) -> Result<Rigid, Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| {
        Failure::usage(format!("cannot read {path:?}: {e}; it should hold a pose, 4 rows of 4"))
    })?;
    parse(&text).map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))
}

/// Reads a pose: 4 rows of 4 numbers, apart by spaces or commas; `#` begins a comment.
///
/// # Errors
/// What is wrong, with the line, and what is expected.
pub fn parse(text: &str) -> Result<Rigid, String> {
    let mut rows: Vec<(usize, [f64; 4])> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words: Vec<&str> =
            line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).collect();
        if rows.len() == 4 {
            return Err(format!("line {number}: a fifth row; a pose has 4 rows of 4 numbers"));
        }
        let mut row = [0.0; 4];
        if words.len() != 4 {
            return Err(format!("line {number}: {} numbers; a pose has 4 rows of 4 numbers", words.len()));
        }
        for (value, word) in row.iter_mut().zip(words) {
            *value = word
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| format!("line {number}: `{word}` is not a finite number"))?;
        }
        rows.push((number, row));
    }
    let [a, b, c, d] = rows[..] else {
        return Err(format!("it has {} rows of numbers; a pose has 4 rows of 4 numbers", rows.len()));
    };
    rigid([a, b, c], d)
}

fn rigid(top: [(usize, [f64; 4]); 3], (last, bottom): (usize, [f64; 4])) -> Result<Rigid, String> {
    if bottom.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(have, want)| (have - want).abs() > 1e-9) {
        return Err(format!("line {last}: the last row of a pose is 0 0 0 1, here it is {bottom:?}"));
    }
    let rows = top.map(|(_, r)| Vector3::new(r[0], r[1], r[2]));
    for i in 0..3 {
        let length = rows[i].norm();
        if (length - 1.0).abs() > TOLERANCE {
            return Err(format!(
                "line {}: the first three numbers have length {length:.6}; in a rigid motion each row of the rotation \
                 has length 1 (no scale, no shear)",
                top[i].0
            ));
        }
        for j in 0..i {
            let dot = rows[i].dot(&rows[j]);
            if dot.abs() > TOLERANCE {
                return Err(format!(
                    "lines {} and {}: the rows of the rotation are not at right angles (their product is {dot:.6}); \
                     is it a rigid motion?",
                    top[j].0, top[i].0
                ));
            }
        }
    }
    let matrix = Matrix3::from_rows(&rows.map(|r| r.transpose()));
    if matrix.determinant() < 0.0 {
        return Err(format!(
            "lines {} to {}: a mirror image, not a rotation (the determinant is -1)",
            top[0].0, top[2].0
        ));
    }
    let off = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    let nearest = if off < EXACT { Some(matrix) } else { Rigid::nearest_rotation(&matrix) };
    let rotation = nearest.ok_or("the rotation is not finite")?;
    Ok(Rigid { rotation, translation: Vector3::new(top[0].1[3], top[1].1[3], top[2].1[3]) })
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    #[test]
    fn the_same_bits_come_back() {
        let rotation = EulerXyz::from_deg([12.3, -45.6, 78.9]).to_matrix();
        let pose = Rigid { rotation, translation: Vector3::new(5e5 + 0.1, -4e6 / 3.0, 1e-9) };
        assert_eq!(parse(&to_text(&pose)), Ok(pose));
        let commas = to_text(&pose).replace(' ', ", ");
        assert_eq!(parse(&format!("# a pose\n\n{commas}")), Ok(pose));
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &str| parse(text).unwrap_err();
        assert!(error("1 0 0 0\n0 1 0\n").starts_with("line 2: 3 numbers"));
        assert!(error("1 0 0 0\n0 1 0 x\n").contains("line 2: `x`"));
        assert!(error("1 0 0 0\n0 1 0 0\n").contains("2 rows"));
        assert!(error("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n").starts_with("line 4"));
        assert!(
            error("1 0 0 0\n0 2 0 0\n0 0 1 0\n0 0 0 1\n")
                .contains("line 2: the first three numbers have length 2")
        );
        assert!(error("1 0 0 0\n0 1 0 0\n0 1 0 0\n0 0 0 1\n").contains("lines 2 and 3"));
        assert!(error("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n").contains("mirror"));
        assert!(error("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 1 1\n").contains("line 5"));
        assert!(error("1 0 0 nan\n").contains("finite"));
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
        let read = parse(&text).unwrap();
        assert!((read.rotation.transpose() * read.rotation - Matrix3::identity()).norm() < 1e-14);
        assert!(read.angle_to_deg(&pose) < 0.01);
    }
}
