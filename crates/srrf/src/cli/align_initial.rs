//! What an alignment begins with: an earlier result, or first guesses in JSON, TUM or KITTI.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use srrf_args::{Failure, files};
use srrf_cloud::Rigid;
use srrf_cloud::io::ReadOptions;

use super::align_poses::{SCHEMA, SCHEMA_VERSION, rigid_of};

/// An earlier result.
#[derive(Debug, Deserialize)]
pub struct EarlierMap {
    schema: String,
    schema_version: u64,
    /// Its scans.
    pub scans: Vec<EarlierScan>,
    #[serde(skip)]
    folder: PathBuf,
}

/// A scan of an earlier result.
#[derive(Debug, Deserialize)]
pub struct EarlierScan {
    name: String,
    component: usize,
    map_from_scan: [[f64; 4]; 4],
}

/// Reads the JSON of `--output`.
///
/// # Errors
/// [`Failure::usage`], which names the file and what is wrong with it.
pub fn read_result(path: &Path, options: &ReadOptions) -> Result<EarlierMap, Failure> {
    let text = files::read_text(path, options, "it should be what --output wrote")?;
    let mut known = known_of(&text).map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))?;
    known.folder = path.parent().map(Path::to_owned).unwrap_or_default();
    Ok(known)
}

fn known_of(text: &str) -> Result<EarlierMap, String> {
    let known: EarlierMap =
        serde_json::from_str(text).map_err(|e| format!("it is not what --output wrote: {e}"))?;
    if known.schema != SCHEMA || known.schema_version != SCHEMA_VERSION {
        return Err(format!(
            "it is {} version {}; this program reads {SCHEMA} version {SCHEMA_VERSION}",
            known.schema, known.schema_version
        ));
    }
    known
        .scans
        .iter()
        .try_for_each(|s| rigid_of(&s.map_from_scan).map(|_| ()))
        .map_err(|e| format!("a pose: {e}"))?;
    Ok(known)
}

impl EarlierMap {
    /// The files of the scans: as written, or beside the result where they are not there.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.scans
            .iter()
            .map(|s| {
                let beside = self.folder.join(&s.name);
                if !Path::new(&s.name).exists() && beside.exists() { beside } else { PathBuf::from(&s.name) }
            })
            .collect()
    }

    /// First guesses for these scans and more of which nothing is known: those of the largest map.
    pub fn guesses(&self, scans: usize) -> Vec<Option<Rigid>> {
        let mut guesses: Vec<Option<Rigid>> = self
            .scans
            .iter()
            .map(|s| if s.component == 0 { rigid_of(&s.map_from_scan).ok() } else { None })
            .collect();
        guesses.resize(scans, None);
        guesses
    }
}

/// First guesses from a file, one a scan: JSON of `--output` (by the names of the scans), TUM or KITTI (by their order).
///
/// # Errors
/// [`Failure::usage`], which names the file and what is wrong with it.
pub fn read_initial(
    path: &Path,
    names: &[String],
    options: &ReadOptions,
) -> Result<Vec<Option<Rigid>>, Failure> {
    let text = files::read_text(path, options, "it should hold poses: JSON, TUM or KITTI")?;
    initial_of(&text, names).map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))
}

fn initial_of(text: &str, names: &[String]) -> Result<Vec<Option<Rigid>>, String> {
    if text.trim_start().starts_with('{') {
        let known = known_of(text)?;
        let mut guesses = vec![None; names.len()];
        for scan in &known.scans {
            if let Some(at) = names.iter().position(|n| *n == scan.name) {
                guesses[at] = if scan.component == 0 { Some(rigid_of(&scan.map_from_scan)?) } else { None };
            }
        }
        if guesses.iter().all(Option::is_none) {
            return Err("it names none of these scans; name them as in the run that wrote it".into());
        }
        return Ok(guesses);
    }
    let rows = numbers(text)?;
    match rows.first().map(|(_, row)| row.len()) {
        Some(12) => by_order(&rows, names.len(), |row| {
            rigid_of(&std::array::from_fn(|r| {
                if r < 3 { std::array::from_fn(|c| row[4 * r + c]) } else { [0.0, 0.0, 0.0, 1.0] }
            }))
        }),
        Some(8) => by_time(&rows, names.len()),
        Some(n) => Err(format!(
            "its first row has {n} numbers; TUM has 8 (time, tx ty tz, qx qy qz qw), KITTI 12 (3 rows of 4)"
        )),
        None => Err("it holds no pose".into()),
    }
}

/// The numbers of each line that has any, with the number of the line.
fn numbers(text: &str) -> Result<Vec<(usize, Vec<f64>)>, String> {
    let mut rows = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let row: Vec<f64> = words
            .map(|w| {
                w.parse()
                    .ok()
                    .filter(|v: &f64| v.is_finite())
                    .ok_or(format!("line {number}: `{w}` is not a finite number"))
            })
            .collect::<Result<_, _>>()?;
        rows.push((number, row));
    }
    Ok(rows)
}

fn by_order(
    rows: &[(usize, Vec<f64>)],
    scans: usize,
    pose: impl Fn(&[f64]) -> Result<Rigid, String>,
) -> Result<Vec<Option<Rigid>>, String> {
    if rows.len() != scans {
        return Err(format!(
            "it holds {} poses for {scans} scans; give one for each, in the order of the scans",
            rows.len()
        ));
    }
    let width = rows[0].1.len();
    rows.iter()
        .map(|(line, row)| {
            if row.len() != width {
                return Err(format!("line {line}: {} numbers, where the first row has {width}", row.len()));
            }
            pose(row).map(Some).map_err(|e| format!("line {line}: {e}"))
        })
        .collect()
}

/// TUM: where the times are the numbers of scans they say which; other times go by order.
fn by_time(rows: &[(usize, Vec<f64>)], scans: usize) -> Result<Vec<Option<Rigid>>, String> {
    let whole = |t: f64| t >= 0.0 && t.fract() == 0.0 && t < scans as f64;
    let mut numbers: Vec<f64> = rows.iter().filter_map(|(_, row)| row.first().copied()).collect();
    numbers.sort_by(f64::total_cmp);
    let named = numbers.iter().all(|t| whole(*t)) && numbers.windows(2).all(|w| w[0] < w[1]);
    if !named {
        return by_order(rows, scans, tum_pose);
    }
    let mut guesses = vec![None; scans];
    for (line, row) in rows {
        guesses[row[0] as usize] = Some(tum_pose(row).map_err(|e| format!("line {line}: {e}"))?);
    }
    Ok(guesses)
}

fn tum_pose(row: &[f64]) -> Result<Rigid, String> {
    let &[_, x, y, z, qx, qy, qz, qw] = row else {
        return Err(format!("{} numbers; a pose of TUM has 8 (time, tx ty tz, qx qy qz qw)", row.len()));
    };
    let q = Quaternion::new(qw, qx, qy, qz);
    if (q.norm() - 1.0).abs() > 1e-2 {
        return Err(format!("a quaternion of length {:.4}; it should be 1", q.norm()));
    }
    let rotation = UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner();
    Ok(Rigid { rotation, translation: Vector3::new(x, y, z) })
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use srrf_cloud::EulerXyz;

    use super::super::align_poses::matrix;
    use super::*;

    fn pose(s: f64) -> Rigid {
        Rigid {
            rotation: EulerXyz::from_deg([10.0 * s, -50.0, 160.0]).to_matrix(),
            translation: Vector3::new(s, 2.0, -3.0),
        }
    }

    fn names(n: usize) -> Vec<String> {
        (0..n).map(|i| format!("{i}.ply")).collect()
    }

    fn near(a: Option<Rigid>, b: &Rigid) -> bool {
        a.is_some_and(|a| (a.to_matrix4() - b.to_matrix4()).norm() < 1e-12)
    }

    #[test]
    fn kitti_goes_by_order() {
        let row = |p: &Rigid| {
            let m = p.to_matrix4();
            (0..12).map(|k| format!("{:e} ", m[(k / 4, k % 4)])).collect::<String>() + "\n"
        };
        let text = row(&pose(1.0)) + &row(&pose(2.0));
        let found = initial_of(&text, &names(2)).unwrap();
        assert!(near(found[0], &pose(1.0)) && near(found[1], &pose(2.0)));
        assert!(initial_of(&text, &names(3)).unwrap_err().contains("2 poses for 3 scans"));
        assert!(initial_of(&(text + "1 2 3\n"), &names(3)).unwrap_err().starts_with("line 3: 3 numbers"));
    }

    #[test]
    fn tum_goes_by_number_or_by_order() {
        let row = |t: f64, p: &Rigid| {
            let q = p.quaternion_xyzw();
            let v = p.translation;
            format!("{t} {:e} {:e} {:e} {:e} {:e} {:e} {:e}\n", v.x, v.y, v.z, q[0], q[1], q[2], q[3])
        };
        let text = String::from("# a comment\n") + &row(2.0, &pose(1.0)) + &row(0.0, &pose(2.0));
        let found = initial_of(&text, &names(3)).unwrap();
        assert!(found[1].is_none() && near(found[2], &pose(1.0)) && near(found[0], &pose(2.0)));
        let timed = row(1305031102.17, &pose(1.0)) + &row(1305031103.2, &pose(2.0));
        let found = initial_of(&timed, &names(2)).unwrap();
        assert!(near(found[0], &pose(1.0)) && near(found[1], &pose(2.0)));
        assert!(
            initial_of("0 1 2 3 1 1 0 0\n", &names(1)).unwrap_err().contains("quaternion of length 1.4142")
        );
        assert!(initial_of("1 2 3\n", &names(1)).unwrap_err().contains("TUM has 8"));
        assert!(initial_of("\n", &names(1)).unwrap_err().contains("no pose"));
    }

    #[test]
    fn json_goes_by_name() {
        let scan = |name: &str, component: usize, p: &Rigid| json!({ "name": name, "component": component, "map_from_scan": matrix(p), "other": 1 });
        let value = json!({ "schema": SCHEMA, "schema_version": 1,
            "scans": [scan("1.ply", 0, &pose(1.0)), scan("0.ply", 1, &pose(2.0)), scan("9.ply", 0, &pose(3.0))] });
        let found = initial_of(&value.to_string(), &names(2)).unwrap();
        assert!(found[0].is_none() && near(found[1], &pose(1.0)));
        assert!(
            initial_of(&value.to_string(), &["x".to_owned()]).unwrap_err().contains("none of these scans")
        );
        let newer = value.to_string().replace("\"schema_version\":1", "\"schema_version\":7");
        assert!(initial_of(&newer, &names(2)).unwrap_err().contains("version 7"));
        assert!(initial_of("{}", &names(2)).unwrap_err().contains("not what --output wrote"));
    }
}
