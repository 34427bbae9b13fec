//! Pictures of skeletons: convex weights, samplings, and the two skeletons of a pair.

use rand::seq::index;
use srrf_cloud::{PointCloud, Register, farthest_point_sampling};
use srrf_corrupt::{Pair, Purpose, Stream};
use srrf_model::PairBatch;
use srrf_model::ops::to_host;
use srrf_model::weights::LoadedModel;

use super::canvas::{BLUE, GREEN, GREY, Grid, RED, View, thinned};
use crate::EvalError;
use crate::methods::{MethodContext, SetupError, network};
use crate::report::document::Picture;

/// Colours of the skeleton points whose weights are shown.
const WEIGHED: [&str; 5] = [RED, BLUE, "#cc79a7", "#e69f00", GREEN];
/// Weights below this share of a column's largest are not drawn.
const VISIBLE: f64 = 0.05;

/// What the extraction module says of a cloud, in network units.
struct Extracted {
    cloud: Vec<[f64; 3]>,
    points: Vec<[f64; 3]>,
    radii: Vec<f64>,
    samples: Vec<[f64; 3]>,
    /// Row by row, one row for each sample, one column for each skeleton point.
    weights: Vec<f64>,
}

/// The skeleton of `cloud` by the network of `context`.
fn extract(context: &MethodContext, cloud: &PointCloud) -> Result<Extracted, EvalError> {
    let failed = |source: SetupError| EvalError::Setup { name: "srrf", source: Box::new(source) };
    let (LoadedModel { model, .. }, _) = network(context).map_err(failed)?;
    let device = srrf_model::device(&context.device).map_err(|e| failed(e.into()))?;
    let batch = PairBatch::new(&[(cloud, cloud)], &device)
        .ok_or_else(|| failed(SetupError::Network("the cloud makes no batch")))?;
    let skeleton = model.sem.forward(batch.source)?;
    let rows = |values: Vec<f64>| values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let frame = batch.frames[0];
    Ok(Extracted {
        cloud: cloud.points().iter().map(|p| frame.source(p)).collect(),
        points: rows(to_host(&skeleton.points)?),
        radii: to_host(&skeleton.radii)?,
        samples: rows(to_host(&skeleton.samples)?),
        weights: to_host(&skeleton.weights)?,
    })
}

/// The convex combinations behind skeleton points, on three shapes: the paper's figure 6.
///
/// # Errors
/// [`EvalError::Setup`] where the network cannot be had.
pub(crate) fn weights(context: &MethodContext, clouds: &[&PointCloud]) -> Result<Picture, EvalError> {
    let mut grid = Grid::new(2 * clouds.len(), 1);
    for (place, cloud) in clouds.iter().enumerate() {
        let found = extract(context, cloud)?;
        let view = View::of(&found.cloud);
        grid.panel(2 * place, 0, "cloud and skeleton");
        grid.dots(&view, &thinned(&found.cloud, 500), GREY, 1.2);
        grid.dots(&view, &found.points, RED, 3.5);
        grid.panel(2 * place + 1, 0, "weights of five points");
        grid.dots(&view, &thinned(&found.samples, 300), "#d8d8d8", 1.2);
        let columns = found.points.len();
        for (at, skeleton) in farthest_point_sampling(&found.points, WEIGHED.len(), 0).into_iter().enumerate()
        {
            let colour = WEIGHED[at];
            let weight =
                |sample: usize| found.weights.get(sample * columns + skeleton).copied().unwrap_or(0.0);
            let largest = (0..found.samples.len()).map(weight).fold(0.0, f64::max);
            for (index, sample) in found.samples.iter().enumerate() {
                let share = weight(index) / largest;
                if share > VISIBLE {
                    grid.line(&view, [&found.points[skeleton], sample], colour, 0.15 + 0.7 * share);
                    grid.dots(&view, &[*sample], colour, 1.0 + 2.5 * share);
                }
            }
            grid.dots(&view, &[found.points[skeleton]], colour, 6.0);
        }
    }
    Ok(Picture {
        file: "skeleton-weights.svg".into(),
        caption: format!(
            "Skeleton points as convex combinations of sampled points (figure 6): lines lead to every sample whose \
             weight is above {} % of the largest",
            100.0 * VISIBLE
        ),
        svg: grid.svg(),
    })
}

/// Random, farthest point and skeleton samples of shapes: the paper's figure 8.
///
/// # Errors
/// [`EvalError::Setup`] where the network cannot be had.
pub(crate) fn samplings(
    context: &MethodContext,
    clouds: &[&PointCloud],
    seed: u64,
) -> Result<Picture, EvalError> {
    let mut grid = Grid::new(3, clouds.len());
    for (row, cloud) in clouds.iter().enumerate() {
        let found = extract(context, cloud)?;
        let view = View::of(&found.cloud);
        let count = found.points.len().min(found.cloud.len());
        let mut rng = Stream { seed, item: row as u64 }.rng(Purpose::Choice);
        let at = |indices: Vec<usize>| -> Vec<[f64; 3]> { indices.iter().map(|&i| found.cloud[i]).collect() };
        let random = at(index::sample(&mut rng, found.cloud.len(), count).into_vec());
        let farthest = at(farthest_point_sampling(&found.cloud, count, 0));
        for (column, (title, chosen)) in
            [("random", &random), ("farthest point", &farthest), ("skeleton", &found.points)]
                .into_iter()
                .enumerate()
        {
            grid.panel(column, row, &format!("{title}, {count} points"));
            grid.dots(&view, &thinned(&found.cloud, 500), GREY, 1.2);
            if column == 2 {
                found.points.iter().zip(&found.radii).for_each(|(p, r)| grid.circle(&view, p, *r, RED));
            }
            grid.dots(&view, chosen, RED, 3.5);
        }
    }
    Ok(Picture {
        file: "samplings.svg".into(),
        caption:
            "Three ways to choose few points (figure 8); circles have the radii of the skeleton's spheres"
                .into(),
        svg: grid.svg(),
    })
}

/// The skeletons of corrupted pairs under the true pose, by one network or several: the paper's figure
/// 10. Pairs come with what they are called.
pub(crate) fn agreement(networks: &[(&str, &dyn Register)], pairs: &[(String, Pair)]) -> Option<Picture> {
    let width = 1 + networks.len();
    let mut grid = Grid::new(2 * width, pairs.len().div_ceil(2));
    for (place, (name, pair)) in pairs.iter().enumerate() {
        let (left, row) = (width * (place % 2), place / 2);
        let truth = &pair.target_from_source;
        let view = View::of(pair.target.points());
        grid.panel(left, row, name);
        grid.dots(&view, &thinned(pair.target.points(), 400), GREEN, 1.4);
        grid.dots(&view, &thinned(pair.source.transformed(truth).points(), 400), BLUE, 1.4);
        for (at, (network, register)) in networks.iter().enumerate() {
            let skeletons = register.register(&pair.source, &pair.target).ok()?.skeletons?;
            let moved: Vec<[f64; 3]> = skeletons.source.points.iter().map(|p| truth.apply(p)).collect();
            grid.panel(left + 1 + at, row, network);
            grid.dots(&view, &skeletons.target.points, GREEN, 4.5);
            grid.dots(&view, &moved, RED, 3.0);
        }
    }
    Some(Picture {
        file: "skeletons.svg".into(),
        caption: "Skeletons of corrupted pairs under the true pose (figure 10): clouds of source (blue) and target \
                  (green); skeleton of the source red, of the target green"
            .into(),
        svg: grid.svg(),
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand::rngs::ChaCha8Rng;

    use super::*;
    use crate::data;

    #[test]
    fn skeletons_are_drawn_from_the_models_own_numbers() {
        /// Skeleton points of the default model.
        const POINTS: usize = 256;
        let shapes = data::procedural(1).unwrap();
        let cloud = shapes.sample(0, 300, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let context = MethodContext::of_srrf(None, "flex");
        let found = extract(&context, &cloud).unwrap();
        assert_eq!((found.points.len(), found.radii.len()), (POINTS, POINTS));
        assert_eq!(found.weights.len(), found.samples.len() * POINTS);
        // S = W^T X*: the weights of a skeleton point sum to 1 and give it back.
        let column: Vec<f64> = (0..found.samples.len()).map(|i| found.weights[POINTS * i + 5]).collect();
        assert!((column.iter().sum::<f64>() - 1.0).abs() < 1e-4);
        for c in 0..3 {
            let combined: f64 = column.iter().zip(&found.samples).map(|(w, p)| w * p[c]).sum();
            assert!((combined - found.points[5][c]).abs() < 1e-4);
        }
        let figure = samplings(&context, &[&cloud], 1).unwrap();
        assert_eq!(figure.svg.matches("<circle").count(), POINTS);
        assert!(weights(&context, &[&cloud]).unwrap().svg.matches("<path").count() > 12);
    }
}
