//! Objects of no name: parts of all kinds joined at random, for variety beyond any list.

use super::sketch::{Sketch, station};

/// A part of random kind and size about the origin of the current frame.
fn part(s: &mut Sketch, size: f64) {
    let [a, b, c] = [s.between(0.3, 1.0) * size, s.between(0.3, 1.0) * size, s.between(0.3, 1.0) * size];
    match s.count(0, 6) {
        0 => s.cuboid([0.0; 3], [2.0 * a, 2.0 * b, 2.0 * c]),
        1 => {
            let (x, y, shift) = (s.between(0.1, 1.2), s.between(0.1, 1.2), s.between(-0.5, 0.5) * a);
            s.wedge([0.0, 0.0, -c], [2.0 * a, 2.0 * b, 2.0 * c], [x, y], [shift, 0.0]);
        }
        2 => s.ball([0.0; 3], [a, b, c]),
        3 => {
            let tip = b * s.between(0.1, 1.0);
            s.cone([0.0, 0.0, -a], [0.0, 0.0, a], b, tip);
        }
        4 => {
            let thin = s.between(0.15, 0.4) * b;
            s.ring([0.0; 3], [0.0, 0.0, 1.0], b, thin);
        }
        5 => {
            // An extruded L, T or arrow.
            let [p, q] = [s.between(0.2, 0.7), s.between(0.2, 0.7)];
            let outline = [
                [-a, -b],
                [a, -b],
                [a, -b + 2.0 * q * b],
                [-a + 2.0 * p * a, -b + 2.0 * q * b],
                [-a + 2.0 * p * a, b],
                [-a, b],
            ];
            s.slab(&outline, -0.5 * c, c);
        }
        _ => {
            let power = s.between(1.5, 5.0);
            let bow = s.between(-0.4, 0.4) * c;
            let end = s.between(0.2, 0.9);
            s.loft(&[
                station(-a, [0.0, 0.0], [end * b, end * c], power),
                station(0.0, [0.0, bow], [b, c], power),
                station(a, [0.0, 0.0], [end * b, 0.5 * c], power),
            ]);
        }
    }
}

/// A body with smaller parts set onto it, right-angled for the most part, as made things are.
pub(super) fn assembly(s: &mut Sketch) {
    part(s, 1.0);
    for _ in 0..s.count(3, 8) {
        let origin = [s.between(-0.9, 0.9), s.between(-0.9, 0.9), s.between(-0.9, 0.9)];
        let size = s.between(0.15, 0.6);
        let free = s.chance(0.3);
        let turn = if free {
            [s.between(0.0, 360.0), s.between(-90.0, 90.0), s.between(0.0, 360.0)]
        } else {
            [90.0 * s.count(0, 3) as f64, 0.0, 90.0 * s.count(0, 3) as f64]
        };
        s.tube(&[[0.0; 3], origin], 0.06);
        s.at(origin, turn, |s| part(s, size));
    }
}

/// Branching limbs, thick and thin, as grown things are.
pub(super) fn creature(s: &mut Sketch) {
    let mut knots = vec![([0.0; 3], s.between(0.2, 0.45))];
    for _ in 0..s.count(5, 12) {
        let from = s.count(0, knots.len() - 1);
        let (root, thick) = knots[from];
        let reach = s.between(0.3, 0.9);
        let tip: [f64; 3] = std::array::from_fn(|c| root[c] + reach * s.between(-1.0, 1.0));
        let bend: [f64; 3] = std::array::from_fn(|c| 0.5 * (root[c] + tip[c]) + s.between(-0.15, 0.15));
        let thin = thick * s.between(0.4, 0.95);
        s.tapered_tube(&[root, bend, tip], &[thick, 0.5 * (thick + thin), thin]);
        knots.push((tip, thin));
        if s.chance(0.3) {
            let half = std::array::from_fn(|_| s.between(0.8, 2.0) * thin);
            s.ball(tip, half);
        }
    }
}

/// Flat and straight members bolted together: brackets, racks and frames.
pub(super) fn framework(s: &mut Sketch) {
    let [w, d, h] = [s.between(0.5, 1.2), s.between(0.3, 1.0), s.between(0.4, 1.2)];
    let section = [s.between(0.05, 0.15), s.between(0.05, 0.15)];
    let corner = |i: usize| {
        [
            if i & 1 == 0 { -w } else { w },
            if i & 2 == 0 { -d } else { d },
            if i & 4 == 0 { 0.0 } else { 2.0 * h },
        ]
    };
    for i in 0..8usize {
        for axis in [1, 2, 4] {
            if i & axis == 0 && s.chance(0.75) {
                s.beam(corner(i), corner(i | axis), section);
            }
        }
    }
    for _ in 0..s.count(1, 4) {
        let (a, b) = (s.count(0, 7), s.count(0, 7));
        s.beam(corner(a), corner(b), [section[0], 0.7 * section[1]]);
    }
    for _ in 0..s.count(1, 3) {
        let z = s.between(0.0, 2.0) * h;
        let (x, y) = (s.between(-0.4, 0.4) * w, s.between(-0.4, 0.4) * d);
        s.cuboid([x, y, z], [1.2 * w, 1.2 * d, 0.06]);
    }
    let at = [s.between(-0.8, 0.8) * w, s.between(-0.8, 0.8) * d, s.between(0.2, 1.8) * h];
    let size = s.between(0.2, 0.45);
    s.at(at, [0.0; 3], |s| part(s, size));
}
