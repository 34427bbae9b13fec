//! Putative matches by FPFH, and the choice among them.

use burn::tensor::{Tensor, TensorData};
use srrf_model::ops::{CopyError, HostClouds, nearest, rows, to_host};

use srrf_classical::fpfh::{self, Descriptor, fpfh};
use srrf_classical::nearest_descriptors;

/// Putative matches of a batch.
#[derive(Debug, Clone)]
pub struct PutativeMatches {
    /// `[batch, n, 3]`.
    pub source: Tensor<3>,
    /// `[batch, n, 3]`.
    pub target: Tensor<3>,
    /// Descriptors of the source points, each block summing to about 2: `[batch * n, WIDTH]`.
    pub source_features: Tensor<2>,
    /// Those of the target points.
    pub target_features: Tensor<2>,
}

impl PutativeMatches {
    /// Numbers of a descriptor.
    pub const WIDTH: usize = fpfh::WIDTH;
}

/// Matches each token of the source with the target point whose descriptor is nearest. Descriptors are
/// those of the full clouds; a cloud without any (all points in one place) counts as described by 0.
///
/// # Shapes
/// - `source`, `target`: `[batch, points, 3]`, `tokens`: `[batch, n, 3]`, points of the source
pub(super) fn putative(
    source: &Tensor<3>,
    tokens: &Tensor<3>,
    target: &Tensor<3>,
    radius: f64,
) -> Result<PutativeMatches, CopyError> {
    let ([batch, n, _], [_, points, _]) = (tokens.dims(), target.dims());
    let (sources, token_clouds) = (HostClouds::read(source)?, HostClouds::read(tokens)?);
    let targets = HostClouds::read(target)?;
    let mut chosen = Vec::with_capacity(batch * n);
    let (mut of_source, mut of_target) = (Vec::new(), Vec::new());
    let clouds = sources.iter().zip(token_clouds.iter()).zip(targets.iter());
    for (cloud, ((source, tokens), target)) in clouds.enumerate() {
        let (described, candidates) = (describe(source, radius), describe(target, radius));
        let described: Vec<Descriptor> =
            nearest(tokens, source).into_iter().map(|i| described[i as usize]).collect();
        let found = nearest_descriptors(&described, &candidates);
        of_source.extend(described.iter().flatten().map(|v| v / 100.0));
        of_target.extend(found.iter().flat_map(|&j| candidates[j as usize]).map(|v| v / 100.0));
        chosen.extend(found.into_iter().map(|j| (cloud * points) as i64 + i64::from(j)));
    }
    let device = tokens.device().without_autodiff();
    let features = |values: Vec<f32>| {
        Tensor::from_data(TensorData::new(values, [batch * n, fpfh::WIDTH]), (&device, tokens.dtype()))
    };
    Ok(PutativeMatches {
        source: tokens.clone(),
        target: rows(target.clone().reshape([batch * points, 3]), &chosen).reshape([batch, n, 3]),
        source_features: features(of_source),
        target_features: features(of_target),
    })
}

fn describe(cloud: &[[f32; 3]], radius: f64) -> Vec<Descriptor> {
    let points: Vec<[f64; 3]> = cloud.iter().map(|p| p.map(f64::from)).collect();
    fpfh(&points, radius).unwrap_or_else(|_| vec![[0.0; fpfh::WIDTH]; points.len()])
}

/// Row numbers of the `kept` most similar of the `n` matches of each pair, ties to the first.
pub(super) fn most_similar(similarity: &Tensor<2>, n: usize, kept: usize) -> Result<Vec<i64>, CopyError> {
    let values: Vec<f32> = to_host(similarity)?;
    let mut chosen = Vec::new();
    for (pair, values) in values.chunks_exact(n.max(1)).enumerate() {
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
        chosen.extend(order.into_iter().take(kept).map(|i| (pair * n + i) as i64));
    }
    Ok(chosen)
}
