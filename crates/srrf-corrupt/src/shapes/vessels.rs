//! Things that hold water. Profiles run from the foot upwards; open ones have a wall of two skins.

use std::f64::consts::PI;

use super::sketch::{Sketch, arc};

/// Closes an outer profile into a wall: back down on the inside, `wall` thinner, to a floor.
fn wall_of(outer: &[[f64; 2]], wall: f64) -> Vec<[f64; 2]> {
    let mut profile = vec![[0.0, outer[0][1]]];
    profile.extend_from_slice(outer);
    let floor = outer[0][1] + wall;
    profile.extend(outer.iter().rev().filter(|p| p[1] > floor && p[0] > wall).map(|p| [p[0] - wall, p[1]]));
    profile.push([0.0, floor]);
    profile
}

/// A random smooth outline of a vessel from the foot at z = 0 to the rim at `height`.
fn outline(s: &mut Sketch, height: f64, belly: f64) -> Vec<[f64; 2]> {
    const STEPS: usize = 12;
    let (foot, rim) = (belly * s.between(0.45, 0.9), belly * s.between(0.35, 1.05));
    let at = s.between(0.25, 0.7);
    let swing = s.between(0.6, 1.4);
    (0..=STEPS)
        .map(|i| {
            let up = i as f64 / STEPS as f64;
            let (low, share) = if up < at { (foot, up / at) } else { (rim, (1.0 - up) / (1.0 - at)) };
            let ease = (0.5 - 0.5 * (PI * share).cos()).powf(swing);
            [low + (belly - low) * ease, height * up]
        })
        .collect()
}

/// The radius of an outline at a height.
fn radius_at(outline: &[[f64; 2]], z: f64) -> f64 {
    outline.windows(2).find(|w| z <= w[1][1]).map_or(outline[outline.len() - 1][0], |w| {
        w[0][0] + (w[1][0] - w[0][0]) * (z - w[0][1]) / (w[1][1] - w[0][1])
    })
}

/// A handle at +x between two heights of an outline.
fn handle(s: &mut Sketch, outline: &[[f64; 2]], low: f64, high: f64, reach: f64) {
    let thickness = s.between(0.04, 0.08);
    let (a, b) = ([radius_at(outline, high), 0.0, high], [radius_at(outline, low), 0.0, low]);
    let x = a[0].max(b[0]) + reach;
    if s.chance(0.6) {
        let middle = 0.5 * (low + high);
        let inner = 0.5 * (a[0] + b[0]) - 0.5 * thickness;
        s.tube(
            &arc(
                [inner, 0.0, middle],
                [x - inner, 0.0, 0.0],
                [0.0, 0.0, 0.5 * (high - low)],
                90.0,
                -90.0,
                10,
            ),
            thickness,
        );
    } else {
        s.tube(
            &[
                [a[0] - thickness, 0.0, high],
                [x, 0.0, high],
                [x, 0.0, low + 0.1],
                [b[0] - thickness, 0.0, low],
            ],
            thickness,
        );
    }
}

pub(super) fn mug(s: &mut Sketch) {
    let (height, belly) = (s.between(0.8, 1.6), s.between(0.4, 0.7));
    let profile = if s.chance(0.5) {
        let foot = belly * s.between(0.7, 1.0);
        vec![[foot, 0.0], [0.5 * (foot + belly), 0.5 * height], [belly, height]]
    } else {
        outline(s, height, belly)
    };
    s.lathe([0.0; 3], &wall_of(&profile, 0.06), [1.0, 1.0]);
    let (low, high, reach) = (s.between(0.1, 0.35), s.between(0.65, 0.92), s.between(0.2, 0.5));
    handle(s, &profile, low * height, high * height, reach);
    if s.chance(0.3) {
        s.lathe(
            [0.0, 0.0, -0.02],
            &[[0.0, -0.05], [1.7 * belly, 0.05], [1.7 * belly, 0.1], [0.0, 0.02]],
            [1.0, 1.0],
        );
    }
    if s.chance(0.25) {
        s.rod([0.1, 0.1, 0.1], [-0.5 * belly, -0.6 * belly, height + 0.4], 0.03); // a spoon
    }
}

pub(super) fn teapot(s: &mut Sketch) {
    let (height, belly) = (s.between(0.7, 1.3), s.between(0.6, 0.9));
    let profile = outline(s, height, belly);
    let rim = radius_at(&profile, height);
    let mut solid = vec![[0.0, 0.0]];
    solid.extend_from_slice(&profile);
    solid.extend([[0.6 * rim, height + 0.1], [0.0, height + 0.15]]);
    s.lathe([0.0; 3], &solid, [1.0, 1.0]);
    let knob = s.between(0.06, 0.13);
    s.ball([0.0, 0.0, height + 0.13 + knob], [knob, knob, 1.2 * knob]);
    if s.chance(0.65) {
        let reach = s.between(0.25, 0.5);
        handle(s, &profile, 0.2 * height, 0.85 * height, reach);
    } else {
        // A handle over the top.
        let (r, up) = (radius_at(&profile, 0.9 * height), s.between(0.5, 0.9));
        s.tube(&arc([0.0, 0.0, 0.85 * height], [r, 0.0, 0.0], [0.0, 0.0, up], 0.0, 180.0, 12), 0.05);
    }
    let low = s.between(0.2, 0.5) * height;
    let (r, out, top) = (radius_at(&profile, low), s.between(0.4, 0.8), s.between(0.8, 1.2) * height);
    let path = [
        [-r + 0.1, 0.0, low],
        [-r - 0.5 * out, 0.0, low + 0.35 * (top - low)],
        [-r - 0.75 * out, 0.0, top - 0.1],
        [-r - out, 0.0, top],
    ];
    s.tapered_tube(&path, &[0.2, 0.13, 0.09, 0.07]);
}

pub(super) fn jug(s: &mut Sketch) {
    let (height, belly) = (s.between(1.2, 2.2), s.between(0.45, 0.8));
    let profile = outline(s, height, belly);
    let squash = [1.0, s.between(0.75, 1.0)];
    s.lathe([0.0; 3], &wall_of(&profile, 0.05), squash);
    let (low, reach) = (s.between(0.2, 0.45) * height, s.between(0.2, 0.45));
    handle(s, &profile, low, 0.9 * height, reach);
    // The lip.
    let (rim, out) = (radius_at(&profile, height), s.between(0.15, 0.35));
    s.at([-0.75 * rim, 0.0, 0.85 * height], [0.0, -20.0, 0.0], |s| {
        s.wedge([0.0; 3], [0.5 * rim, 0.6 * rim, 0.2 * height], [1.0, 0.8], [-out, 0.0]);
    });
}

pub(super) fn watering_can(s: &mut Sketch) {
    let (height, r) = (s.between(0.8, 1.3), s.between(0.45, 0.65));
    let squash = [1.0, s.between(0.6, 1.0)];
    let rim = r * s.between(0.7, 1.0);
    s.lathe(
        [0.0; 3],
        &[
            [0.0, 0.0],
            [r, 0.0],
            [rim, height],
            [0.8 * rim, height],
            [0.75 * rim, 0.9 * height],
            [0.0, 0.9 * height],
        ],
        squash,
    );
    let (out, top) = (s.between(0.9, 1.5), s.between(0.9, 1.5) * height);
    let tip = [-r - out, 0.0, top];
    s.tapered_tube(&[[-0.8 * r, 0.0, 0.2 * height], tip], &[0.1, 0.06]);
    if s.chance(0.7) {
        s.cone(tip, [tip[0] - 0.22, 0.0, top + 0.16], 0.07, 0.2);
    }
    s.tube(
        &[[-0.6 * r, 0.0, 0.75 * height], [-r - 0.6 * out, 0.0, 0.2 * height + 0.55 * (top - 0.2 * height)]],
        0.03,
    );
    let up = s.between(0.3, 0.6);
    s.tube(
        &arc([0.2 * r, 0.0, 0.7 * height], [r, 0.0, 0.0], [0.0, 0.0, 0.3 * height + up], -20.0, 150.0, 12),
        0.05,
    );
}

pub(super) fn bathtub(s: &mut Sketch) {
    let (l, w, h) = (s.between(0.75, 1.0), s.between(0.32, 0.5), s.between(0.4, 0.65));
    let slope = s.between(0.6, 0.95);
    let round = s.chance(0.6);
    if round {
        let outer = [[slope, 0.0], [0.95, 0.7 * h], [1.0, h], [1.06, h + 0.02]];
        s.lathe([0.0; 3], &wall_of(&outer, 0.08), [l, w]);
    } else {
        let wall = 0.06;
        s.cuboid([0.0, 0.0, 0.06], [2.0 * l, 2.0 * w, 0.12]);
        for side in [-1.0, 1.0] {
            s.cuboid([0.0, side * (w - 0.5 * wall), 0.5 * h], [2.0 * l, wall, h]);
            s.cuboid([side * (l - 0.5 * wall), 0.0, 0.5 * h], [wall, 2.0 * w, h]);
        }
    }
    if s.chance(0.5) {
        for x in [-0.55, 0.55] {
            for y in [-0.5, 0.5] {
                s.ball([x * l, y * w, -0.06], [0.07, 0.07, 0.12]);
            }
        }
    }
    // The taps at one end.
    let (tall, side) = (s.between(0.1, 0.35), s.between(-0.4, 0.4) * w);
    let x = 0.97 * l;
    s.tube(
        &[
            [x, side, 0.8 * h],
            [x, side, h + tall],
            [x - 0.2, side, h + tall],
            [x - 0.22, side, h + tall - 0.08],
        ],
        0.03,
    );
    for y in [-0.12, 0.12] {
        s.rod([x, side + y, 0.9 * h], [x, side + y, h + 0.08], 0.03);
    }
    if s.chance(0.3) {
        let y = s.side();
        s.cuboid([-0.3 * l, y * (w + 0.12), 0.3 * h], [0.5 * l, 0.25, 0.6 * h]); // a step
    }
}

pub(super) fn sink(s: &mut Sketch) {
    let (w, d, h) = (s.between(0.7, 1.4), s.between(0.5, 0.7), s.between(0.15, 0.35));
    let (bw, wall) = (s.between(0.5, 0.85) * w, 0.04);
    let x0 = s.between(-0.5, 0.5) * (w - bw);
    // The counter around the basin, then the basin's walls and floor.
    let (left, right) = (x0 - 0.5 * bw + 0.5 * w, 0.5 * w - x0 - 0.5 * bw);
    s.cuboid([-0.5 * w + 0.5 * left, 0.0, h], [left + 0.01, d, 0.05]);
    s.cuboid([0.5 * w - 0.5 * right, 0.0, h], [right + 0.01, d, 0.05]);
    for y in [-0.45, 0.45] {
        s.cuboid([x0, y * d, 0.5 * h], [bw, wall, h + 0.05]);
    }
    for x in [-0.5, 0.5] {
        s.cuboid([x0 + x * bw, 0.0, 0.5 * h], [wall, 0.9 * d, h]);
    }
    s.cuboid([x0, 0.0, 0.02], [bw, 0.9 * d, wall]);
    if s.chance(0.4) {
        let x = x0 + s.between(-0.2, 0.2) * bw;
        s.cuboid([x, 0.0, 0.4 * h], [wall, 0.9 * d, 0.8 * h]);
    }
    let (up, reach, x) = (s.between(0.2, 0.5), s.between(0.2, 0.35), x0 + s.between(-0.2, 0.2) * bw);
    let mut path = vec![[x, 0.45 * d, h]];
    path.extend(arc(
        [x, 0.45 * d - 0.5 * reach, h + up],
        [0.0, 0.5 * reach, 0.0],
        [0.0, 0.0, 0.5 * reach],
        0.0,
        170.0,
        8,
    ));
    s.tube(&path, 0.03);
    let lever = s.side();
    s.tube(&[[x, 0.45 * d, h + 0.08], [x + lever * 0.2, 0.45 * d, h + 0.14]], 0.025);
    if s.chance(0.4) {
        s.cone([x0, 0.1 * d, -0.9], [x0, 0.1 * d, 0.02], 0.15, 0.11); // a pedestal
    }
}

pub(super) fn bottle(s: &mut Sketch) {
    let (height, r) = (s.between(1.6, 2.6), s.between(0.3, 0.55));
    let (neck, shoulder) = (r * s.between(0.25, 0.5), s.between(0.5, 0.75));
    let rise = s.between(0.05, 0.2);
    let z = |up: f64| up * height;
    let profile = [
        [0.0, 0.0],
        [0.95 * r, 0.0],
        [r, z(0.03)],
        [r, z(shoulder)],
        [0.5 * (r + neck) + 0.1 * r, z(shoulder + 0.5 * rise)],
        [neck, z(shoulder + rise)],
        [neck, z(0.95)],
        [1.25 * neck, z(0.96)],
        [1.25 * neck, z(1.0)],
        [0.0, z(1.0)],
    ];
    s.lathe([0.0; 3], &profile, [1.0, 1.0]);
}

pub(super) fn bowl(s: &mut Sketch) {
    const STEPS: usize = 8;
    let (depth, foot, curve) = (s.between(0.3, 0.9), s.between(0.25, 0.5), s.between(1.3, 3.0));
    let outer: Vec<[f64; 2]> = (0..=STEPS)
        .map(|i| {
            let out = i as f64 / STEPS as f64;
            [foot + (1.0 - foot) * out, depth * out.powf(curve)]
        })
        .collect();
    s.lathe([0.0; 3], &wall_of(&outer, 0.05), [1.0, 1.0]);
    let stand = s.between(0.02, 0.12);
    s.cone([0.0, 0.0, -stand], [0.0, 0.0, 0.02], 0.9 * foot, 0.8 * foot);
}

pub(super) fn vase(s: &mut Sketch) {
    let (height, belly) = (s.between(1.2, 2.6), s.between(0.35, 0.8));
    let profile = outline(s, height, belly);
    s.lathe([0.0; 3], &wall_of(&profile, 0.04), [1.0, 1.0]);
    if s.chance(0.4) {
        let rim = radius_at(&profile, height);
        s.ring([0.0, 0.0, height], [0.0, 0.0, 1.0], rim, 0.05);
    }
}
