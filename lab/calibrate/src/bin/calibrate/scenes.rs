//! Public scan pairs, and pairs of meshes: a table `name,source,target,pose,kind,...` with files of clouds and poses beside it. Pairs whose
//! kind begins with `mesh` are of [`Group::Meshes`]; the first word of their name is the mesh.

use std::path::Path;

use nalgebra::Rotation3;
use rand::RngExt;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf::{Method, RotationRange};
use srrf_cloud::io::read_cloud;
use srrf_cloud::{PointCloud, Rigid};
use srrf_corrupt::crop::random_direction;

use crate::pairs::{Case, Group, Way, drawn_method, guess};

/// A row of the table.
pub struct Scene {
    pub name: String,
    pub kind: String,
    source: PointCloud,
    target: PointCloud,
    /// None where the two share nothing.
    truth: Option<Rigid>,
}

/// The pairs of a table that can be judged: those with a pose, and those of the kind `no overlap`.
pub fn read(table: &Path) -> Result<Vec<Scene>, Box<dyn std::error::Error>> {
    let folder = table.parent().unwrap_or(Path::new("."));
    let mut scenes = Vec::new();
    for line in std::fs::read_to_string(table)?.lines().skip(1) {
        let columns: Vec<&str> = line.split(',').collect();
        let [name, source, target, pose, kind, ..] = columns[..] else { continue };
        let truth = if pose.is_empty() { None } else { Some(matrix(&folder.join(pose))?) };
        if truth.is_none() && kind != "no overlap" {
            continue;
        }
        // What this program cannot read is left out.
        let (Ok(source), Ok(target)) = (read_cloud(&folder.join(source)), read_cloud(&folder.join(target)))
        else {
            println!("{name}: left out");
            continue;
        };
        scenes.push(Scene { name: name.into(), kind: kind.into(), source, target, truth });
    }
    Ok(scenes)
}

fn matrix(path: &Path) -> Result<Rigid, Box<dyn std::error::Error>> {
    let numbers: Vec<f64> =
        std::fs::read_to_string(path)?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
    let at = |i: usize, j: usize| numbers.get(4 * i + j).copied().ok_or("12 numbers are needed");
    let mut pose = Rigid::identity();
    for i in 0..3 {
        for j in 0..3 {
            pose.rotation[(i, j)] = at(i, j)?;
        }
        pose.translation[i] = at(i, 3)?;
    }
    Ok(pose)
}

impl Scene {
    fn is_mesh(&self) -> bool {
        self.kind.starts_with("mesh")
    }

    /// How often this pair is tried.
    pub fn tries(&self) -> u64 {
        if self.is_mesh() { 1 } else { 4 }
    }

    /// Try `number` of this pair: 0 as given, 1 and 2 turned by anything, 3 from a good first guess. Of meshes, which are turned by
    /// anything as they are, one try, by one of the methods.
    pub fn case(&self, number: u64) -> Case {
        let seed = self.name.bytes().fold(number, |h, b| h.wrapping_mul(31).wrapping_add(u64::from(b)));
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        if self.is_mesh() {
            let method = drawn_method(&mut rng);
            return Case {
                group: Group::Meshes,
                kind: self.kind.clone(),
                source: self.source.clone(),
                target: self.target.clone(),
                truth: self.truth,
                initial: (method == Method::Given).then(|| guess(self.truth.as_ref(), &mut rng)).flatten(),
                way: Way { method, rotation: RotationRange::Any },
            };
        }
        let turn = if number == 1 || number == 2 {
            let axis = random_direction(&mut rng) * rng.random_range(0.5..std::f64::consts::PI);
            Rigid { rotation: Rotation3::from_scaled_axis(axis).into_inner(), ..Rigid::identity() }
        } else {
            Rigid::identity()
        };
        let truth = self.truth.map(|t| t.compose(&turn.inverse()));
        let initial = (number == 3).then(|| {
            let by = random_direction(&mut rng) * 3f64.to_radians();
            let off = Rigid { rotation: Rotation3::from_scaled_axis(by).into_inner(), ..Rigid::identity() };
            truth.unwrap_or_else(Rigid::identity).compose(&off)
        });
        let method = if number == 3 { Method::Given } else { Method::Auto };
        Case {
            group: Group::Scans,
            kind: self.kind.clone(),
            source: self.source.transformed(&turn),
            target: self.target.clone(),
            truth,
            initial,
            way: Way { method, rotation: RotationRange::Any },
        }
    }

    /// Whether it is for measuring only: every other one, by the first word of its name.
    pub fn held_out(&self) -> bool {
        self.name.split(' ').next().unwrap_or_default().bytes().map(u64::from).sum::<u64>() % 2 == 1
    }
}
