//! Hand tools and instruments.

use super::sketch::{Sketch, arc};

pub(super) fn hammer(s: &mut Sketch) {
    let (length, r) = (s.between(1.2, 2.2), s.between(0.06, 0.11));
    s.cone([0.0; 3], [0.0, 0.0, length], 1.2 * r, 0.9 * r);
    if s.chance(0.5) {
        s.rod([0.0, 0.0, -0.02], [0.0, 0.0, 0.35 * length], 1.45 * r);
    }
    let (head, z) = (s.between(0.14, 0.25), length - 0.05);
    let face = s.between(0.25, 0.5);
    s.cuboid([0.0, 0.0, z], [0.3, 1.2 * head, 1.2 * head]);
    s.rod([0.1, 0.0, z], [face, 0.0, z], 0.4 * head);
    s.rod([face - 0.03, 0.0, z], [face + 0.12, 0.0, z], 0.62 * head);
    let claw = s.between(0.35, 0.7);
    match s.count(0, 2) {
        0 => {
            for y in [-1.0, 1.0] {
                let path = [
                    [-0.1, 0.25 * y * head, z],
                    [-0.1 - 0.5 * claw, 0.35 * y * head, z],
                    [-0.1 - claw, 0.5 * y * head, z - 0.45 * claw],
                ];
                s.tapered_tube(&path, &[0.4 * head, 0.32 * head, 0.1 * head]);
            }
        }
        1 => s.at([-0.1, 0.0, z], [0.0, -90.0, 0.0], |s| {
            s.wedge([0.0; 3], [1.1 * head, 0.9 * head, claw], [0.15, 1.4], [0.0, 0.0]);
        }),
        _ => s.at([-0.1, 0.0, z], [0.0, -90.0, 0.0], |s| {
            s.wedge([0.0; 3], [head, head, claw], [0.9, 0.1], [-0.3 * claw, 0.0]);
        }),
    }
}

pub(super) fn wrench(s: &mut Sketch) {
    let (length, w, t) = (s.between(1.3, 2.4), s.between(0.14, 0.26), s.between(0.06, 0.12));
    s.cuboid([0.5 * length, 0.0, 0.0], [length, w, t]);
    if s.chance(0.5) {
        s.cuboid([0.5 * length, 0.0, 0.0], [0.8 * length, 0.5 * w, 1.5 * t]);
    }
    // The open jaw: a C with its mouth askew.
    let (jaw, mouth, askew) = (s.between(0.25, 0.4), s.between(25.0, 45.0), s.between(-30.0, 30.0));
    let jaw_outline = |radius: f64| -> Vec<[f64; 2]> {
        arc([0.0; 3], [radius, 0.0, 0.0], [0.0, radius, 0.0], 180.0 + mouth, 540.0 - mouth, 16)
            .iter()
            .map(|p| [p[0], p[1]])
            .collect()
    };
    let mut outline = jaw_outline(jaw);
    outline.extend(jaw_outline(0.55 * jaw).iter().rev());
    s.at([-0.6 * jaw, 0.0, -0.6 * t], [0.0, 0.0, askew], |s| s.slab(&outline, 0.0, 1.2 * t));
    // The other end: a ring, a smaller jaw, or a handle with a hole.
    let end = [length + 0.15, 0.0, 0.0];
    match s.count(0, 2) {
        0 => s.lathe(
            [end[0], 0.0, -0.7 * t],
            &[[0.14, 0.0], [0.26, 0.0], [0.26, 1.4 * t], [0.14, 1.4 * t], [0.14, 0.0]],
            [1.0, 1.0],
        ),
        1 => {
            let small: Vec<[f64; 2]> = outline.iter().map(|p| [-0.7 * p[0], 0.7 * p[1]]).collect();
            s.at([end[0], 0.0, -0.6 * t], [0.0, 0.0, -askew], |s| s.slab(&small, 0.0, 1.2 * t));
        }
        _ => s.tube(&[[0.6 * length, 0.0, 0.0], [length + 0.25, 0.0, 0.0]], 0.6 * w),
    }
}

pub(super) fn saw(s: &mut Sketch) {
    let (length, wide, narrow) = (s.between(1.6, 2.8), s.between(0.4, 0.65), s.between(0.12, 0.35));
    let t = s.between(0.02, 0.04);
    let teeth = s.count(10, 22);
    let mut blade = vec![[length, wide], [0.0, wide], [0.0, 0.0]];
    for i in 1..=teeth {
        let x = length * i as f64 / teeth as f64;
        let low = (wide - narrow) * x / length;
        blade.extend([[x - 0.5 * length / teeth as f64, low - 0.06], [x, low]]);
    }
    s.panel(&blade, 0.0, t);
    let (grip, lean) = (s.between(0.06, 0.1), s.between(0.05, 0.25));
    s.tube(
        &[
            [0.1, 0.0, 0.05],
            [-0.3, 0.0, -0.05],
            [-0.45 - lean, 0.0, 0.2],
            [-0.35, 0.0, wide + 0.05],
            [0.1, 0.0, wide - 0.05],
        ],
        grip,
    );
    s.panel(&[[-0.05, 0.0], [0.25, 0.05], [0.2, wide], [-0.05, wide]], 0.0, 1.4 * grip);
}

pub(super) fn drill(s: &mut Sketch) {
    let (length, r) = (s.between(0.9, 1.4), s.between(0.2, 0.28));
    s.lathe_along(&[
        [0.0, 0.0],
        [0.8 * r, 0.0],
        [r, 0.15],
        [r, 0.75 * length],
        [0.7 * r, length],
        [0.0, length],
    ]);
    s.cone([length - 0.02, 0.0, 0.0], [length + 0.22, 0.0, 0.0], 0.5 * r, 0.35 * r);
    let bit = s.between(0.2, 0.9);
    s.rod([length + 0.2, 0.0, 0.0], [length + 0.2 + bit, 0.0, 0.0], 0.04);
    let (grip, lean) = (s.between(0.6, 1.0), s.between(0.0, 0.3));
    s.beam([0.3, 0.0, -0.5 * r], [0.3 - lean, 0.0, -0.6 * r - grip], [1.1 * r, 1.3 * r]);
    s.cuboid([0.3 + r, 0.0, -r - 0.1], [0.12, 0.12, 0.2]);
    if s.chance(0.7) {
        let at = [0.35 - lean, 0.0, -0.6 * r - grip];
        let size = [s.between(0.45, 0.8), s.between(0.3, 0.5), s.between(0.15, 0.3)];
        s.cuboid(at, size);
    } else {
        let z = -0.6 * r - grip;
        s.tube(&[[0.3 - lean, 0.0, z], [0.1 - lean, 0.1, z - 0.4], [-0.4, 0.3, z - 0.5]], 0.04);
    }
    if s.chance(0.4) {
        let side = s.side();
        s.rod([0.8 * length, 0.0, 0.0], [0.8 * length, side * 0.7, 0.0], 0.07);
    }
}

pub(super) fn guitar(s: &mut Sketch) {
    let (lower, upper, waist) = (s.between(0.55, 0.75), s.between(0.4, 0.6), s.between(0.3, 0.45));
    let (length, depth) = (s.between(1.3, 1.7), s.between(0.08, 0.35));
    const STEPS: usize = 14;
    let half = |up: f64| {
        let bulge = if up < 0.55 { lower } else { upper };
        let share = if up < 0.55 { up / 0.55 } else { (up - 0.55) / 0.45 };
        let hump = (std::f64::consts::PI * share).sin().max(0.0).powf(0.6);
        let floor = if up < 0.55 { waist * share } else { waist * (1.0 - share) };
        floor.max(hump * bulge).max(0.05)
    };
    let horn = s.chance(0.4);
    let mut outline: Vec<[f64; 2]> =
        (0..=STEPS).map(|i| i as f64 / STEPS as f64).map(|up| [half(up), length * up]).collect();
    let cut = if horn { s.between(0.35, 0.7) } else { 1.0 };
    outline.extend((0..=STEPS).rev().map(|i| {
        let up = i as f64 / STEPS as f64;
        [-half(up) * if up > 0.6 { cut } else { 1.0 }, length * up]
    }));
    s.slab(&outline, 0.0, depth);
    let (neck, head) = (s.between(1.2, 1.8), s.between(0.3, 0.5));
    let top = length + neck;
    s.beam([0.0, 0.75 * length, depth], [0.0, top, depth], [0.16, 0.1]);
    let tilt = s.between(0.0, 15.0);
    let side = s.side();
    let lopsided = s.between(0.0, 0.12) * side;
    s.at([0.0, top - 0.03, depth], [-tilt, 0.0, 0.0], |s| {
        s.slab(&[[-0.09, 0.0], [0.09, 0.0], [0.14 + lopsided, head], [-0.14 + lopsided, head]], -0.04, 0.08);
        for i in 0..3 {
            for x in [-1.0, 1.0] {
                let y = head * (0.25 + 0.25 * i as f64);
                s.rod([0.0, y, 0.0], [x * 0.24, y, 0.0], 0.025);
            }
        }
    });
    s.cuboid([0.0, 0.3 * length, depth + 0.02], [0.4, 0.08, 0.08]);
    if s.chance(0.5) {
        s.rod([0.3 * lower, 0.2 * length, depth - 0.02], [0.3 * lower, 0.2 * length, depth + 0.07], 0.06);
        s.rod([0.5 * lower, 0.3 * length, depth - 0.02], [0.5 * lower, 0.3 * length, depth + 0.07], 0.06);
    }
}

pub(super) fn faucet(s: &mut Sketch) {
    let (r, up, reach) = (s.between(0.07, 0.13), s.between(0.4, 1.3), s.between(0.5, 1.0));
    s.cone([0.0; 3], [0.0, 0.0, 0.1], 2.5 * r, 2.0 * r);
    if s.chance(0.6) {
        let mut path = vec![[0.0, 0.0, 0.05]];
        path.extend(arc(
            [0.5 * reach, 0.0, up],
            [-0.5 * reach, 0.0, 0.0],
            [0.0, 0.0, 0.5 * reach],
            0.0,
            180.0,
            12,
        ));
        path.push([reach, 0.0, up - s.between(0.05, 0.3)]);
        s.tube(&path, r);
    } else {
        let drop = s.between(0.1, 0.3);
        s.tube(&[[0.0, 0.0, 0.05], [0.0, 0.0, up], [reach, 0.0, up + 0.1], [reach, 0.0, up - drop]], r);
    }
    if s.chance(0.5) {
        let (spread, turn) = (s.between(0.35, 0.6), s.between(0.0, 90.0));
        s.beam([0.0, -spread, 0.08], [0.0, spread, 0.08], [2.0 * r, 0.12]);
        for y in [-spread, spread] {
            s.rod([0.0, y, 0.05], [0.0, y, 0.35], r);
            s.at([0.0, y, 0.35], [0.0, 0.0, turn], |s| {
                s.rod([-0.2, 0.0, 0.0], [0.2, 0.0, 0.0], 0.05);
                s.rod([0.0, -0.2, 0.0], [0.0, 0.2, 0.0], 0.05);
            });
        }
    } else {
        let (side, lift) = (s.side(), s.between(0.0, 0.3));
        s.tube(&[[0.0, 0.0, 0.3], [0.0, side * 0.3, 0.35], [0.25, side * 0.4, 0.35 + lift]], 0.7 * r);
    }
}

impl Sketch {
    /// A profile of `[radius, distance]` turned about the x axis.
    fn lathe_along(&mut self, profile: &[[f64; 2]]) {
        self.at([0.0; 3], [0.0, 90.0, 0.0], |s| s.lathe([0.0; 3], profile, [1.0, 1.0]));
    }
}
