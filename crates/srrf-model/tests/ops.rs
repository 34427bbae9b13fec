//! Neighbours and samples at the edges: too many asked for, points that coincide, ties.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::collections::HashSet;

use burn::tensor::Device;
use common::{Numbers, tensor, values};
use srrf_model::ops::{
    HostClouds, even_subsample, farthest_points, flat_indices, k_nearest, nearest, rows, share_within,
};

fn cloud(seed: u64, n: usize) -> Vec<[f32; 3]> {
    Numbers(seed).many(n * 3).chunks_exact(3).map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]).collect()
}

#[test]
fn more_neighbours_than_points_repeat_in_turn() {
    let (queries, support) = (cloud(1, 7), cloud(2, 5));
    let found = k_nearest(&queries, &support, 13);
    assert_eq!(found.len(), 7 * 13);
    let five = k_nearest(&queries, &support, 5);
    for (row, once) in found.chunks_exact(13).zip(five.chunks_exact(5)) {
        assert_eq!(once.iter().collect::<HashSet<_>>().len(), 5);
        assert!(row.iter().zip(once.iter().cycle()).all(|(a, b)| a == b));
    }
    assert_eq!(k_nearest(&queries, &support[..1], 3), [0; 21]);
}

#[test]
fn ties_go_to_the_first() {
    // Points 3 and 4 repeat points 1 and 0, and so do not count.
    let support = [[1.0, 0.0, 0.0], [0.0; 3], [-1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0]];
    assert_eq!(k_nearest(&[[0.0; 3]], &support, 5), [1, 0, 2, 1, 0]);
    assert_eq!(nearest(&[[0.0; 3], [2.0, 0.0, 0.0]], &support), [1, 0]);
    assert_eq!(k_nearest(&[[0.0; 3]], &[[5.0; 3]; 7], 3), [0, 0, 0]);
}

#[test]
fn farthest_points_spread() {
    // A cluster of 50 and 4 far corners: the corners come first, the farthest from the mean before
    // the others.
    let mut points: Vec<[f32; 3]> = cloud(3, 50).iter().map(|p| p.map(|v| v * 0.01)).collect();
    points.extend([[8.0, 0.0, 0.0], [-6.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, -5.0]]);
    let chosen = farthest_points(&points, 5);
    assert_eq!(chosen[0], 50);
    assert_eq!(chosen[1], 51, "14 from the first");
    assert_eq!(chosen[..4].iter().collect::<HashSet<_>>(), [50, 51, 52, 53].iter().collect());
    assert!(chosen[4] < 50);

    // All points, in another order; more than there are; coinciding ones.
    let all: HashSet<u32> = farthest_points(&points, 54).into_iter().collect();
    assert_eq!(all.len(), 54);
    let more = farthest_points(&points, 61);
    assert_eq!(more[54..], more[..7]);
    assert_eq!(farthest_points(&[[2.0; 3]; 9], 4).len(), 4);
    assert_eq!(farthest_points(&[[2.0; 3]], 3), [0, 0, 0]);
}

#[test]
fn even_subsamples_keep_the_density() {
    // 900 points in one unit cube and 100 in another: tokens in the same proportion.
    let mut points: Vec<[f32; 3]> = cloud(4, 1000);
    points.iter_mut().skip(900).for_each(|p| p[0] += 10.0);
    for phase in [0.0, 0.3, 0.999] {
        let chosen = even_subsample(&points, 100, phase);
        assert_eq!(chosen.iter().collect::<HashSet<_>>().len(), 100);
        let in_small = chosen.iter().filter(|&&i| i >= 900).count();
        assert!((9..=11).contains(&in_small), "{in_small}");
    }
    assert_ne!(even_subsample(&points, 100, 0.0), even_subsample(&points, 100, 0.9));

    let few = even_subsample(&points[..5], 13, 0.5);
    assert_eq!(few[..5].iter().collect::<HashSet<_>>().len(), 5);
    assert_eq!(few[5..10], few[..5]);
    assert_eq!(even_subsample(&[[3.0; 3]; 7], 4, 0.5).len(), 4);
    // A step of 1 + 1/64 at the last phase does not run past the end.
    assert_eq!(
        even_subsample(&points[..65], 64, 1.0 - f32::EPSILON).iter().collect::<HashSet<_>>().len(),
        64
    );
}

#[test]
fn shares_are_of_points_strictly_within() {
    let support = [[0.0; 3], [10.0, 0.0, 0.0]];
    let points = [[0.0, 1.0, 0.0], [0.0, 0.5, 0.0], [10.0, 0.0, 0.25], [5.0, 0.0, 0.0]];
    assert_eq!(share_within(&points, &support, 1.0), 0.5);
    assert_eq!(share_within(&points, &support, 5.5), 1.0);
    assert_eq!(share_within(&[], &support, 1.0), 0.0);
}

#[test]
fn rows_and_host_copies_number_points_alike() {
    let device = Device::flex();
    let (batch, points) = (3, 7);
    let flat = Numbers(5).many(batch * points * 3);
    let clouds = tensor(&flat, [batch, points, 3], &device);
    let host = HostClouds::read(&clouds).unwrap();
    assert_eq!(host.iter().count(), batch);
    // Point 2 i + 1 of cloud i, then point 0.
    let indices = flat_indices(&host, points, |i, _| vec![2 * i as u32 + 1, 0]);
    assert_eq!(indices, [1, 0, 10, 7, 19, 14]);
    let picked = values(&rows(clouds.reshape([batch * points, 3]), &indices));
    let selected: Vec<f64> =
        host.select(&indices, 2).iter().flatten().flatten().map(|&v| f64::from(v)).collect();
    assert_eq!(picked, selected);
    assert_eq!(picked[6..9], flat[30..33]);
}
