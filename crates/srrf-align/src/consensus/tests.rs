//! Tests of [`super::agree`].

use super::*;
use crate::loops::tests::{exact, ring};
use crate::loops::triangles;
use crate::se3::{displacement, exp};

/// Registrations of which nothing else is known.
fn plain(prior: &[f64]) -> EdgeEvidence<'_> {
    const MOST: usize = 128;
    let (still, no) = (&[0.0; MOST][..prior.len()], &[false; MOST][..prior.len()]);
    EdgeEvidence {
        prior,
        by_itself: prior,
        sight: still,
        abstains: no,
        tied: no,
        vouched: no,
        twins: no,
        doubled: no,
        loops: &[],
        implied: &|_| false,
    }
}

fn agreed(nodes: usize, edges: &[GraphEdge], prior: &[f64], abstains: &[bool]) -> Consensus {
    let loops = triangles(nodes, edges, prior);
    agree(nodes, edges, EdgeEvidence { abstains, loops: &loops, ..plain(prior) })
}

fn off(poses: &[Rigid], truth: &[Rigid]) -> f64 {
    let aligned = |i: usize| truth[0].inverse().compose(&truth[i]).inverse().compose(&poses[i]);
    (0..poses.len()).map(|i| displacement(&aligned(i), 1.0)).fold(0.0, f64::max)
}

/// A ring of 36 with each next and next but one, and wrong edges, 30 in a hundred, that look as good as the right ones.
#[test]
fn wrong_edges_are_found_and_named() {
    let truth = ring(36);
    let mut edges: Vec<GraphEdge> =
        (0..36).flat_map(|i| [exact(&truth, i, (i + 1) % 36), exact(&truth, (i + 2) % 36, i)]).collect();
    let right = edges.len();
    for k in 0..31 {
        let s = k as f64;
        let mut wrong = exact(&truth, (7 * k) % 36, (7 * k + 11 + k % 5) % 36);
        wrong.target_from_source =
            exp(&nalgebra::Vector6::new(s.sin(), (1.3 * s).cos(), (2.1 * s).sin(), s.cos(), 2.0, -s.sin()))
                .compose(&wrong.target_from_source);
        edges.push(wrong);
    }
    let prior = vec![0.95; edges.len()];
    let found = agreed(36, &edges, &prior, &vec![false; edges.len()]);
    assert_eq!(found.components.len(), 1);
    for (number, verdict) in found.verdicts.iter().enumerate() {
        let expected = if number < right { EdgeVerdict::Holds } else { EdgeVerdict::Contradicts };
        assert_eq!(*verdict, expected, "edge {number}");
    }
    assert!(off(&found.poses, &truth) < 1e-6, "{}", off(&found.poses, &truth));
    assert!(found.rivals.is_empty(), "wrong edges agree with none: {:?}", found.rivals);
}

/// Node 4 is held by two nodes here, and by two others elsewhere.
#[test]
fn what_contradicts_and_agrees_with_itself_is_never_silent() {
    let truth = ring(5);
    let mut edges: Vec<GraphEdge> =
        [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3), (4, 2), (4, 3), (4, 0), (4, 1)]
            .map(|(a, b)| exact(&truth, a, b))
            .to_vec();
    let mut other = truth.clone();
    other[4] = exp(&nalgebra::Vector6::new(0.0, 0.0, 0.3, 5.0, 1.0, 0.0)).compose(&other[4]);
    edges[8] = exact(&other, 4, 0);
    edges[9] = exact(&other, 4, 1);
    for sure in [[0.95, 0.95], [0.98, 0.9]] {
        let mut prior = vec![0.95; 10];
        prior[6..8].fill(sure[0]);
        prior[8..].fill(sure[1]);
        let found = agreed(5, &edges, &prior, &[false; 10]);
        assert!(found.components[0].len() == 4 || !found.rivals.is_empty(), "{found:?}");
    }
}

#[test]
fn an_edge_that_abstains_joins_nothing_alone_and_with_a_loop_it_does() {
    let truth = ring(6);
    let mut edges: Vec<GraphEdge> =
        [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5)].map(|(a, b)| exact(&truth, a, b)).to_vec();
    let sure = [0.95; 6];
    edges.push(exact(&truth, 2, 3));
    let abstains = |n: usize| [vec![false; 6], vec![true; n]].concat();
    let found = agreed(6, &edges, &[&sure[..], &[0.4]].concat(), &abstains(1));
    assert_eq!(found.components, [vec![0, 1, 2], vec![3, 4, 5]]);
    assert_eq!(found.verdicts[6], EdgeVerdict::Unconfirmed);
    // A second one that agrees: each closes a loop for the other.
    edges.push(exact(&truth, 1, 3));
    let found = agreed(6, &edges, &[&sure[..], &[0.4, 0.4]].concat(), &abstains(2));
    assert_eq!(found.components.len(), 1);
    assert!(found.verdicts.iter().all(|v| *v == EdgeVerdict::Holds) && off(&found.poses, &truth) < 1e-6);
    // One that disagrees: neither.
    edges[7].target_from_source.translation.x += 3.0;
    let found = agreed(6, &edges, &[&sure[..], &[0.4, 0.4]].concat(), &abstains(2));
    assert_eq!(found.components.len(), 2);
}

#[test]
fn three_edges_of_which_one_is_wrong_join_nobody() {
    let truth = ring(3);
    let mut edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| exact(&truth, a, b));
    edges[1].target_from_source.translation.z += 5.0;
    let found = agreed(3, &edges, &[0.9; 3], &[false; 3]);
    assert_eq!(found.components.len(), 3, "{found:?}");
    // The same with one edge that is much less sure.
    let found = agreed(3, &edges, &[0.98, 0.55, 0.98], &[false; 3]);
    assert_eq!(found.components.len(), 1, "{found:?}");
    assert_eq!(found.verdicts[1], EdgeVerdict::Contradicts);
}

#[test]
fn a_map_is_one_as_long_as_it_is_likelier_right_than_wrong() {
    let truth = ring(9);
    let edges: Vec<GraphEdge> = (1..9).map(|i| exact(&truth, i, i - 1)).collect();
    let prior = [0.9, 0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97];
    let found = agreed(9, &edges, &prior, &[false; 8]);
    // 0.03 + 0.04 + ... + 0.09 = 0.42, and 0.1 more is too much.
    assert_eq!(found.components, [(1..9).collect::<Vec<_>>(), vec![0]]);
    assert_eq!(found.verdicts[0], EdgeVerdict::Unconfirmed);
    let (sight, none) = ([0.0; 8], [false; 8]);
    let vouched = [true; 8];
    let known =
        EdgeEvidence { sight: &sight, abstains: &none, vouched: &vouched, loops: &[], ..plain(&prior) };
    assert_eq!(agree(9, &edges, known).components.len(), 1);
    // Of two scans that cannot be told apart, none is joined.
    let doubled: Vec<bool> = (0..64).map(|e| e == 3 || e == 4).collect();
    let found = agree(9, &edges, EdgeEvidence { doubled: &doubled, ..known });
    assert_eq!(found.components, [vec![0, 1, 2, 3], vec![5, 6, 7, 8], vec![4]]);
    assert!(found.look_alike);
}

#[test]
fn what_scanners_saw_breaks_a_map() {
    let truth = ring(6);
    let edges: Vec<GraphEdge> =
        [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (2, 3)].map(|(a, b)| exact(&truth, a, b)).to_vec();
    let prior = [0.95; 7];
    assert_eq!(agreed(6, &edges, &prior, &[false; 7]).components.len(), 1);
    // Scans of the one side see through those of the other, each way over the bridge.
    let blocked: Vec<EdgeLoop> = [vec![6], vec![0, 2, 6], vec![6, 3]]
        .map(|edges| EdgeLoop { edges, error: Rigid::identity(), chi_squared: f64::INFINITY, implied: false })
        .to_vec();
    let mut loops = triangles(6, &edges, &prior);
    loops.extend(blocked);
    let known = EdgeEvidence { loops: &loops, ..plain(&prior) };
    let found = agree(6, &edges, known);
    assert_eq!(found.components, [vec![0, 1, 2], vec![3, 4, 5]], "{found:?}");
}

#[test]
fn edges_that_abstain_join_where_all_was_seen_and_they_say_the_same() {
    let truth = ring(5);
    let mut edges: Vec<GraphEdge> =
        [(0, 1), (1, 2), (0, 2), (3, 1), (3, 2), (3, 4)].map(|(a, b)| exact(&truth, a, b)).to_vec();
    // The last: a place elsewhere that node 3 fits.
    edges[5].target_from_source.translation.x += 7.0;
    let prior = [0.95, 0.95, 0.95, 0.3, 0.3, 0.3];
    let with = |sight: [f64; 6]| {
        let mut loops = triangles(5, &edges, &prior);
        loops.iter_mut().for_each(|l| l.implied = l.edges.contains(&3));
        let known = EdgeEvidence {
            sight: &sight,
            abstains: &[false, false, false, true, true, true],
            loops: &loops,
            implied: &|l| l.edges.contains(&3),
            ..plain(&prior)
        };
        agree(5, &edges, known).components[0].clone()
    };
    assert_eq!(with([0.0, 0.0, 0.0, 5.0, 5.0, -9.0]), [0, 1, 2, 3]);
    assert_eq!(with([0.0; 6]), [0, 1, 2], "no scanner saw it");
    assert_eq!(with([0.0, 0.0, 0.0, 5.0, -9.0, -9.0]), [0, 1, 2], "one pair alone");
    assert_eq!(with([0.0, 0.0, 0.0, 5.0, 5.0, 0.5]), [0, 1, 2], "it fits elsewhere");
}

#[test]
fn nothing_measured_is_no_edge() {
    let truth = ring(2);
    let found = agreed(2, &[exact(&truth, 0, 1)], &[0.0], &[true]);
    assert_eq!((found.components.len(), found.verdicts[0]), (2, EdgeVerdict::Nothing));
}

#[test]
fn other_poses_that_fit_as_well_count_where_no_loop_closes() {
    let poses = ring(3);
    let edges = [exact(&poses, 0, 1), exact(&poses, 1, 2), exact(&poses, 2, 0)];
    let prior = [0.97; 3];
    let joined = |edges: &[GraphEdge], by_itself: f64| {
        let n = edges.len();
        let loops = triangles(3, edges, &prior[..n]);
        let known = EdgeEvidence { by_itself: &[by_itself; 3][..n], loops: &loops, ..plain(&prior[..n]) };
        let found = agree(3, edges, known);
        (found.components.len(), found.posterior[0])
    };
    assert_eq!(joined(&edges[..1], 0.97).0, 2);
    let (alone, says) = joined(&edges[..1], 0.6);
    assert!(alone == 3 && says <= 0.6 + 1e-9, "{alone} {says}");
    let (together, says) = joined(&edges, 0.6);
    assert!(together == 1 && says > 0.97, "{together} {says}");
    // A box lies on itself in four ways: three scans of it close a loop in sixteen ways, one of which is right.
    let all_tied = |vouched: bool| {
        let loops = triangles(3, &edges, &prior);
        let known = EdgeEvidence {
            abstains: &[true; 3],
            vouched: &[vouched; 3],
            tied: &[true; 3],
            loops: &loops,
            ..plain(&prior)
        };
        agree(3, &edges, known).components.len()
    };
    assert_eq!((all_tied(false), all_tied(true)), (3, 1));
}
