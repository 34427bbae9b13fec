//! Animals and people. The head is towards +x.

use super::sketch::{Sketch, station};

pub(super) fn quadruped(s: &mut Sketch) {
    let (length, girth) = (s.between(0.9, 1.6), s.between(0.2, 0.42));
    let (leg, hip) = (s.between(0.4, 1.1), s.between(0.75, 1.1));
    let z = leg + 0.6 * girth;
    let half = 0.5 * length;
    s.loft(&[
        station(-half, [0.0, z], [0.5 * girth, 0.5 * girth], 2.0),
        station(-0.75 * half, [0.0, z], [0.9 * girth * hip, girth * hip], 2.0),
        station(0.0, [0.0, z - 0.05], [girth, girth], 2.0),
        station(0.75 * half, [0.0, z + 0.03], [0.9 * girth, 1.05 * girth], 2.0),
        station(half, [0.0, z + 0.05], [0.5 * girth, 0.6 * girth], 2.0),
    ]);
    let thick = s.between(0.06, 0.13);
    for x in [-0.75, 0.75] {
        for y in [-1.0, 1.0] {
            let step = s.between(-0.25, 0.25) * leg;
            let knee = if x > 0.0 { 0.05 } else { -0.1 } * leg;
            let at = |dx: f64, up: f64| [x * half + dx, y * 0.6 * girth, up];
            s.tapered_tube(
                &[at(0.0, z), at(0.4 * step + knee, 0.5 * leg), at(step, thick)],
                &[1.6 * thick, thick, 0.8 * thick],
            );
            s.ball(at(step + 0.5 * thick, 0.5 * thick), [1.3 * thick, thick, 0.6 * thick]);
        }
    }
    let (rise, reach) = (s.between(0.0, 0.9), s.between(0.15, 0.4));
    let look = s.between(-0.15, 0.15);
    let head = [half + reach, look, z + 0.1 + rise];
    s.tapered_tube(&[[0.85 * half, 0.0, z + 0.1], head], &[0.65 * girth, 0.38 * girth]);
    let size = s.between(0.7, 1.0) * 0.6 * girth;
    s.ball(head, [1.1 * size, size, size]);
    let snout = s.between(0.8, 2.0) * size;
    s.tapered_tube(
        &[head, [head[0] + snout, head[1] + look, head[2] - 0.3 * snout]],
        &[0.7 * size, 0.4 * size],
    );
    let ear = s.between(0.5, 1.5) * size;
    for y in [-1.0, 1.0] {
        s.cone(
            [head[0] - 0.1, head[1] + 0.5 * y * size, head[2] + 0.5 * size],
            [head[0] - 0.2, head[1] + 0.9 * y * size, head[2] + 0.6 * size + ear],
            0.35 * size,
            0.05 * size,
        );
        if s.chance(0.15) {
            s.tapered_tube(
                &[
                    [head[0], 0.5 * y * size, head[2] + 0.6 * size],
                    [head[0] - 0.1, 1.2 * y * size, head[2] + 1.5 * size],
                    [head[0] + 0.1, 1.4 * y * size, head[2] + 2.2 * size],
                ],
                &[0.2 * size, 0.15 * size, 0.05 * size],
            );
        }
    }
    let (tail, droop, swing) = (s.between(0.3, 1.0), s.between(-0.6, 0.6), s.between(-0.4, 0.4));
    s.tapered_tube(
        &[
            [-0.9 * half, 0.0, z + 0.2 * girth],
            [-half - 0.4 * tail, 0.5 * swing * tail, z + 0.3 * droop * tail],
            [-half - 0.8 * tail, swing * tail, z + droop * tail],
        ],
        &[0.3 * girth, 0.18 * girth, 0.08 * girth],
    );
}

pub(super) fn bird(s: &mut Sketch) {
    let (l, w, h) = (s.between(0.5, 0.8), s.between(0.2, 0.35), s.between(0.22, 0.4));
    let pitch = s.between(-35.0, 10.0);
    let spread = s.chance(0.5);
    let neck = s.between(0.1, 0.7);
    let look = s.between(-0.15, 0.15);
    s.at([0.0; 3], [0.0, pitch, 0.0], |s| {
        s.ball([0.0; 3], [l, w, h]);
        let (fan, tail) = (s.between(0.1, 0.35), s.between(0.4, 0.9));
        s.slab(&[[-0.6 * l, -0.1], [-0.6 * l, 0.1], [-l - tail, fan], [-l - tail, -fan]], 0.0, 0.05);
        for y in [-1.0, 1.0] {
            if spread {
                let (reach, back, lift) = (s.between(1.0, 1.4), s.between(0.0, 0.5), s.between(0.0, 30.0));
                s.at([0.0, 0.6 * y * w, 0.4 * h], [y * lift, 0.0, 0.0], |s| {
                    s.slab(
                        &[
                            [0.35, 0.0],
                            [0.25, y * 0.5 * reach],
                            [-back, y * reach],
                            [-0.35 - 0.5 * back, y * 0.5 * reach],
                            [-0.3, 0.0],
                        ],
                        0.0,
                        0.05,
                    );
                });
            } else {
                s.ball([-0.2 * l, 0.85 * y * w, 0.1 * h], [0.8 * l, 0.3 * w, 0.6 * h]);
            }
        }
    });
    let tilt = pitch.to_radians();
    let chest = [0.75 * l * tilt.cos(), 0.0, -0.75 * l * tilt.sin()];
    let head = [chest[0] + 0.15, look, chest[2] + 0.25 + neck];
    let r = s.between(0.14, 0.22);
    s.tapered_tube(
        &[chest, [chest[0] + 0.1, 0.5 * look, 0.5 * (chest[2] + head[2])], head],
        &[0.8 * h, 0.55 * r, 0.6 * r],
    );
    s.ball(head, [1.1 * r, r, r]);
    let beak = s.between(0.15, 0.6);
    s.cone(head, [head[0] + r + beak, look, head[2] - 0.2 * beak], 0.5 * r, 0.02);
    let leg = s.between(0.2, 0.9);
    for y in [-0.45, 0.45] {
        let foot = [s.between(-0.1, 0.2), y * w, -0.8 * h - leg];
        s.rod([0.0, y * w, -0.5 * h], foot, 0.035);
        s.slab_at(foot, &[[-0.08, 0.0], [0.2, -0.12], [0.2, 0.12]], 0.03);
    }
}

pub(super) fn fish(s: &mut Sketch) {
    let (l, w, h) = (s.between(0.8, 1.2), s.between(0.15, 0.35), s.between(0.2, 0.5));
    let bend = s.between(-0.25, 0.25);
    let at = |x: f64, side: f64, y: f64, z: f64| station(x * l, [bend * side, 0.0], [y * w, z * h], 2.0);
    s.loft(&[
        at(-1.0, 1.0, 0.12, 0.15),
        at(-0.6, 0.4, 0.4, 0.45),
        at(-0.1, 0.05, 0.9, 0.95),
        at(0.3, 0.0, 1.0, 1.0),
        at(0.75, 0.0, 0.75, 0.65),
        at(1.0, 0.0, 0.2, 0.15),
    ]);
    let (fork, tail) = (s.between(0.2, 0.6), s.between(0.25, 0.5));
    s.panel(
        &[[-0.95 * l, 0.0], [-l - tail, fork], [-l - 0.5 * tail, 0.0], [-l - tail, -0.8 * fork]],
        bend,
        0.04,
    );
    let (dorsal, from) = (s.between(0.1, 0.5), s.between(-0.1, 0.4));
    s.panel(&[[from * l, 0.7 * h], [(from - 0.3) * l, h + dorsal], [(from - 0.6) * l, 0.45 * h]], 0.0, 0.04);
    if s.chance(0.6) {
        s.panel(&[[-0.2 * l, -0.7 * h], [-0.4 * l, -h - 0.2], [-0.5 * l, -0.5 * h]], 0.0, 0.04);
    }
    for y in [-1.0, 1.0] {
        let (down, fin) = (s.between(20.0, 70.0), s.between(0.2, 0.5));
        s.at([0.4 * l, 0.8 * y * w, -0.2 * h], [-y * down, 0.0, 0.0], |s| {
            s.slab(&[[0.1, 0.0], [-0.25, y * fin], [-0.3, 0.6 * y * fin], [-0.15, 0.0]], 0.0, 0.03);
        });
        s.ball([0.8 * l, 0.55 * y * w, 0.15 * h], [0.05, 0.05, 0.05]);
    }
}

pub(super) fn person(s: &mut Sketch) {
    let (hip, chest) = (s.between(0.14, 0.22), s.between(0.18, 0.28));
    let (leg, torso) = (s.between(0.75, 1.0), s.between(0.5, 0.68));
    let sitting = s.chance(0.25);
    let neck = leg + torso;
    s.at([0.0, 0.0, leg - 0.05], [0.0, -90.0, 0.0], |s| {
        // Along the spine: x of the loft points up, its z forwards.
        s.loft(&[
            station(0.0, [0.0, 0.0], [hip, 0.7 * hip], 2.5),
            station(0.45 * torso, [0.0, 0.0], [0.85 * hip, 0.6 * hip], 2.2),
            station(0.85 * torso, [0.0, 0.0], [chest, 0.6 * chest], 2.5),
            station(torso, [0.0, 0.0], [0.5 * chest, 0.4 * chest], 2.0),
        ]);
    });
    let look = s.between(-0.08, 0.12);
    s.rod([0.0, 0.0, neck - 0.1], [look, 0.0, neck + 0.12], 0.055);
    s.ball([look, 0.0, neck + 0.2], [0.12, 0.1, 0.14]);
    s.ball([look + 0.11, 0.0, neck + 0.19], [0.04, 0.025, 0.04]);
    for y in [-1.0, 1.0] {
        let shoulder = [0.0, y * 0.95 * chest, neck - 0.12];
        let (out, forward, bend) = (s.between(0.05, 1.6), s.between(-0.4, 0.9), s.between(0.0, 1.4));
        let (upper, lower) = (0.32, 0.3);
        let elbow = [
            shoulder[0] + upper * forward.sin(),
            shoulder[1] + y * upper * out.sin(),
            shoulder[2] - upper * out.cos() * forward.cos(),
        ];
        let hand = [
            elbow[0] + lower * (forward + bend).sin(),
            elbow[1] + y * lower * 0.6 * out.sin(),
            elbow[2] - lower * out.cos() * (forward + bend).cos(),
        ];
        s.tapered_tube(&[shoulder, elbow, hand], &[0.065, 0.05, 0.04]);
        s.ball(hand, [0.06, 0.035, 0.07]);
        let root = [0.0, y * 0.55 * hip, leg];
        let stride = if sitting { 1.45 } else { s.between(-0.45, 0.45) };
        let knee = [0.5 * leg * f64::sin(stride), root[1] + y * 0.03, leg - 0.5 * leg * f64::cos(stride)];
        let shin = if sitting { 0.1 } else { stride - s.between(0.0, 0.4) };
        let foot = [knee[0] + 0.48 * leg * f64::sin(shin), knee[1], knee[2] - 0.48 * leg * f64::cos(shin)];
        s.tapered_tube(&[root, knee, foot], &[0.1, 0.07, 0.05]);
        s.ball([foot[0] + 0.07, foot[1], foot[2] - 0.02], [0.13, 0.05, 0.045]);
    }
    match s.count(0, 3) {
        0 => s.cuboid([-0.7 * chest - 0.06, 0.0, neck - 0.28], [0.2, 1.3 * chest, 0.4]), // a rucksack
        1 => s.cone([look, 0.0, neck + 0.26], [look, 0.0, neck + 0.38], 0.2, 0.1),
        2 if sitting => s.cuboid([0.0, 0.0, 0.45 * leg], [0.4, 0.4, 0.9 * leg]),
        _ => {}
    }
}

impl Sketch {
    /// A flat polygon at a place.
    fn slab_at(&mut self, origin: [f64; 3], polygon: &[[f64; 2]], height: f64) {
        self.at(origin, [0.0; 3], |s| s.slab(polygon, 0.0, height));
    }
}
