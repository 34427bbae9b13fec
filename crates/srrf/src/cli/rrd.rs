//! `--rrd`: a Rerun recording of an answer, in builds with the feature `rerun`.

use std::path::Path;

use srrf::Outcome;
use srrf_args::Failure;
use srrf_args::files::Input;

/// Refuses, before any work, what this build cannot write.
///
/// # Errors
/// [`Failure::usage`] with the way to a build that can.
#[cfg(not(feature = "rerun"))]
pub fn check(_: &Path) -> Result<(), Failure> {
    Err(Failure::usage(
        "--rrd: this build writes no Rerun recordings; build with `cargo build -p srrf --features rerun`, or use \
         --html"
            .into(),
    ))
}

/// This build can.
///
/// # Errors
/// None.
#[cfg(feature = "rerun")]
pub fn check(_: &Path) -> Result<(), Failure> {
    Ok(())
}

#[cfg(not(feature = "rerun"))]
pub fn write(path: &Path, _: &Outcome, _: &Input, _: &Input) -> Result<(), Failure> {
    check(path)
}

#[cfg(feature = "rerun")]
pub use recording::write;

#[cfg(feature = "rerun")]
mod recording {
    use std::path::Path;

    use nalgebra::Vector3;
    use rerun::{
        LineStrips3D, Mat3x3, Points3D, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
        TextDocument, Transform3D, Vec3D,
    };
    use srrf_cloud::{PointCloud, Rigid};

    use super::{Failure, Input, Outcome};
    use srrf_args::files;

    const SOURCE: u32 = 0xD55E_00FF;
    const TARGET: u32 = 0x0072_B2FF;
    const BEFORE: u32 = 0x9AA0_A6FF;
    const MATCHES: u32 = 0x882E_72FF;
    /// Soft matches to draw: the strongest.
    const MOST_MATCHES: usize = 80;

    /// Writes the recording: the target, the source before and after, the skeletons with their radii and the
    /// strongest soft matches, relative to the middle of the target, since Rerun keeps `f32`.
    ///
    /// # Errors
    /// [`Failure`] where it cannot be made or written; the file appears whole or not at all.
    pub fn write(path: &Path, outcome: &Outcome, source: &Input, target: &Input) -> Result<(), Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::failed(format!("{}: {e}", path.display()));
        let (stream, storage) = RecordingStreamBuilder::new("srrf").memory().map_err(|e| failed(&e))?;
        log(&stream, outcome, source, target).map_err(|e| failed(&e))?;
        let bytes = storage.drain_as_bytes().map_err(|e| failed(&e))?;
        files::write(path, &bytes)
    }

    fn log(
        stream: &RecordingStream,
        outcome: &Outcome,
        source: &Input,
        target: &Input,
    ) -> RecordingStreamResult<()> {
        let middle = |cloud: &PointCloud| cloud.centroid();
        let (from, to) = (middle(&source.cloud), middle(&target.cloud));
        let place = |points: &[[f64; 3]], centre: &Vector3<f64>| -> Vec<[f32; 3]> {
            points.iter().map(|p| std::array::from_fn(|c| (p[c] - centre[c]) as f32)).collect()
        };
        // Where points about the middle of the source lie about the middle of the target.
        let transform = |pose: &Rigid| {
            let shift = Vector3::from(pose.apply(&from.into())) - to;
            let column = |j: usize| std::array::from_fn::<f32, 3, _>(|i| pose.rotation[(i, j)] as f32);
            Transform3D::from_translation_mat3x3(
                Vec3D::from(std::array::from_fn::<f32, 3, _>(|c| shift[c] as f32)),
                Mat3x3::from([column(0), column(1), column(2)].concat().try_into().unwrap_or([0.0; 9])),
            )
        };
        let about = format!(
            "origin of this recording, in target coordinates: {:?}\n\n```json\n{:#}\n```\n",
            <[f64; 3]>::from(to),
            outcome.to_json()
        );
        stream.log_static("result", &TextDocument::from_markdown(about))?;
        let points = |cloud: &PointCloud, centre, colour| {
            Points3D::new(place(cloud.points(), centre)).with_colors([colour])
        };
        stream.log_static("target/points", &points(&target.cloud, &to, TARGET))?;
        stream.log_static("source", &transform(&outcome.target_from_source))?;
        stream.log_static("source/points", &points(&source.cloud, &from, SOURCE))?;
        stream.log_static("source_as_given", &transform(&Rigid::identity()))?;
        stream.log_static("source_as_given/points", &points(&source.cloud, &from, BEFORE))?;
        let Some(network) = &outcome.network else { return Ok(()) };
        if let Some(skeletons) = &network.skeletons {
            let sides =
                [("source", &skeletons.source, &from, SOURCE), ("target", &skeletons.target, &to, TARGET)];
            for (name, skeleton, centre, colour) in sides {
                let spheres = Points3D::new(place(&skeleton.points, centre))
                    .with_radii(skeleton.radii.iter().map(|r| *r as f32))
                    .with_colors([colour]);
                stream.log_static(format!("{name}/skeleton"), &spheres)?;
            }
        }
        let mut matches = network.matches.clone();
        matches.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let lines = matches.iter().take(MOST_MATCHES).map(|m| {
            let moved = outcome.target_from_source.apply(&m.source);
            place(&[moved, m.target], &to)
        });
        stream.log_static("matches", &LineStrips3D::new(lines).with_colors([MATCHES]))
    }
}
