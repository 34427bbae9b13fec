//! Loops that close by themselves: scans that show the same part look alike in each pair, whether or not it is the same place.
//!
//! Where places look alike, a loop says something only if its scans share different parts: by the door with the room, and by the
//! other end with the corridor.

use crate::graph::GraphEdge;
use crate::loops::EdgeLoop;
use crate::se3::tidied;
use crate::surface::ScanSurface;

/// Points of a scan that are asked.
const ASKED: usize = 200;
/// So much of the smaller part that a scan shares with another one is shared by all three.
const COMMON: f64 = 0.5;

/// Whether a loop closes by itself. Loops of scans whose scanners' places are not known are not asked: there nothing tells wrong pairs
/// of another kind.
pub fn is_implied(surfaces: &[ScanSurface], edges: &[GraphEdge], around: &EdgeLoop) -> bool {
    let numbers = &around.edges;
    numbers.len() > 2
        && numbers.iter().zip(numbers.iter().cycle().skip(1)).all(|(one, other)| {
            let (first, second) = (&edges[*one], &edges[*other]);
            let touches = |node: usize| second.source == node || second.target == node;
            let here = if touches(first.source) { first.source } else { first.target };
            if !surfaces[here].has_sight() {
                return false;
            }
            let (x, y) = (lies_on(surfaces, first, here), lies_on(surfaces, second, here));
            let count = |of: &[bool]| of.iter().filter(|v| **v).count() as f64;
            let both = x.iter().zip(&y).filter(|(x, y)| **x && **y).count() as f64;
            both >= COMMON * count(&x).min(count(&y))
        })
}

/// For points of one end of an edge, whether they lie on the other.
fn lies_on(surfaces: &[ScanSurface], edge: &GraphEdge, here: usize) -> Vec<bool> {
    let (there, motion) = if edge.source == here {
        (edge.target, edge.target_from_source)
    } else {
        (edge.source, tidied(&edge.target_from_source.inverse()))
    };
    surfaces[there].lies_on(&surfaces[here], &motion, ASKED)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::{PointCloud, Rigid};

    use super::*;
    use crate::loops::go_around;

    /// A floor from `from` to `to`, one wide.
    fn floor(from: f64, to: f64) -> ScanSurface {
        let points = (0..60 * 20)
            .map(|k| [from + (to - from) * f64::from(k % 60) / 60.0, f64::from(k / 60) / 20.0, 0.0]);
        ScanSurface::new(&PointCloud::new(points.collect()).unwrap(), 2000, Some([from, 0.5, 1.0])).unwrap()
    }

    #[test]
    fn three_of_the_same_close_by_themselves_and_a_chain_does_not() {
        let edges = |surfaces: &[ScanSurface]| {
            [(0usize, 1usize), (1, 2), (2, 0)].map(|(source, target)| GraphEdge {
                source,
                target,
                target_from_source: surfaces[target].centred(&surfaces[source], &Rigid::identity()),
                information: nalgebra::Matrix6::identity(),
            })
        };
        let around = |surfaces: &[ScanSurface]| {
            let edges = edges(surfaces);
            is_implied(surfaces, &edges, &go_around(&edges, &[0, 1, 2], 0))
        };
        assert!(around(&[floor(0.0, 3.0), floor(0.1, 3.1), floor(0.0, 3.0)]));
        // The second lies on the first by one end, and on the third by the other.
        assert!(!around(&[floor(0.0, 3.0), floor(2.0, 5.0), floor(2.8, 8.0)]));
    }
}
