//! The assignment that RGM learns.

use burn::tensor::Tensor;
use srrf_model::ops::{CopyError, HostClouds, nearest};

use crate::se3::constant;

/// Which source node belongs to which target node, 0 or 1, at most one to one: each other's nearest
/// within `radius`; then the nearest that is still free, within `radius` from the source's side; then any
/// that are still free, within twice the radius.
///
/// # Shapes
/// - `posed`: the source nodes under the true pose, `[batch, n, 3]`; `target`: `[batch, m, 3]`
/// - output: `[batch, n, m]`
pub(super) fn assignment(posed: &Tensor<3>, target: &Tensor<3>, radius: f64) -> Result<Tensor<3>, CopyError> {
    let ([batch, n, _], [_, m, _]) = (posed.dims(), target.dims());
    let (sources, targets) = (HostClouds::read(posed)?, HostClouds::read(target)?);
    let mut truth = vec![0.0_f64; batch * n * m];
    for (cloud, (source, target)) in sources.iter().zip(targets.iter()).enumerate() {
        let (forth, back) = (nearest(source, target), nearest(target, source));
        let (mut row_free, mut column_free) = (vec![true; n], vec![true; m]);
        let mut keep = |i: usize, j: usize, within: f64| {
            if row_free[i] && column_free[j] && distance(&source[i], &target[j]) < within {
                (row_free[i], column_free[j]) = (false, false);
                truth[(cloud * n + i) * m + j] = 1.0;
            }
        };
        for (i, &j) in forth.iter().enumerate().filter(|&(i, &j)| back[j as usize] as usize == i) {
            keep(i, j as usize, radius);
        }
        forth.iter().enumerate().for_each(|(i, &j)| keep(i, j as usize, radius));
        let near = |i: usize, j: usize| distance(&source[i], &target[j]);
        let mut left: Vec<(f64, usize, usize)> = (0..n * m)
            .map(|k| (near(k / m, k % m), k / m, k % m))
            .filter(|(distance, _, _)| *distance < 2.0 * radius)
            .collect();
        left.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        left.into_iter().for_each(|(_, i, j)| keep(i, j, 2.0 * radius));
    }
    Ok(constant(&truth, [batch, n, m], posed))
}

fn distance(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, TensorData};

    use super::*;

    #[test]
    fn nodes_are_assigned_from_near_to_far_and_once() {
        let cloud = |x: &[f64]| {
            let values: Vec<f64> = x.iter().flat_map(|&x| [x, 0.0, 0.0]).collect();
            Tensor::<3>::from_data(TensorData::new(values, [1, x.len(), 3]), &Device::flex())
        };
        // 0 with 0; 1.0 and 1.04 compete for 1.01; 1.04 then gets 1.12, within twice the radius; 3 none.
        let truth = assignment(&cloud(&[0.0, 1.0, 1.04, 3.0]), &cloud(&[1.01, 0.01, 1.12]), 0.05).unwrap();
        let found = truth.try_to_vec_as::<f64>().unwrap();
        assert_eq!(found, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }
}
