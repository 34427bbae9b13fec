//! Registers two large clouds and says how long each stage takes:
//! `cargo run -p srrf-baselines --example two_scans -- [SOURCE TARGET [POSE]]`, two files in any format that is
//! read, and a text file with the 4 x 4 matrix that maps the source into the target, to compare with.
//! Without files, two samplings of a built-in shape with 35,000 points each, of which each lacks a part.

#![allow(clippy::print_stdout, reason = "a program that prints")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use nalgebra::Matrix4;
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_baselines::{Fgr, FgrConfig, FpfhRansac, FpfhRansacConfig};
use srrf_cloud::source::ShapeSource;
use srrf_cloud::{EulerXyz, PointCloud, Register, Rigid, io, shapes::ProceduralShapes};
use srrf_refine::{RefineConfig, refine};

/// The built-in shape: one that no rotation maps onto itself.
const SHAPE: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let (source, target, truth) = match &files[..] {
        [source, target, pose @ ..] => {
            let truth = pose.first().map(|path| matrix(Path::new(path))).transpose()?;
            (io::read_cloud(Path::new(source))?, io::read_cloud(Path::new(target))?, truth)
        }
        [] => {
            let (source, target, truth) = generated()?;
            (source, target, Some(truth))
        }
        _ => return Err("usage: two_scans [SOURCE TARGET [POSE]]".into()),
    };
    println!("{} and {} points", source.len(), target.len());
    let global: [Box<dyn Register>; 2] = [
        Box::new(FpfhRansac::new(FpfhRansacConfig { refine: None, ..FpfhRansacConfig::default() })),
        Box::new(Fgr::new(FgrConfig { refine: None, ..FgrConfig::default() })),
    ];
    for method in &global {
        let clock = Instant::now();
        let coarse = method.register(&source, &target)?.target_from_source;
        let global_time = clock.elapsed();
        let clock = Instant::now();
        let found = refine(&source, &target, &[("coarse", coarse)], &RefineConfig::default())?;
        let refine_time = clock.elapsed();
        println!("{}: {global_time:.0?} + refinement {refine_time:.0?}", method.name());
        if let Some(truth) = &truth {
            for (what, pose) in [("off by", coarse), ("refined", found.target_from_source)] {
                // Where the middle of the source goes.
                let middle = source.centroid();
                let place = |p: &Rigid| p.rotation * middle + p.translation;
                println!(
                    "  {what} {:.3} degrees, {:.3e} at the middle",
                    pose.angle_to_deg(truth),
                    (place(&pose) - place(truth)).norm()
                );
            }
        }
        let evidence = &found.evidence;
        println!(
            "  {}; fitness {:.3}, overlap of the target {:.3}, inlier rmse {:.3e}, spacing {:.3e}",
            found.verdict, evidence.fitness, evidence.overlap_target, evidence.inlier_rmse, evidence.spacing
        );
        println!("{}", found.target_from_source.to_matrix4());
    }
    Ok(())
}

/// A pose in 16 numbers, row by row.
fn matrix(path: &Path) -> Result<Rigid, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    if numbers.len() != 16 {
        return Err(format!("{}: {} numbers, a 4 x 4 matrix has 16", path.display(), numbers.len()).into());
    }
    let m = Matrix4::from_row_slice(&numbers);
    Ok(Rigid {
        rotation: m.fixed_view::<3, 3>(0, 0).into_owned(),
        translation: m.fixed_view::<3, 1>(0, 3).into_owned(),
    })
}

/// Two partial samplings of one surface, and the pose between them.
fn generated() -> Result<(PointCloud, PointCloud, Rigid), Box<dyn Error>> {
    let shapes = ProceduralShapes::new(7, 9, None)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (a, b) = shapes.sample_two(SHAPE, 42_000, &mut rng)?;
    let cut = |cloud: PointCloud, keep: fn(&[f64; 3]) -> f64| {
        let mut points = cloud.into_points();
        points.sort_by(|p, q| keep(p).total_cmp(&keep(q)));
        points.truncate(35_000);
        PointCloud::new(points)
    };
    let truth = Rigid {
        rotation: EulerXyz::from_deg([35.0, -20.0, 110.0]).to_matrix(),
        translation: [0.4, -0.2, 0.3].into(),
    };
    Ok((cut(a, |p| p[0] + p[2])?, cut(b, |p| -p[0])?.transformed(&truth), truth))
}
