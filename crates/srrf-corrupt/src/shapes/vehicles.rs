//! Things that move. The front is towards +x.

use super::sketch::{Sketch, arc, station};

/// A wheel about the y axis with a hub.
fn wheel(s: &mut Sketch, [x, y, z]: [f64; 3], radius: f64, width: f64) {
    let at = |y: f64| [x, y, z];
    s.rod(at(y - 0.5 * width), at(y + 0.5 * width), radius);
    let out = y.signum() * 0.6 * width;
    s.rod(at(y), at(y + out), 0.4 * radius);
}

pub(super) fn car(s: &mut Sketch) {
    let (length, width, body) = (s.between(3.4, 5.0), s.between(1.5, 1.9), s.between(0.5, 0.75));
    let (wheel_r, clear) = (s.between(0.28, 0.42), s.between(0.18, 0.35));
    let (half, mid) = (0.5 * width, clear + 0.5 * body);
    let nose = s.between(0.55, 0.9);
    let power = s.between(3.0, 6.0);
    s.loft(&[
        station(-0.5 * length, [0.0, mid], [0.85 * half, 0.4 * body], power),
        station(-0.42 * length, [0.0, mid], [half, 0.5 * body], power),
        station(0.2 * length, [0.0, mid], [half, 0.5 * body], power),
        station(0.44 * length, [0.0, mid - 0.1 * body], [0.95 * half, 0.5 * body * nose], power),
        station(0.5 * length, [0.0, mid - 0.12 * body], [0.8 * half, 0.4 * body * nose], power),
    ]);
    // The cabin: from a hatchback to a pick-up.
    let (front, roof) = (s.between(0.08, 0.25) * length, s.between(0.4, 0.7));
    let rear = -s.between(0.0, 0.48) * length;
    let (slope_f, slope_r) = (s.between(0.3, 0.9), s.between(0.05, 0.8));
    let z = clear + 0.93 * body;
    let profile =
        [[rear, z], [front + slope_f, z], [front, z + roof], [(rear + slope_r).min(front - 0.3), z + roof]];
    s.panel(&profile, 0.0, 0.86 * width);
    let track = 0.5 * width - 0.08;
    let axles = [-s.between(0.28, 0.34) * length, s.between(0.28, 0.34) * length];
    for x in axles {
        for y in [-track, track] {
            wheel(s, [x, y, wheel_r], wheel_r, 0.22);
        }
    }
    for y in [-1.0, 1.0] {
        s.cuboid([front + 0.5 * slope_f, y * (half + 0.06), z + 0.1], [0.1, 0.2, 0.12]); // mirrors
    }
    if s.chance(0.4) {
        let x = -0.45 * length;
        s.cuboid([x, 0.0, clear + body + 0.15], [0.25, 0.9 * width, 0.04]); // a spoiler
        for y in [-0.35, 0.35] {
            s.cuboid([x, y * width, clear + body + 0.05], [0.08, 0.05, 0.22]);
        }
    }
    if s.chance(0.3) {
        let (x, w) = (0.5 * (rear + front), s.between(0.5, 0.8) * width);
        s.cuboid([x, 0.0, z + roof + 0.1], [0.4 * (front - rear), w, 0.22]); // a roof box
    }
}

pub(super) fn truck(s: &mut Sketch) {
    let (width, cab, bed) = (s.between(1.8, 2.4), s.between(1.2, 1.9), s.between(2.5, 5.5));
    let (r, chassis) = (s.between(0.4, 0.55), s.between(0.6, 0.9));
    s.cuboid([0.5 * (cab - bed), 0.0, chassis], [bed + cab, 0.7 * width, 0.2]);
    let cab_h = s.between(1.3, 2.0);
    let slope = s.between(0.0, 0.6);
    let nose = if s.chance(0.4) { s.between(0.5, 1.0) } else { 0.0 };
    let z = chassis;
    s.panel(
        &[[0.05, z], [cab, z], [cab, z + 0.45 * cab_h], [cab - slope, z + cab_h], [0.05, z + cab_h]],
        0.0,
        0.95 * width,
    );
    if nose > 0.0 {
        s.wedge(
            [cab + 0.45 * nose, 0.0, z],
            [nose + 0.1, 0.85 * width, 0.45 * cab_h],
            [0.9, 0.9],
            [0.0, 0.0],
        );
    }
    let box_h = s.between(0.3, 2.3);
    match s.count(0, 2) {
        0 => s.cuboid([-0.5 * bed, 0.0, z + 0.5 * box_h], [bed, width, box_h]),
        1 => {
            let half = 0.5 * width;
            s.rod([-bed, 0.0, z + 0.8 * half], [-0.05, 0.0, z + 0.8 * half], 0.9 * half); // a tank
            s.rod([-0.5 * bed, 0.0, z + 1.5 * half], [-0.5 * bed, 0.0, z + 1.85 * half], 0.25);
        }
        _ => {
            let sides = 0.3 + 0.25 * box_h;
            s.cuboid([-0.5 * bed, 0.0, z + 0.1], [bed, width, 0.08]); // an open bed with a load
            for y in [-0.5, 0.5] {
                s.cuboid([-0.5 * bed, y * width, z + 0.5 * sides], [bed, 0.06, sides]);
            }
            s.cuboid([-bed, 0.0, z + 0.5 * sides], [0.06, width, sides]);
            for _ in 0..s.count(1, 3) {
                let size = s.between(0.5, 1.0);
                let at = [-s.between(0.2, 0.8) * bed, s.between(-0.2, 0.2) * width, z + 0.12 + 0.5 * size];
                s.cuboid(at, [size, 0.8 * size, size]);
            }
        }
    }
    let axles = s.count(1, 2);
    for y in [-0.45, 0.45] {
        wheel(s, [0.6 * cab, y * width, r], r, 0.3);
        for i in 0..axles {
            wheel(s, [-bed + 0.8 + 2.1 * r * i as f64, y * width, r], r, 0.35);
        }
    }
    if s.chance(0.5) {
        let y = s.side() * 0.45 * width;
        s.rod([-0.02, y, z], [-0.02, y, z + cab_h + 0.5], 0.08); // the exhaust
    }
}

pub(super) fn airplane(s: &mut Sketch) {
    let (length, r) = (s.between(5.0, 8.0), s.between(0.3, 0.5));
    let tail = s.between(0.1, 0.35);
    s.loft(&[
        station(-0.5 * length, [0.0, 0.5 * r], [0.1 * r, 0.12 * r], 2.0),
        station(-0.25 * length, [0.0, 0.2 * r], [0.7 * r, 0.75 * r], 2.0),
        station(-0.1 * length, [0.0, 0.0], [r, r], 2.0),
        station(0.35 * length, [0.0, 0.0], [r, r], 2.0),
        station(0.46 * length, [0.0, -0.15 * r], [0.6 * r, 0.65 * r], 2.0),
        station(0.5 * length, [0.0, -0.2 * r], [0.15 * r, 0.2 * r], 2.0),
    ]);
    let (span, chord, sweep) = (s.between(2.2, 4.5), s.between(0.8, 1.5), s.between(-0.1, 1.8));
    let (tip, dihedral) = (s.between(0.25, 0.8), s.between(-4.0, 8.0));
    let wing_z = if s.chance(0.3) { 0.8 * r } else { -0.4 * r };
    let x = s.between(-0.05, 0.12) * length;
    let wing = |s: &mut Sketch, at: [f64; 3], span: f64, chord: f64, sweep: f64, lift: f64| {
        for y in [-1.0, 1.0] {
            let tip_chord = chord * tip;
            let outline =
                [[0.0, 0.0], [chord, 0.0], [chord - sweep, y * span], [chord - sweep - tip_chord, y * span]];
            s.at(at, [y * lift, 0.0, 0.0], |s| s.slab(&outline, -0.03, 0.07));
        }
    };
    wing(s, [x - 0.5 * chord, 0.0, wing_z], span, chord, sweep, dihedral);
    let t_tail = s.chance(0.3);
    let fin = s.between(0.8, 1.4);
    let fin_z = if t_tail { 0.4 * r + 0.95 * fin } else { 0.5 * r };
    wing(s, [-0.49 * length, 0.0, fin_z], 0.35 * span, 0.55 * chord, 0.3 * sweep, 0.0);
    let foot = [-0.49 * length, 0.3 * r];
    s.panel(
        &[
            foot,
            [foot[0] + 0.9 * chord, foot[1]],
            [foot[0] + 0.3 - tail, foot[1] + fin],
            [foot[0] - tail, foot[1] + fin],
        ],
        0.0,
        0.07,
    );
    match s.count(0, 2) {
        0 => {
            // Jets under the wings or at the tail.
            let (jx, jy) = if t_tail { (-0.32 * length, 1.6 * r) } else { (x, 0.35 * span) };
            for y in [-jy, jy] {
                let z = if t_tail { 0.3 * r } else { wing_z - 0.2 };
                s.cone([jx - 0.5, y, z], [jx + 0.5, y, z], 0.14, 0.22);
                s.beam(
                    [jx, y, z],
                    [jx, if t_tail { 0.0 } else { y }, if t_tail { 0.2 * r } else { wing_z }],
                    [0.3, 0.06],
                );
            }
        }
        1 => {
            // One propeller, and wheels.
            let blades = s.count(2, 4);
            for i in 0..blades {
                s.at(
                    [0.5 * length + 0.02, 0.0, -0.2 * r],
                    [360.0 * i as f64 / blades as f64, 0.0, 0.0],
                    |s| {
                        s.cuboid([0.0, 0.0, 0.35], [0.04, 0.12, 0.7]);
                    },
                );
            }
            for y in [-0.9, 0.9] {
                s.rod([x, 0.5 * y * r, -0.6 * r], [x, 2.0 * y * r, -2.2 * r], 0.04);
                wheel(s, [x, 2.0 * y * r, -2.2 * r], 0.2, 0.1);
            }
        }
        _ => {
            for y in [-0.5, 0.5] {
                let pod = [x + 0.2 * chord, y * span, wing_z];
                s.ball(pod, [0.8, 0.18, 0.18]);
                s.rod([pod[0] + 0.75, pod[1], wing_z], [pod[0] + 0.8, pod[1], wing_z], 0.5);
            }
        }
    }
}

pub(super) fn helicopter(s: &mut Sketch) {
    let (l, w, h) = (s.between(0.9, 1.4), s.between(0.5, 0.8), s.between(0.55, 0.85));
    s.ball([0.0, 0.0, 0.0], [l, w, h]);
    let (boom, droop) = (s.between(1.8, 3.0), s.between(-0.1, 0.4));
    let tip = [-0.5 * l - boom, 0.0, 0.2 * h + droop];
    s.cone([-0.5 * l, 0.0, 0.2 * h], tip, 0.35 * h, 0.1);
    let fin = s.between(0.4, 0.8);
    s.panel(
        &[
            [tip[0], tip[2] - 0.2],
            [tip[0] + 0.3, tip[2]],
            [tip[0] - 0.1, tip[2] + fin],
            [tip[0] - 0.35, tip[2] + fin],
        ],
        0.0,
        0.06,
    );
    s.cuboid([tip[0] + 0.5, 0.0, tip[2]], [0.3, 1.0, 0.05]);
    let side = s.side();
    let rotor = s.between(0.25, 0.45);
    for turn in [20.0, 110.0] {
        s.at([tip[0], side * 0.12, tip[2] + 0.3], [0.0, turn, 0.0], |s| {
            s.cuboid([0.0; 3], [2.0 * rotor, 0.03, 0.08])
        });
    }
    s.rod([0.0, 0.0, 0.8 * h], [0.0, 0.0, h + 0.35], 0.08);
    let (blades, reach, turn) = (s.count(2, 5), s.between(2.0, 3.2), s.between(0.0, 90.0));
    for i in 0..blades {
        s.at([0.0, 0.0, h + 0.32], [0.0, 0.0, turn + 360.0 * i as f64 / blades as f64], |s| {
            s.cuboid([0.5 * reach, 0.0, 0.0], [reach, 0.16, 0.04]);
        });
    }
    for y in [-0.7, 0.7] {
        let z = -h - 0.3;
        s.tube(&[[-0.9 * l, y * w, z], [0.8 * l, y * w, z], [l, y * w, z + 0.15]], 0.05);
        for x in [-0.4, 0.4] {
            s.rod([x * l, 0.6 * y * w, -0.6 * h], [x * l, y * w, z], 0.04);
        }
    }
}

pub(super) fn boat(s: &mut Sketch) {
    let (length, beam, depth) = (s.between(3.0, 6.0), s.between(0.5, 1.0), s.between(0.3, 0.7));
    let (rise, stern, power) = (s.between(0.1, 0.6), s.between(0.4, 1.0), s.between(1.4, 2.6));
    s.loft(&[
        station(-0.5 * length, [0.0, 0.1], [stern * beam, 0.8 * depth], power),
        station(-0.2 * length, [0.0, 0.0], [beam, depth], power),
        station(0.2 * length, [0.0, 0.05], [0.9 * beam, depth], power),
        station(0.42 * length, [0.0, 0.2 + 0.5 * rise], [0.35 * beam, 0.8 * depth], power),
        station(0.5 * length, [0.0, 0.3 + rise], [0.05, 0.5 * depth], power),
    ]);
    let deck = 0.6 * depth;
    if s.chance(0.5) {
        // Sails.
        let (mast, x) = (s.between(2.5, 5.0), s.between(0.0, 0.15) * length);
        s.rod([x, 0.0, 0.0], [x, 0.0, mast], 0.06);
        let boom = s.between(0.25, 0.42) * length;
        let swing = s.between(-20.0, 20.0);
        s.at([x, 0.0, 0.0], [0.0, 0.0, swing], |s| {
            s.panel(&[[0.0, deck + 0.4], [-boom, deck + 0.5], [0.0, mast]], 0.0, 0.05);
            s.rod([0.0, 0.0, deck + 0.4], [-boom, 0.0, deck + 0.45], 0.05);
        });
        if s.chance(0.7) {
            s.panel(
                &[[x + 0.1, deck + 0.5], [0.48 * length, 0.5 + rise], [x + 0.05, 0.85 * mast]],
                0.0,
                0.04,
            );
        }
        s.cuboid([0.0, 0.0, -depth], [0.2 * length, 0.08, 0.9 * depth]); // the keel
    } else {
        let (x, cabin) = (-s.between(0.0, 0.25) * length, s.between(0.4, 1.1));
        let lean = s.between(0.5, 1.0);
        s.wedge([x, 0.0, deck], [0.35 * length, 1.3 * beam, cabin], [lean, 0.85], [-0.1, 0.0]);
        if s.chance(0.5) {
            s.wedge(
                [x - 0.05 * length, 0.0, deck + 0.95 * cabin],
                [0.18 * length, beam, 0.6 * cabin],
                [0.8, 0.9],
                [0.0, 0.0],
            );
        }
        for _ in 0..s.count(0, 2) {
            let fx = x - s.between(0.0, 0.1) * length;
            s.cone([fx, 0.0, deck + 0.8 * cabin], [fx - 0.1, 0.0, deck + 2.0 * cabin], 0.18, 0.14);
        }
        s.tube(
            &[
                [0.2 * length, 0.0, deck],
                [0.22 * length, 0.0, deck + 1.2 * cabin],
                [0.35 * length, 0.0, deck + cabin],
            ],
            0.05,
        );
    }
}

pub(super) fn bicycle(s: &mut Sketch) {
    let (r, base) = (s.between(0.55, 0.72), s.between(1.7, 2.1));
    let tyre = s.between(0.03, 0.08);
    let (rear, front) = ([-0.5 * base, 0.0, r], [0.5 * base, 0.0, r]);
    for hub in [rear, front] {
        s.ring(hub, [0.0, 1.0, 0.0], r - tyre, tyre);
        s.rod([hub[0], -0.1, r], [hub[0], 0.1, r], 0.06);
        let spokes = s.count(3, 8);
        for i in 0..spokes {
            let turn = 180.0 * i as f64 / spokes as f64;
            s.at(hub, [0.0, turn, 0.0], |s| s.rod([tyre - r, 0.0, 0.0], [r - tyre, 0.0, 0.0], 0.012));
        }
    }
    let pedals = [-0.08 * base, 0.0, 0.85 * r];
    let (saddle, head) = (
        [-0.2 * base, 0.0, s.between(1.5, 1.9) * r + 0.3],
        [0.36 * base, 0.0, s.between(1.5, 1.8) * r + 0.3],
    );
    let tube = s.between(0.03, 0.06);
    for (a, b) in
        [(rear, pedals), (rear, saddle), (pedals, saddle), (pedals, head), (saddle, head), (head, front)]
    {
        s.tube(&[a, b], tube);
    }
    s.ball([saddle[0], 0.0, saddle[2] + 0.05], [0.22, 0.11, 0.06]);
    let grip = s.between(0.2, 0.35);
    let bar = head[2] + s.between(0.05, 0.25);
    s.tube(&[head, [head[0] - 0.02, 0.0, bar]], tube);
    s.tube(
        &[
            [head[0] - 0.15, -grip, bar],
            [head[0], -0.1, bar],
            [head[0], 0.1, bar],
            [head[0] - 0.15, grip, bar],
        ],
        0.03,
    );
    s.rod([pedals[0], 0.04, pedals[2]], [pedals[0], 0.1, pedals[2]], 0.17); // the chain wheel, to the left
    let turn = s.between(0.0, 360.0);
    s.at(pedals, [0.0, turn, 0.0], |s| {
        for side in [-1.0, 1.0] {
            s.beam([0.0, 0.13 * side, 0.0], [0.25 * side, 0.13 * side, 0.0], [0.03, 0.03]);
            s.cuboid([0.25 * side, 0.22 * side, 0.0], [0.12, 0.16, 0.04]);
        }
    });
    if s.chance(0.5) {
        let guard = arc(rear, [r + 0.04, 0.0, 0.0], [0.0, 0.0, r + 0.04], 20.0, 170.0, 12);
        s.tube(&guard, 0.03);
    }
    if s.chance(0.35) {
        s.wedge([0.5 * base, 0.0, 2.0 * r + 0.1], [0.4, 0.4, 0.28], [1.2, 1.2], [0.0, 0.0]); // a basket
    }
}
