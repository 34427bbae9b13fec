//! Which points stand for a cloud: the farthest ones, or an even share along a space-filling curve. The choice does not
//! depend on the order of the points.

use burn::tensor::Tensor;

use crate::ops::clouds::{HostClouds, flat_indices};
use crate::ops::copy::CopyError;
use crate::ops::gather::rows;
use crate::ops::neighbours::{Columns, LANES, distinct, squared};
use crate::ops::simd::vectorized;

/// Farthest point sampling, started at the point farthest from the mean: `count` indices, in the
/// order of choice. Repeats in turn where the cloud has fewer points.
pub fn farthest_points(points: &[[f32; 3]], count: usize) -> Vec<u32> {
    let n = points.len();
    let mut mean = [0.0_f32; 3];
    for p in points {
        for c in 0..3 {
            mean[c] += p[c] / n as f32;
        }
    }
    let first_of = |distances: &[f32], value: f32| distances.iter().position(|&d| d == value).unwrap_or(0);
    let to_mean: Vec<f32> = points.iter().map(|p| squared(p, &mean)).collect();
    let top = to_mean.iter().fold(0.0_f32, |a, &d| a.max(d));
    let mut chosen = vec![first_of(&to_mean, top) as u32];
    let columns = Columns::new(points.iter().copied());
    let (mut distances, mut least) = columns.buffers();
    // To the nearest chosen point; the filling lies at distance 0 and is never chosen.
    let mut to_chosen = vec![f32::INFINITY; distances.len()];
    to_chosen[n..].fill(0.0);
    while chosen.len() < count.min(n) {
        let last = points[chosen[chosen.len() - 1] as usize];
        let top = vectorized(
            #[inline(always)]
            || {
                columns.squared(&last, &mut distances, &mut least);
                let mut top = [0.0_f32; LANES];
                for (c, d) in to_chosen.chunks_exact_mut(LANES).zip(distances.chunks_exact(LANES)) {
                    for ((c, &d), top) in c.iter_mut().zip(d).zip(&mut top) {
                        *c = if d < *c { d } else { *c };
                        *top = if *c > *top { *c } else { *top };
                    }
                }
                top.iter().fold(0.0_f32, |a, &d| a.max(d))
            },
        );
        chosen.push(first_of(&to_chosen[..n], top) as u32);
    }
    (0..count).map(|i| chosen[i % chosen.len()]).collect()
}

/// `count` points evenly spaced along a Morton curve through the cloud, `phase` in [0, 1) steps
/// from its start: a subsample as dense as the cloud itself, that no single outlier dominates (as
/// it would farthest point sampling). Points at the same place count once. Repeats in turn where the
/// cloud has fewer points.
pub fn even_subsample(points: &[[f32; 3]], count: usize, phase: f32) -> Vec<u32> {
    let kept = distinct(points);
    let n = kept.len();
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in points {
        for c in 0..3 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    let side = (0..3).map(|c| high[c] - low[c]).fold(f32::MIN_POSITIVE, f32::max);
    let cell = |v: f32, c: usize| (((v - low[c]) / side) * 1023.0) as u32;
    let mut order: Vec<(u32, u32)> = kept
        .iter()
        .map(|&i| {
            let p = points[i as usize];
            (morton(cell(p[0], 0), cell(p[1], 1), cell(p[2], 2)), i)
        })
        .collect();
    // Ties in a cell are broken by the coordinates, so that the order of the points plays no part.
    order.sort_unstable_by(|a, b| {
        a.0.cmp(&b.0).then_with(|| {
            let (p, q) = (&points[a.1 as usize], &points[b.1 as usize]);
            p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2]))
        })
    });
    let taken = count.min(n);
    let step = n as f32 / taken as f32;
    let chosen: Vec<u32> =
        (0..taken).map(|i| order[(((i as f32 + phase) * step) as usize).min(n - 1)].1).collect();
    (0..count).map(|i| chosen[i % taken]).collect()
}

/// Row numbers of the points that carry tokens: [`even_subsample`] of each cloud. `None` where all do,
/// that is, where `tokens` is 0 or not below their number.
pub fn token_rows(clouds: &HostClouds, tokens: usize, phase: f32) -> Option<Vec<i64>> {
    let points = clouds.per_cloud();
    let some = tokens > 0 && tokens < points;
    some.then(|| flat_indices(clouds, points, |_, cloud| even_subsample(cloud, tokens, phase)))
}

/// The points at [`token_rows`]: `[batch, tokens, 3]` of `[batch, points, 3]`.
///
/// # Errors
/// [`CopyError`] where the coordinates cannot be copied.
pub fn even_tokens(clouds: Tensor<3>, tokens: usize, phase: f32) -> Result<Tensor<3>, CopyError> {
    let [batch, points, _] = clouds.dims();
    Ok(match token_rows(&HostClouds::read(&clouds)?, tokens, phase) {
        Some(chosen) => rows(clouds.reshape([batch * points, 3]), &chosen).reshape([batch, tokens, 3]),
        None => clouds,
    })
}

/// Interleaves the low 10 bits of three numbers.
fn morton(x: u32, y: u32, z: u32) -> u32 {
    let spread = |v: u32| {
        let mut v = v & 0x3ff;
        v = (v | (v << 16)) & 0x0300_00ff;
        v = (v | (v << 8)) & 0x0300_f00f;
        v = (v | (v << 4)) & 0x030c_30c3;
        (v | (v << 2)) & 0x0924_9249
    };
    spread(x) | (spread(y) << 1) | (spread(z) << 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(n: usize) -> Vec<[f32; 3]> {
        (0..n)
            .map(|i| {
                let s = i as f32;
                [(s * 1.3).sin(), (s * 0.7).cos(), (s * s * 0.11).sin()]
            })
            .collect()
    }

    #[test]
    fn repeated_points_count_once() {
        let support = cloud(23);
        let mut filled = support.clone();
        filled.extend_from_slice(&support[..17]);
        assert_eq!(even_subsample(&filled, 9, 0.5), even_subsample(&support, 9, 0.5));
    }

    #[test]
    fn samples_do_not_depend_on_the_order() {
        let points = cloud(101);
        let mut turned = points.clone();
        turned.reverse();
        let coordinates = |points: &[[f32; 3]], chosen: Vec<u32>| -> Vec<[f32; 3]> {
            chosen.into_iter().map(|i| points[i as usize]).collect()
        };
        let a = coordinates(&points, even_subsample(&points, 17, 0.5));
        assert_eq!(a, coordinates(&turned, even_subsample(&turned, 17, 0.5)));
        let a = coordinates(&points, farthest_points(&points, 17));
        assert_eq!(a, coordinates(&turned, farthest_points(&turned, 17)));
        let distinct: std::collections::HashSet<u32> = even_subsample(&points, 17, 0.0).into_iter().collect();
        assert_eq!(distinct.len(), 17);
        assert_eq!(even_subsample(&points[..3], 7, 0.5).len(), 7);
    }
}
