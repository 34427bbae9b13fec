//! Things to sit on. The front is towards -y.

use super::sketch::{Sketch, arc};

/// Four legs under a rectangle, splayed outwards, with optional stretchers.
pub(super) fn legs(s: &mut Sketch, half: [f64; 2], height: f64, thickness: f64) {
    let splay = if s.chance(0.5) { s.between(0.0, 0.12) } else { 0.0 };
    let round = s.chance(0.4);
    let taper = s.between(0.5, 1.0);
    for x in [-1.0, 1.0] {
        for y in [-1.0, 1.0] {
            let top = [x * (half[0] - thickness), y * (half[1] - thickness), height];
            let foot = [top[0] + x * splay, top[1] + y * splay, 0.0];
            if round {
                s.cone(foot, top, 0.5 * thickness * taper, 0.5 * thickness);
            } else {
                s.beam(foot, top, [thickness, thickness]);
            }
        }
    }
    if s.chance(0.4) {
        let z = height * s.between(0.2, 0.6);
        let (x, y) = (half[0] - thickness, half[1] - thickness);
        for side in [-1.0, 1.0] {
            s.beam([side * x, -y, z], [side * x, y, z], [0.5 * thickness; 2]);
        }
        if s.chance(0.5) {
            s.beam([-x, 0.0, z], [x, 0.0, z], [0.5 * thickness; 2]);
        }
    }
}

/// A back that rises from `y` at height `z`, leaning by `lean` over its height.
fn back(s: &mut Sketch, width: f64, y: f64, z: f64, height: f64, thickness: f64) {
    let lean = s.between(0.0, 0.3) * height;
    let top = z + height;
    match s.count(0, 3) {
        0 => s.wedge([0.0, y, z - 0.02], [width, thickness, height], [top_share(width), 1.0], [0.0, lean]),
        1 => {
            // Posts and rungs.
            for x in [-1.0, 1.0] {
                s.beam([x * 0.46 * width, y, z - 0.05], [x * 0.46 * width, y + lean, top], [thickness; 2]);
            }
            let rungs = s.count(1, 4);
            for i in 0..rungs {
                let up = (i + 1) as f64 / rungs as f64 * 0.96;
                let at = |x: f64| [x * 0.46 * width, y + lean * up, z + height * up];
                s.beam(at(-1.0), at(1.0), [0.5 * thickness, 0.1 * height]);
            }
        }
        2 => {
            // Spindles under a top rail.
            let spindles = s.count(4, 8);
            for i in 0..spindles {
                let x = width * (i as f64 / (spindles - 1) as f64 - 0.5) * 0.92;
                s.rod([x, y, z - 0.05], [x, y + lean, top - 0.02], 0.2 * thickness);
            }
            s.beam([-0.5 * width, y + lean, top], [0.5 * width, y + lean, top], [thickness, 0.15 * height]);
        }
        _ => {
            // A rounded frame with a panel inside.
            let path = arc(
                [0.0, y + 0.5 * lean, z],
                [0.5 * width, 0.0, 0.0],
                [0.0, 0.5 * lean, height],
                0.0,
                180.0,
                10,
            );
            s.tube(&path, 0.4 * thickness);
            s.wedge(
                [0.0, y, z + 0.1 * height],
                [0.3 * width, 0.5 * thickness, 0.8 * height],
                [1.0, 1.0],
                [0.0, lean],
            );
        }
    }
}

/// How much a plain back narrows to its top: wide backs less.
fn top_share(width: f64) -> f64 {
    0.75 + 0.2 * width.min(1.0)
}

fn armrests(s: &mut Sketch, half: [f64; 2], z: f64, height: f64, thickness: f64) {
    let reach = s.between(0.6, 0.95);
    for x in [-1.0, 1.0] {
        let at = |y: f64, z: f64| [x * half[0], y, z];
        s.beam(at(half[1], z + height), at(-half[1] * reach, z + height), [1.3 * thickness, 0.8 * thickness]);
        s.beam(
            at(-half[1] * reach * 0.8, z - 0.03),
            at(-half[1] * reach * 0.8, z + height),
            [0.8 * thickness; 2],
        );
    }
}

pub(super) fn chair(s: &mut Sketch) {
    let half = [s.between(0.35, 0.5), s.between(0.35, 0.5)];
    let (height, thickness) = (s.between(0.6, 1.1), s.between(0.05, 0.11));
    legs(s, half, height, thickness);
    let seat = s.between(0.05, 0.16);
    s.wedge([0.0, 0.0, height - 0.02], [2.0 * half[0], 2.0 * half[1], seat], [1.0, 1.0], [0.0, 0.0]);
    let back_height = s.between(0.5, 1.3);
    back(s, 2.0 * half[0], half[1] - 0.5 * thickness, height + 0.5 * seat, back_height, thickness);
    if s.chance(0.35) {
        armrests(s, half, height + 0.5 * seat, 0.4, thickness);
    }
}

pub(super) fn office_chair(s: &mut Sketch) {
    let (stars, reach) = (s.count(4, 6), s.between(0.4, 0.6));
    let turn = s.between(0.0, 60.0);
    for i in 0..stars {
        s.at([0.0; 3], [0.0, 0.0, turn + 360.0 * i as f64 / stars as f64], |s| {
            s.beam([0.0, 0.0, 0.16], [reach, 0.0, 0.1], [0.08, 0.06]);
            s.ball([reach, 0.0, 0.06], [0.07, 0.05, 0.06]);
        });
    }
    let height = s.between(0.6, 0.9);
    s.rod([0.0, 0.0, 0.1], [0.0, 0.0, height], 0.05);
    let half = [s.between(0.4, 0.55), s.between(0.38, 0.5)];
    s.wedge([0.0, 0.0, height - 0.05], [2.0 * half[0], 2.0 * half[1], 0.13], [0.95, 0.95], [0.0, 0.0]);
    let (y, lean, back_height) = (half[1] + 0.05, s.between(0.0, 0.3), s.between(0.5, 1.1));
    s.beam([0.0, half[1] - 0.1, height], [0.0, y, height + 0.4], [0.12, 0.05]);
    let width = 2.0 * half[0] * s.between(0.7, 1.0);
    let taper = s.between(0.6, 1.0);
    s.wedge([0.0, y, height + 0.2], [width, 0.1, back_height], [taper, 1.0], [0.0, lean]);
    if s.chance(0.7) {
        armrests(s, [half[0] + 0.03, 0.7 * half[1]], height, arm_height(back_height), 0.08);
    }
    if s.chance(0.3) {
        s.cuboid([0.0, y + lean, height + 0.35 + back_height], [0.4 * width, 0.1, 0.22]);
    }
}

fn arm_height(back_height: f64) -> f64 {
    0.25 + 0.12 * back_height
}

pub(super) fn sofa(s: &mut Sketch) {
    let (width, depth) = (s.between(1.4, 3.0), s.between(0.8, 1.1));
    let (seat, foot) = (s.between(0.25, 0.45), s.between(0.05, 0.2));
    let arm = [s.between(0.12, 0.3), s.between(0.2, 0.4)];
    for x in [-0.45, 0.45] {
        for y in [-0.4, 0.4] {
            s.rod([x * width, y * depth, 0.0], [x * width, y * depth, foot + 0.05], 0.04);
        }
    }
    s.cuboid([0.0, 0.0, foot + 0.5 * seat], [width, depth, seat]);
    let (back_height, lean) = (s.between(0.3, 0.65), s.between(0.0, 0.2));
    s.wedge(
        [0.0, 0.4 * depth, foot + seat - 0.02],
        [width, 0.2 * depth, back_height],
        [1.0, 0.7],
        [0.0, lean],
    );
    let rolled = s.chance(0.4);
    let sides: &[f64] = if s.chance(0.2) { &[-1.0] } else { &[-1.0, 1.0] };
    for &x in sides {
        let at = x * 0.5 * (width + arm[0]);
        s.cuboid([at, 0.0, foot + 0.5 * (seat + arm[1])], [arm[0] + 0.02, depth, seat + arm[1]]);
        if rolled {
            let z = foot + seat + arm[1];
            s.rod([at, -0.5 * depth, z], [at, 0.5 * depth, z], 0.6 * arm[0]);
        }
    }
    let cushions = s.count(0, 3);
    for i in 0..cushions {
        let each = width / cushions as f64;
        let x = -0.5 * width + (i as f64 + 0.5) * each;
        s.wedge(
            [x, -0.1 * depth, foot + seat - 0.01],
            [0.95 * each, 0.75 * depth, 0.12],
            [0.93, 0.93],
            [0.0, 0.0],
        );
    }
    if s.chance(0.35) {
        // A chaise to one side.
        let x = s.side() * 0.33 * width;
        let long = s.between(0.5, 0.9);
        s.cuboid([x, -0.5 * (depth + long) + 0.02, foot + 0.5 * seat], [0.33 * width, long, seat]);
    }
}

pub(super) fn bench(s: &mut Sketch) {
    let (width, depth, height) = (s.between(1.5, 3.0), s.between(0.35, 0.6), s.between(0.4, 0.6));
    let slats = s.count(1, 5);
    for i in 0..slats {
        let each = depth / slats as f64;
        let y = -0.5 * depth + (i as f64 + 0.5) * each;
        s.cuboid([0.0, y, height], [width, each * if slats == 1 { 1.0 } else { 0.8 }, 0.06]);
    }
    let inset = s.between(0.3, 0.48) * width;
    let style = s.count(0, 2);
    for x in [-inset, inset] {
        match style {
            0 => s.cuboid([x, 0.0, 0.5 * height], [0.08, 0.95 * depth, height]),
            1 => {
                s.beam([x, -0.6 * depth, 0.0], [x, 0.4 * depth, height], [0.08, 0.08]);
                s.beam([x, 0.6 * depth, 0.0], [x, -0.4 * depth, height], [0.08, 0.08]);
            }
            _ => {
                s.tube(
                    &[
                        [x, -0.45 * depth, 0.0],
                        [x, -0.45 * depth, height],
                        [x, 0.45 * depth, height],
                        [x, 0.45 * depth, 0.0],
                    ],
                    0.04,
                );
            }
        }
    }
    if s.chance(0.6) {
        let (back_height, thickness) = (s.between(0.35, 0.6), s.between(0.04, 0.07));
        back(s, width, 0.5 * depth, height, back_height, thickness);
    }
    if s.chance(0.4) {
        armrests(s, [0.48 * width, 0.5 * depth], height, 0.22, 0.06);
    }
    if s.chance(0.3) {
        let x = s.between(-0.3, 0.3) * width;
        s.wedge([x, 0.0, height], [0.3, 0.2, 0.2], [0.8, 0.6], [0.0, 0.05]); // a bag
    }
}

pub(super) fn stool(s: &mut Sketch) {
    let (legs, height, radius) = (s.count(3, 5), s.between(0.6, 1.5), s.between(0.25, 0.45));
    let (splay, thickness) = (s.between(0.0, 0.25), s.between(0.025, 0.06));
    let ring = s.between(0.2, 0.6);
    let has_ring = s.chance(0.5);
    let spoke = |i: usize, r: f64, z: f64| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / legs as f64).sin_cos();
        [r * cos, r * sin, z]
    };
    for i in 0..legs {
        s.rod(spoke(i, 0.8 * radius + splay, 0.0), spoke(i, 0.8 * radius, height), thickness);
    }
    if has_ring {
        s.ring(
            [0.0, 0.0, ring * height],
            [0.0, 0.0, 1.0],
            0.8 * radius + splay * (1.0 - ring),
            0.6 * thickness,
        );
    }
    let seat = s.between(0.05, 0.15);
    if s.chance(0.5) {
        s.cone([0.0, 0.0, height - 0.02], [0.0, 0.0, height + seat], 1.05 * radius, radius);
    } else {
        s.cuboid([0.0, 0.0, height + 0.4 * seat], [2.0 * radius, 1.6 * radius, seat]);
    }
    // A low back, or a footrest to one side: no stool is symmetric.
    if s.chance(0.6) {
        let path = arc(
            [0.0, 0.0, height + low_back_height(height)],
            [radius, 0.0, 0.0],
            [0.0, radius, 0.0],
            30.0,
            150.0,
            8,
        );
        s.tube(&path, 0.05);
        for end in [path[1], path[7]] {
            s.rod([end[0] * 0.95, end[1] * 0.95, height], end, 0.025);
        }
    } else {
        s.beam(
            [-0.7 * radius, 0.9 * radius + splay * 0.6, 0.3 * height],
            [0.7 * radius, 0.9 * radius + splay * 0.6, 0.3 * height],
            [0.2, 0.05],
        );
        s.beam(
            [0.0, 0.3 * radius, 0.9 * height],
            [0.0, 0.9 * radius + splay * 0.6, 0.3 * height],
            [0.08, 0.05],
        );
    }
}

fn low_back_height(height: f64) -> f64 {
    0.15 + 0.12 * height
}
