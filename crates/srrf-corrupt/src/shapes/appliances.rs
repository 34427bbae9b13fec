//! Household machines. The front is towards -y.

use super::sketch::{Sketch, arc};

pub(super) fn laptop(s: &mut Sketch) {
    let (w, d, t) = (s.between(1.2, 1.7), s.between(0.8, 1.2), s.between(0.03, 0.1));
    s.cuboid([0.0, 0.0, 0.0], [w, d, t]);
    let opening = s.between(5.0, 50.0);
    let tall = d * s.between(0.85, 1.05);
    s.at([0.0, 0.5 * d - 0.02, 0.5 * t], [-opening, 0.0, 0.0], |s| {
        s.cuboid([0.0, 0.0, 0.5 * tall], [w, 0.7 * t, tall])
    });
    s.rod([-0.35 * w, 0.5 * d, 0.5 * t], [0.35 * w, 0.5 * d, 0.5 * t], 0.6 * t);
    s.cuboid([0.0, 0.15 * d, 0.5 * t], [0.85 * w, 0.45 * d, 0.03]); // the keys
    s.cuboid([0.0, -0.3 * d, 0.5 * t], [0.3 * w, 0.25 * d, 0.015]);
    if s.chance(0.5) {
        let (x, y) = (s.side() * (0.5 * w + 0.3), s.between(-0.4, 0.1) * d);
        s.ball([x, y, 0.0], [0.1, 0.16, 0.08]); // a mouse
        s.tube(&[[x, y + 0.1, 0.0], [x * 0.95, y + 0.4, 0.0], [0.45 * w * x.signum(), 0.4 * d, 0.0]], 0.015);
    }
}

pub(super) fn monitor(s: &mut Sketch) {
    let (w, h, t) = (s.between(1.2, 2.2), s.between(0.8, 1.2), s.between(0.04, 0.2));
    let (stand, tilt) = (s.between(0.15, 0.6), s.between(-15.0, 10.0));
    let rim = s.between(0.03, 0.08);
    s.at([0.0, 0.0, stand + 0.5 * h], [tilt, 0.0, 0.0], |s| {
        s.cuboid([0.0, 0.0, 0.0], [w, t, h]);
        for side in [-0.5, 0.5] {
            s.cuboid([side * (w - rim), -0.5 * t, 0.0], [rim, 0.05, h]);
            s.cuboid([0.0, -0.5 * t, side * (h - rim)], [w, 0.05, rim]);
        }
        if s.chance(0.4) {
            let deep = s.between(0.2, 0.8);
            s.at([0.0, 0.4 * t, 0.0], [-90.0, 0.0, 0.0], |s| {
                s.wedge([0.0; 3], [0.9 * w, 0.9 * h, deep], [0.5, 0.5], [0.0, 0.0]); // a picture tube
            });
        }
    });
    match s.count(0, 2) {
        0 => {
            s.beam([0.0, 0.1, 0.0], [0.0, 0.05, stand + 0.4 * h], [0.2, 0.06]);
            s.cuboid([0.0, 0.0, 0.02], [0.4 * w, 0.5, 0.04]);
        }
        1 => {
            s.rod([0.0, 0.1, 0.0], [0.0, 0.1, stand + 0.3 * h], 0.06);
            s.lathe([0.0, 0.05, 0.0], &[[0.0, 0.0], [1.0, 0.0], [0.9, 0.05], [0.0, 0.06]], [0.25 * w, 0.25]);
        }
        _ => {
            for x in [-0.35, 0.35] {
                for y in [-0.3, 0.3] {
                    s.beam([x * w, 0.0, stand + 0.1], [x * w * 1.1, y, 0.0], [0.05, 0.05]);
                }
            }
        }
    }
    if s.chance(0.3) {
        let x = s.side() * (0.5 * w + 0.2);
        let tall = s.between(0.4, 0.9);
        s.cuboid([x, 0.0, 0.5 * tall], [0.2, 0.3, tall]); // a loudspeaker
    }
}

pub(super) fn piano(s: &mut Sketch) {
    let width = s.between(1.4, 1.7);
    let leg = s.between(0.6, 0.75);
    if s.chance(0.5) {
        // A grand: its long side is the bass, to the left.
        let (length, bend) = (s.between(1.2, 2.2), s.between(0.4, 0.6));
        let half = 0.5 * width;
        let outline = [
            [-half, 0.0],
            [half, 0.0],
            [half, 0.4 * length],
            [0.55 * half, bend * length],
            [0.2 * half, 0.75 * length],
            [-0.1 * half, 0.96 * length],
            [-0.5 * half, length],
            [-half, 0.93 * length],
        ];
        s.slab(&outline, leg, 0.3);
        for at in [[-0.8 * half, 0.15], [0.8 * half, 0.15], [-0.4 * half, 0.85 * length]] {
            s.cone([at[0], at[1], 0.0], [at[0], at[1], leg + 0.05], 0.05, 0.09);
        }
        if s.chance(0.6) {
            let lift = s.between(20.0, 45.0);
            s.at([-half, 0.0, leg + 0.31], [0.0, -lift, 0.0], |s| {
                let lid: Vec<[f64; 2]> = outline
                    .iter()
                    .map(|p| [p[0] + half, p[1]])
                    .filter(|p| p[1] > 0.0 || p[0] == 0.0)
                    .collect();
                s.slab(&lid, 0.0, 0.03);
            });
            s.rod(
                [0.7 * half, 0.35 * length, leg + 0.28],
                [0.55 * half, 0.35 * length, leg + 0.3 + 1.5 * half * lift.to_radians().sin()],
                0.02,
            );
        }
    } else {
        let (depth, tall) = (s.between(0.3, 0.45), s.between(1.1, 1.5));
        s.cuboid([0.0, 0.5 * depth, 0.5 * tall], [width, depth, tall]);
        s.wedge([0.0, 0.5 * depth, tall - 0.01], [1.03 * width, 1.05 * depth, 0.05], [1.0, 1.0], [0.0, 0.0]);
        for x in [-0.46, 0.46] {
            s.cone([x * width, -0.25, 0.0], [x * width, -0.25, leg], 0.04, 0.05);
        }
    }
    s.cuboid([0.0, -0.14, leg + 0.06], [0.98 * width, 0.32, 0.12]);
    s.cuboid([0.0, -0.18, leg + 0.13], [0.88 * width, 0.2, 0.04]);
    s.at([0.0, 0.1, leg + 0.3], [-15.0, 0.0, 0.0], |s| s.cuboid([0.0, 0.0, 0.2], [0.45 * width, 0.03, 0.35]));
    if s.chance(0.6) {
        let (x, y, seat) = (s.between(-0.2, 0.2), -s.between(0.6, 0.9), s.between(0.4, 0.5));
        s.cuboid([x, y, seat], [0.7, 0.35, 0.1]);
        for sx in [-0.3, 0.3] {
            s.beam([x + sx, y - 0.12, 0.0], [x + sx, y - 0.12, seat], [0.05, 0.05]);
            s.beam([x + sx, y + 0.12, 0.0], [x + sx, y + 0.12, seat], [0.05, 0.05]);
        }
    }
    s.cuboid([0.0, 0.0, 0.1], [0.25, 0.12, 0.06]);
}

pub(super) fn toilet(s: &mut Sketch) {
    let (l, w, h) = (s.between(0.28, 0.4), s.between(0.2, 0.28), s.between(0.38, 0.46));
    let bowl = [
        [0.0, 0.0],
        [0.55, 0.0],
        [0.5, 0.4 * h],
        [0.95, 0.85 * h],
        [1.0, h],
        [0.8, h],
        [0.65, 0.7 * h],
        [0.0, 0.55 * h],
    ];
    s.lathe([0.0; 3], &bowl, [w, l]);
    s.cuboid([0.0, 0.6 * l, 0.3 * h], [0.9 * w, 0.9 * l, 0.6 * h]);
    let (tank_w, tank_d, tank_h) = (s.between(0.38, 0.5), s.between(0.15, 0.22), s.between(0.3, 0.5));
    let y = l + 0.4 * tank_d;
    s.wedge([0.0, y, h - 0.06], [tank_w, tank_d, tank_h], [1.08, 1.05], [0.0, 0.0]);
    s.cuboid([0.0, y, h + tank_h - 0.04], [1.15 * tank_w, 1.15 * tank_d, 0.04]);
    let side = s.side();
    s.rod(
        [side * 0.35 * tank_w, y - 0.5 * tank_d, h + 0.75 * tank_h],
        [side * 0.35 * tank_w, y - 0.5 * tank_d - 0.06, h + 0.75 * tank_h],
        0.025,
    );
    s.beam(
        [side * 0.35 * tank_w, y - 0.5 * tank_d - 0.05, h + 0.75 * tank_h],
        [side * 0.15 * tank_w, y - 0.5 * tank_d - 0.06, h + 0.73 * tank_h],
        [0.02, 0.03],
    );
    let lid = [[0.0, 0.0], [1.02, 0.0], [1.02, 0.03], [0.0, 0.04]];
    if s.chance(0.5) {
        s.lathe([0.0, 0.0, h], &lid, [w, l]);
    } else {
        s.lathe(
            [0.0, 0.0, h - 0.005],
            &[[0.6, 0.0], [1.04, 0.0], [1.04, 0.03], [0.6, 0.03], [0.6, 0.0]],
            [w, l],
        );
        let lean = s.between(75.0, 100.0);
        s.at([0.0, 0.9 * l, h + 0.02], [lean, 0.0, 0.0], |s| {
            s.lathe([0.0, 0.9 * l, 0.0], &lid, [w, 0.95 * l])
        });
    }
}

pub(super) fn radio(s: &mut Sketch) {
    let (w, d, h) = (s.between(1.0, 1.8), s.between(0.25, 0.6), s.between(0.5, 0.9));
    let taper = s.between(0.8, 1.0);
    s.wedge([0.0; 3], [w, d, h], [taper, taper], [0.0, 0.0]);
    let speakers = s.count(1, 2);
    let side = s.side();
    for i in 0..speakers {
        let x = if speakers == 1 { side * 0.22 * w } else { (i as f64 - 0.5) * 0.6 * w };
        s.rod([x, 0.0, 0.45 * h], [x, -0.5 * d - 0.05, 0.45 * h], 0.32 * h);
        s.rod([x, 0.0, 0.45 * h], [x, -0.5 * d - 0.08, 0.45 * h], 0.12 * h);
    }
    for i in 0..s.count(1, 4) {
        let x = if speakers == 1 { -side * (0.1 + 0.1 * i as f64) * w } else { (0.1 * i as f64 - 0.12) * w };
        s.rod([x, 0.0, 0.75 * h], [x, -0.5 * d - 0.07, 0.75 * h], 0.05);
    }
    s.cuboid([0.0, -0.5 * d, 0.88 * h], [0.5 * w, 0.04, 0.1 * h]);
    if s.chance(0.7) {
        let lean = s.between(-0.6, 0.6);
        let x = s.side() * 0.4 * w;
        let tall = s.between(0.5, 1.3);
        s.rod([x, 0.3 * d, 0.9 * h], [x + lean, 0.3 * d, h + tall], 0.02);
    }
    if s.chance(0.6) {
        let up = s.between(0.15, 0.4);
        let reach = 0.42 * w * taper;
        s.tube(
            &[
                [-reach, 0.0, h - 0.05],
                [-0.9 * reach, 0.0, h + up],
                [0.9 * reach, 0.0, h + up],
                [reach, 0.0, h - 0.05],
            ],
            0.035,
        );
    }
}

pub(super) fn gamepad(s: &mut Sketch) {
    let (w, d, t) = (s.between(0.6, 0.8), s.between(0.35, 0.5), s.between(0.14, 0.24));
    s.lathe([0.0; 3], &[[0.0, -t], [0.8, -t], [1.0, 0.0], [0.8, t], [0.0, t]], [w, d]);
    let (reach, droop) = (s.between(0.5, 0.8), s.between(0.05, 0.3));
    for x in [-1.0, 1.0] {
        s.tapered_tube(
            &[
                [0.6 * x * w, 0.0, 0.0],
                [0.95 * x * w, -0.5 * reach, -0.3 * droop],
                [1.0 * x * w, -reach, -droop],
            ],
            &[0.9 * t, 0.85 * t, 0.6 * t],
        );
        s.rod([0.6 * x * w, 0.75 * d, 0.0], [0.35 * x * w, 0.9 * d, 0.0], 0.35 * t);
    }
    let stick = |s: &mut Sketch, x: f64, y: f64| {
        s.rod([x, y, 0.5 * t], [x, y, 1.5 * t], 0.05);
        s.rod([x, y, 1.45 * t], [x, y, 1.7 * t], 0.1);
    };
    stick(s, -0.55 * w, 0.3 * d);
    stick(s, 0.3 * w, -0.35 * d);
    s.cuboid([-0.3 * w, -0.35 * d, t], [0.24, 0.08, 0.12]);
    s.cuboid([-0.3 * w, -0.35 * d, t], [0.08, 0.24, 0.12]);
    for (x, y) in [(0.0, 0.1), (0.0, -0.1), (0.1, 0.0), (-0.1, 0.0)] {
        s.rod([0.55 * w + x, 0.3 * d + y, 0.5 * t], [0.55 * w + x, 0.3 * d + y, 1.25 * t], 0.045);
    }
    if s.chance(0.4) {
        s.tube(&[[0.0, 0.9 * d, 0.0], [0.1, d + 0.3, 0.0], [-0.2, d + 0.6, 0.0]], 0.03);
    }
}

pub(super) fn range_hood(s: &mut Sketch) {
    let (w, d, h) = (s.between(0.9, 1.5), s.between(0.6, 0.9), s.between(0.3, 0.7));
    let (flue, tall) = (s.between(0.25, 0.4), s.between(0.5, 1.2));
    s.cuboid([0.0, 0.0, 0.06], [w, d, 0.12]);
    if s.chance(0.6) {
        s.wedge([0.0, 0.0, 0.1], [w, d, h], [flue / w, flue / d], [0.0, 0.5 * (d - flue)]);
    } else {
        let mut outline: Vec<[f64; 2]> =
            arc([0.0, 0.0, 0.1], [0.5 * w, 0.0, 0.0], [0.0, 0.0, h], 0.0, 180.0, 12)
                .iter()
                .map(|p| [p[0], p[2]])
                .collect();
        outline.push([-0.5 * w, 0.1]);
        s.panel(&outline, 0.15 * d, 0.6 * d);
    }
    let y = 0.5 * (d - flue);
    if s.chance(0.5) {
        s.cuboid([0.0, y, h + 0.5 * tall], [flue, flue, tall + 0.2]);
    } else {
        s.rod([0.0, y, h - 0.1], [0.0, y, h + tall], 0.48 * flue);
        let bend = 0.4 * s.side();
        s.rod([0.0, y, h + tall - 0.1], [bend, y, h + tall + 0.2], 0.48 * flue);
    }
    let x = s.between(-0.3, 0.3) * w;
    for i in 0..s.count(2, 4) {
        s.rod([x + 0.09 * i as f64, -0.45 * d, 0.06], [x + 0.09 * i as f64, -0.5 * d - 0.05, 0.06], 0.03);
    }
    s.cuboid([0.0, -0.1 * d, -0.02], [0.7 * w, 0.6 * d, 0.06]);
}

pub(super) fn keyboard(s: &mut Sketch) {
    let (w, d, slope) = (s.between(1.6, 2.2), s.between(0.5, 0.8), s.between(0.02, 0.12));
    s.panel_along_x(&[[-0.5 * d, 0.0], [0.5 * d, 0.0], [0.5 * d, 0.1 + slope], [-0.5 * d, 0.06]], w);
    let (rows, columns) = (s.count(4, 6), s.count(8, 14));
    let pad = s.chance(0.6);
    let reach = if pad { 0.74 } else { 0.96 } * w;
    for row in 0..rows {
        let y = d * ((row as f64 + 0.5) / rows as f64 - 0.5) * 0.9;
        let z = 0.08 + (0.04 + slope) * (y / d + 0.5);
        let mut x = -0.48 * w;
        while x < -0.48 * w + reach - 0.02 {
            let size = reach / columns as f64 * if s.chance(0.15) { 1.8 } else { 1.0 };
            let size = size.min(-0.48 * w + reach - x);
            s.cuboid([x + 0.5 * size, y, z], [0.85 * size, 0.75 * d / rows as f64, 0.1]);
            x += size;
        }
        if pad {
            s.cuboid([0.39 * w, y, z], [0.16 * w, 0.7 * d / rows as f64, 0.1]);
        }
    }
    let x = s.between(-0.3, 0.3) * w;
    s.tube(&[[x, 0.48 * d, 0.06], [x + 0.1, 0.5 * d + 0.25, 0.04], [x + 0.4, 0.5 * d + 0.4, 0.03]], 0.025);
}

impl Sketch {
    /// A polygon in the yz plane, extruded along x by `width`, half of it to each side of the origin.
    fn panel_along_x(&mut self, polygon: &[[f64; 2]], width: f64) {
        self.at([0.0; 3], [0.0, 0.0, 90.0], |s| s.panel(polygon, 0.0, width));
    }
}
