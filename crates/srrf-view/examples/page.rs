//! Writes a page of generated clouds:
//! `cargo run -p srrf-view --example page -- out.html --points 3000 --pairs 1 --offset 0,0,0`. The
//! options are optional; the offset is added to the target, as surveys have it.
//!
//! The poses are made, not found: the true one, one that is 6 degrees off and one upside down. So
//! are the skeletons (a few points of the shape) and the matches.

use std::error::Error;
use std::path::PathBuf;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use srrf_cloud::{EulerXyz, KnnIndex, PointCloud, Rigid, Skeleton, SoftMatch, farthest_point_sampling};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_view::{Number, Page, Pair, PointValues, Pose, Tone};

const USAGE: &str = "usage: page OUT.html [--points N] [--pairs N] [--offset X,Y,Z]";

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = PathBuf::from(arguments.next().ok_or(USAGE)?);
    let (mut points, mut count, mut offset) = (3000, 1, Vector3::zeros());
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or(USAGE)?;
        match option.as_str() {
            "--points" => points = value.parse()?,
            "--pairs" => count = value.parse()?,
            "--offset" => {
                let parts = value.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
                offset = Vector3::from(<[f64; 3]>::try_from(parts).map_err(|_| USAGE)?);
            }
            _ => return Err(USAGE.into()),
        }
    }
    let truth = rigid([20.0, -35.0, 50.0], (Vector3::new(0.5, -0.2, 0.3) + offset).into());
    let families = ["airplane", "chair", "quadruped", "bicycle"];
    let known = srrf_corrupt::shapes::FAMILIES.iter().map(|family| family.name);
    let families: Vec<&str> = known.filter(|name| families.contains(name)).collect();
    let families = (!families.is_empty()).then_some(families.as_slice());
    let shapes = ProceduralShapes::new(4, count.max(1), families)?;

    let mut clouds = Vec::new();
    for index in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let (source, target) = shapes.sample_two(index, points, &mut rng)?;
        // A part of the target is missing.
        let kept: Vec<[f64; 3]> = target.points().iter().copied().filter(|p| p[0] + p[1] < 0.6).collect();
        clouds.push((source, PointCloud::new(kept)?.transformed(&truth)));
    }
    let mut page = Page::new(format!("Registration of generated shapes, {points} points"));
    let painted: Vec<_> = clouds.iter().map(|(source, _)| paint(source)).collect();
    for (index, ((source, target), (colours, intensities))) in clouds.iter().zip(&painted).enumerate() {
        let values = PointValues { colours: Some(colours), intensities: Some(intensities) };
        let pair = pair(&shapes.id(index), source, target, &truth)?;
        page = page.pair(pair.values(values, PointValues::default()));
    }
    Ok(page.write(&out)?)
}

fn pair<'a>(
    name: &str,
    source: &'a PointCloud,
    target: &'a PointCloud,
    truth: &Rigid,
) -> Result<Pair<'a>, Box<dyn Error>> {
    let near = truth.compose(&rigid([6.0, 0.0, 0.0], [0.02, 0.0, 0.01]));
    let flipped = truth.compose(&rigid([180.0, 0.0, 0.0], [0.0; 3]));
    let pose = |name: &str, pose: Rigid| {
        Pose::new(name, pose)
            .number(Number::new("Rotation error", pose.angle_to_deg(truth)).unit("°"))
            .number(Number::new("Translation error", (pose.translation - truth.translation).norm()).unit("m"))
    };
    let index = KnnIndex::new(target.points())?;
    let matched = farthest_point_sampling(&source.points()[..source.len().min(20_000)], 80, 0);
    let matches = matched.iter().map(|&i| {
        let from = source.points()[i];
        let (nearest, squared) = index.nearest(&truth.apply(&from));
        SoftMatch { source: from, target: target.points()[nearest], weight: (-squared / 0.01).exp() }
    });
    let skeletons = (skeleton(source)?, skeleton(target)?);
    Ok(Pair::new(name, source, target)
        .unit("m")
        .pose(pose("result", *truth))
        .pose(pose("6 degrees off", near))
        .pose(pose("upside down", flipped))
        .skeletons(skeletons.0, skeletons.1)
        .matches(matches)
        .number(
            Number::text("Verdict", "right")
                .tone(Tone::Good)
                .help("the pose is the one that the pair was made with"),
        )
        .number(Number::text(
            "Refinement",
            "the best start was kept, since the clouds look deformed in its pose",
        ))
        .number(Number::new("Points, source", source.len() as f64))
        .number(Number::new("Points, target", target.len() as f64))
        .warning("This pair is generated, and its poses are made rather than found."))
}

/// Colours by place, and intensities by height.
fn paint(cloud: &PointCloud) -> (Vec<[u8; 3]>, Vec<f64>) {
    let byte = |x: f64| (127.5 * (1.0 + x.clamp(-1.0, 1.0))) as u8;
    (cloud.points().iter().map(|p| p.map(byte)).collect(), cloud.points().iter().map(|p| p[2]).collect())
}

/// A few points, each drawn into the middle of its neighbourhood.
fn skeleton(cloud: &PointCloud) -> Result<Skeleton, Box<dyn Error>> {
    let few = &cloud.points()[..cloud.len().min(4000)];
    let index = KnnIndex::new(few)?;
    let mut skeleton = Skeleton::default();
    for i in farthest_point_sampling(few, 40, 0) {
        let near = index.k_nearest(&few[i], few.len() / 25);
        let sum: Vector3<f64> = near.iter().map(|&(j, _)| Vector3::from(few[j])).sum();
        let centre = sum / near.len().max(1) as f64;
        skeleton.points.push(centre.into());
        skeleton.radii.push(index.nearest(&centre.into()).1.sqrt().max(0.015));
    }
    Ok(skeleton)
}

fn rigid(euler_deg: [f64; 3], translation: [f64; 3]) -> Rigid {
    Rigid { rotation: EulerXyz::from_deg(euler_deg).to_matrix(), translation: translation.into() }
}
