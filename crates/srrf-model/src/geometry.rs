//! Neighbours and samples on the host, for batches of clouds that live in tensors.
//!
//! Indices are not differentiable, so they are found in plain `f32` arrays: nearest neighbours by
//! brute force (at a thousand points faster than any tree that must first be built), farthest
//! point sampling, and an even subsample along a space-filling curve. All are deterministic, and
//! the choice of points does not depend on their order in the cloud.

#[cfg(any(feature = "wgpu", feature = "cuda"))]
use burn::backend::DispatchDevice;
use burn::tensor::{Device, Int, Tensor, TensorData};
use rayon::prelude::*;

use crate::fast::vectorized;

/// A batch of clouds copied to the host: shape `[batch, points, 3]`.
#[derive(Debug, Clone)]
pub struct HostClouds {
    points: Vec<[f32; 3]>,
    per_cloud: usize,
}

impl HostClouds {
    /// Clouds of `per_cloud` points, one after the other.
    pub fn new(points: Vec<[f32; 3]>, per_cloud: usize) -> Self {
        Self { points, per_cloud }
    }

    /// Points a cloud.
    pub fn per_cloud(&self) -> usize {
        self.per_cloud
    }

    /// The coordinates, point after point.
    pub fn flat(&self) -> &[f32] {
        self.points.as_flattened()
    }

    /// Copies `clouds`, shape `[batch, points, 3]`.
    pub fn read(clouds: &Tensor<3>) -> Self {
        let [_, per_cloud, _] = clouds.dims();
        let flat: Vec<f32> = clouds.try_to_vec_as::<f32>().unwrap_or_default();
        let points = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        Self { points, per_cloud }
    }

    /// The clouds one by one.
    pub fn iter(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        self.points.chunks_exact(self.per_cloud.max(1))
    }

    /// The clouds at the rows `indices` (as [`flat_indices`] numbers them), `per_cloud` rows each.
    pub fn select(&self, indices: &[i64], per_cloud: usize) -> Self {
        Self { points: indices.iter().map(|&i| self.points[i as usize]).collect(), per_cloud }
    }
}

/// A cloud by coordinates, so that distances to all of it vectorise. Filled up to whole groups of
/// [`LANES`] times [`LANES`] by points at infinity. Point `g L^2 + r L + l` is in lane `l` of group `g`.
struct Columns {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

/// Numbers that are handled at a time: a 512-bit vector.
const LANES: usize = 16;

impl Columns {
    fn new(points: impl ExactSizeIterator<Item = [f32; 3]>) -> Self {
        let padded = points.len().next_multiple_of(LANES * LANES);
        let mut columns = Self {
            x: Vec::with_capacity(padded),
            y: Vec::with_capacity(padded),
            z: Vec::with_capacity(padded),
        };
        for [x, y, z] in points {
            columns.x.push(x);
            columns.y.push(y);
            columns.z.push(z);
        }
        for column in [&mut columns.x, &mut columns.y, &mut columns.z] {
            column.resize(padded, f32::INFINITY);
        }
        columns
    }

    /// Squared distance of every point to `query`, into `out`, and the smallest of each lane of each
    /// group into `least`.
    #[inline(always)]
    fn squared(&self, query: &[f32; 3], out: &mut [f32], least: &mut [f32]) {
        const GROUP: usize = LANES * LANES;
        let groups = out.chunks_exact_mut(GROUP).zip(least.chunks_exact_mut(LANES));
        let columns =
            self.x.chunks_exact(GROUP).zip(self.y.chunks_exact(GROUP)).zip(self.z.chunks_exact(GROUP));
        for ((out, least), ((x, y), z)) in groups.zip(columns) {
            let mut smallest = [f32::INFINITY; LANES];
            let rows = x.chunks_exact(LANES).zip(y.chunks_exact(LANES)).zip(z.chunks_exact(LANES));
            for (out, ((x, y), z)) in out.chunks_exact_mut(LANES).zip(rows) {
                for ((((o, s), x), y), z) in out.iter_mut().zip(&mut smallest).zip(x).zip(y).zip(z) {
                    let (dx, dy, dz) = (query[0] - x, query[1] - y, query[2] - z);
                    let d = dx * dx + dy * dy + dz * dz;
                    *o = d;
                    *s = if d < *s { d } else { *s };
                }
            }
            least.copy_from_slice(&smallest);
        }
    }

    /// The points of entry `i` of `least`.
    fn lane(i: usize) -> impl Iterator<Item = usize> {
        let (group, lane) = (i / LANES, i % LANES);
        (0..LANES).map(move |r| group * LANES * LANES + r * LANES + lane)
    }

    /// Room for [`Self::squared`].
    fn buffers(&self) -> (Vec<f32>, Vec<f32>) {
        (vec![0.0; self.x.len()], vec![0.0; self.x.len() / LANES])
    }
}

/// Squared Euclidean distance.
fn squared(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let (dx, dy, dz) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    dx * dx + dy * dy + dz * dz
}

/// Row numbers into the flattened `[batch * points, channels]` table: `per_cloud(i)` gives the
/// indices inside cloud `i`, which are shifted by `i * support_points`. Clouds are worked on side by side.
pub fn flat_indices(
    clouds: &HostClouds,
    support_points: usize,
    per_cloud: impl Fn(usize, &[[f32; 3]]) -> Vec<u32> + Sync,
) -> Vec<i64> {
    let clouds: Vec<_> = clouds.iter().collect();
    let found: Vec<Vec<u32>> = clouds.par_iter().enumerate().map(|(i, cloud)| per_cloud(i, cloud)).collect();
    let shifted = |(i, rows): (usize, Vec<u32>)| {
        rows.into_iter().map(move |j| (i * support_points) as i64 + i64::from(j))
    };
    found.into_iter().enumerate().flat_map(shifted).collect()
}

/// The `k` nearest distinct points of `support` for each of `queries`, nearest first, ties by
/// index: `queries * k` indices. Of points at the same place only the first counts, since clouds
/// filled up by repeats (as the corruptions that remove points leave them) would otherwise have
/// neighbourhoods of half the size. Where there are fewer than `k` they are repeated in turn.
pub fn k_nearest(queries: &[[f32; 3]], support: &[[f32; 3]], k: usize) -> Vec<u32> {
    let kept = distinct(support);
    let columns = Columns::new(kept.iter().map(|&i| support[i as usize]));
    let found = k.min(kept.len());
    let mut out = Vec::with_capacity(queries.len() * k);
    let (mut distances, mut least) = columns.buffers();
    let mut ranked = least.clone();
    // Distance above, number below: in order as whole numbers, since no distance is negative.
    let mut near: Vec<u64> = Vec::new();
    for query in queries {
        vectorized(
            #[inline(always)]
            || columns.squared(query, &mut distances, &mut least),
        );
        // Each entry of `least` is the distance of another point, so the k-th smallest bounds the k-th
        // neighbour.
        let bound = if found <= least.len() {
            ranked.copy_from_slice(&least);
            *ranked.select_nth_unstable_by(found - 1, f32::total_cmp).1
        } else {
            f32::INFINITY
        };
        near.clear();
        for (i, _) in least.iter().enumerate().filter(|(_, least)| **least <= bound) {
            for j in Columns::lane(i).filter(|&j| distances[j] <= bound && j < kept.len()) {
                near.push(u64::from(distances[j].to_bits()) << 32 | j as u64);
            }
        }
        near.sort_unstable();
        out.extend((0..k).map(|j| kept[(near[j % found] & u64::from(u32::MAX)) as usize]));
    }
    out
}

/// Indices of the points that are the first at their place, in order.
fn distinct(points: &[[f32; 3]]) -> Vec<u32> {
    let bits = |i: u32| points[i as usize].map(f32::to_bits);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (bits(i), i));
    order.dedup_by_key(|i| bits(*i));
    order.sort_unstable();
    order
}

/// The nearest point of `support` for each of `queries`: `queries` indices, ties to the first.
pub fn nearest(queries: &[[f32; 3]], support: &[[f32; 3]]) -> Vec<u32> {
    let columns = Columns::new(support.iter().copied());
    let (mut distances, mut least) = columns.buffers();
    let mut find = |query: &[f32; 3]| {
        vectorized(
            #[inline(always)]
            || columns.squared(query, &mut distances, &mut least),
        );
        let smallest = least.iter().fold(f32::INFINITY, |a, &d| a.min(d));
        distances.iter().position(|&d| d == smallest).unwrap_or(0).min(support.len() - 1) as u32
    };
    queries.iter().map(&mut find).collect()
}

/// Share of `points` whose nearest neighbour in `support` is closer than `radius`.
pub fn share_within(points: &[[f32; 3]], support: &[[f32; 3]], radius: f32) -> f64 {
    let columns = Columns::new(support.iter().copied());
    let (mut distances, mut least) = columns.buffers();
    let mut is_near = |point: &&[f32; 3]| {
        vectorized(
            #[inline(always)]
            || columns.squared(point, &mut distances, &mut least),
        );
        least.iter().any(|&d| d < radius * radius)
    };
    let hits = points.iter().filter(|p| is_near(p)).count();
    hits as f64 / points.len().max(1) as f64
}

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
pub fn even_tokens(clouds: Tensor<3>, tokens: usize, phase: f32) -> Tensor<3> {
    let [batch, points, _] = clouds.dims();
    match token_rows(&HostClouds::read(&clouds), tokens, phase) {
        Some(chosen) => rows(clouds.reshape([batch * points, 3]), &chosen).reshape([batch, tokens, 3]),
        None => clouds,
    }
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

/// The rows `indices` of `table`, shape `[rows, channels]` to `[indices.len(), channels]`.
pub fn rows(table: Tensor<2>, indices: &[i64]) -> Tensor<2> {
    let indices = on_device(indices, &table.device());
    rows_at(table, indices)
}

/// Row numbers on a device.
fn on_device(indices: &[i64], device: &Device) -> Tensor<1, Int> {
    let device = device.clone().without_autodiff();
    Tensor::from_data(TensorData::new(indices.to_vec(), [indices.len()]), &device)
}

/// Row numbers for [`rows_at`], found on the host. They may be sent to the device that needs them ahead of their use, for
/// such a copy waits until a GPU has done all that it was given before.
#[derive(Debug, Clone)]
pub struct RowNumbers {
    host: Vec<i64>,
    sent: Option<Tensor<1, Int>>,
}

impl RowNumbers {
    /// Row numbers on the host.
    pub fn new(host: Vec<i64>) -> Self {
        Self { host, sent: None }
    }

    /// Sends them to `device`.
    pub fn send(&mut self, device: &Device) {
        self.sent = Some(on_device(&self.host, device));
    }

    /// The numbers on `device`, which is the one they were sent to, if they were.
    pub fn on(&self, device: &Device) -> Tensor<1, Int> {
        self.sent.clone().unwrap_or_else(|| on_device(&self.host, device))
    }
}

/// The rows `indices` of `table`, shape `[rows, channels]` to `[indices, channels]`.
pub fn rows_at(table: Tensor<2>, indices: Tensor<1, Int>) -> Tensor<2> {
    if on_cubecl(&indices.device()) {
        // Its backward pass of `select` adds the rows one after the other; that of `gather` side by side.
        let ([_, channels], [count]) = (table.dims(), indices.dims());
        return table.gather(0, indices.unsqueeze_dim::<2>(1).expand([count, channels]));
    }
    table.select(0, indices)
}

/// Whether the device runs CubeCL's kernels.
pub(crate) fn on_cubecl(device: &Device) -> bool {
    match device.as_dispatch() {
        #[cfg(any(feature = "wgpu", feature = "cuda"))]
        DispatchDevice::Cube(_) => true,
        _ => false,
    }
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
    fn neighbours_agree_with_a_full_sort() {
        let (queries, support) = (cloud(13), cloud(57));
        let found = k_nearest(&queries, &support, 5);
        for (q, row) in queries.iter().zip(found.chunks(5)) {
            let mut order: Vec<u32> = (0..57).collect();
            order.sort_by(|a, b| {
                squared(q, &support[*a as usize]).total_cmp(&squared(q, &support[*b as usize]))
            });
            assert_eq!(row, &order[..5]);
        }
        let first: Vec<u32> = found.chunks(5).map(|row| row[0]).collect();
        assert_eq!(first, nearest(&queries, &support));
        assert_eq!(k_nearest(&queries[..1], &support[..2], 5).len(), 5);
    }

    #[test]
    fn repeated_points_count_once() {
        let support = cloud(23);
        let mut filled = support.clone();
        filled.extend_from_slice(&support[..17]);
        assert_eq!(k_nearest(&cloud(5), &filled, 6), k_nearest(&cloud(5), &support, 6));
        assert_eq!(even_subsample(&filled, 9, 0.5), even_subsample(&support, 9, 0.5));
        assert_eq!(k_nearest(&support[..1], &[support[0]; 4], 3), [0, 0, 0]);
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
