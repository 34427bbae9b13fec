//! Nearest neighbours on the host, by brute force: at a thousand points that is faster than any tree, which must first
//! be built. Indices are not differentiable, so plain `f32` arrays do.

use crate::ops::simd::vectorized;

/// A cloud by coordinates, so that distances to all of it vectorise. Filled up to whole groups of
/// [`LANES`] times [`LANES`] by points at infinity. Point `g L^2 + r L + l` is in lane `l` of group `g`.
pub(super) struct Columns {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

/// Numbers that are handled at a time: a 512-bit vector.
pub(super) const LANES: usize = 16;

impl Columns {
    pub(super) fn new(points: impl ExactSizeIterator<Item = [f32; 3]>) -> Self {
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
    pub(super) fn squared(&self, query: &[f32; 3], out: &mut [f32], least: &mut [f32]) {
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
    pub(super) fn buffers(&self) -> (Vec<f32>, Vec<f32>) {
        (vec![0.0; self.x.len()], vec![0.0; self.x.len() / LANES])
    }
}

/// Squared Euclidean distance.
pub(super) fn squared(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let (dx, dy, dz) = (a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    dx * dx + dy * dy + dz * dz
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
pub(super) fn distinct(points: &[[f32; 3]]) -> Vec<u32> {
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
        assert_eq!(k_nearest(&support[..1], &[support[0]; 4], 3), [0, 0, 0]);
    }
}
