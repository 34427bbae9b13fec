//! Buildings and their parts. The front is towards -y.

use super::sketch::{Sketch, arc};

/// A saddle roof over a rectangle around the origin, its ridge along y.
fn roof(s: &mut Sketch, width: f64, depth: f64, z: f64, rise: f64) {
    let half = 0.55 * width;
    s.panel(&[[-half, z], [half, z], [0.0, z + rise]], 0.0, 1.1 * depth);
}

pub(super) fn house(s: &mut Sketch) {
    let (w, d, h) = (s.between(1.0, 2.0), s.between(1.0, 2.2), s.between(0.7, 1.5));
    s.cuboid([0.0, 0.0, 0.5 * h], [w, d, h]);
    let rise = s.between(0.2, 0.9);
    match s.count(0, 2) {
        0 => roof(s, w, d, h - 0.02, rise),
        1 => s.wedge([0.0, 0.0, h - 0.02], [1.1 * w, 1.1 * d, rise], [0.1, 0.4], [0.0, 0.0]),
        _ => s.panel(&[[-0.55 * w, h - 0.02], [0.55 * w, h - 0.02], [0.55 * w, h + rise]], 0.0, 1.1 * d),
    }
    let (x, y) = (s.between(-0.3, 0.3) * w, s.between(-0.3, 0.3) * d);
    s.cuboid([x, y, h + 0.6 * rise], [0.18, 0.18, 0.9 * rise + 0.5]); // the chimney
    let door = s.between(-0.3, 0.3) * w;
    s.cuboid([door, -0.5 * d, 0.25], [0.25, 0.08, 0.5]);
    if s.chance(0.5) {
        s.wedge([door, -0.5 * d - 0.2, 0.55], [0.5, 0.5, 0.06], [1.0, 1.0], [0.0, 0.0]);
        for i in [-1.0, 1.0] {
            s.rod([door + 0.2 * i, -0.5 * d - 0.4, 0.0], [door + 0.2 * i, -0.5 * d - 0.4, 0.56], 0.03);
        }
    }
    if s.chance(0.7) {
        // A wing or a garage.
        let (side, lw, ld, lh) =
            (s.side(), s.between(0.5, 1.0), s.between(0.5, 0.9) * d, s.between(0.4, 0.8) * h);
        let y = s.between(-0.5, 0.5) * (d - ld);
        s.cuboid([side * 0.5 * (w + lw), y, 0.5 * lh], [lw + 0.02, ld, lh]);
        let rise = s.between(0.05, 0.4);
        s.wedge([side * 0.5 * (w + lw), y, lh - 0.01], [1.05 * lw, 1.05 * ld, rise], [0.9, 0.1], [0.0, 0.0]);
    }
    for _ in 0..s.count(1, 4) {
        let (at, z) = (s.between(-0.4, 0.4) * w, s.between(0.4, 0.8) * h);
        let y = s.side() * 0.5 * d;
        s.cuboid([at, y, z], [0.22, 0.06, 0.25]);
    }
}

pub(super) fn church(s: &mut Sketch) {
    let (w, d, h) = (s.between(0.7, 1.1), s.between(1.6, 2.6), s.between(0.7, 1.2));
    s.cuboid([0.0, 0.0, 0.5 * h], [w, d, h]);
    let rise = s.between(0.4, 0.9);
    roof(s, w, d, h - 0.02, rise);
    let (tw, th) = (s.between(0.4, 0.7), s.between(1.4, 2.6));
    let x = if s.chance(0.5) { 0.0 } else { s.side() * 0.5 * w };
    let y = -0.5 * d - 0.3 * tw;
    s.cuboid([x, y, 0.5 * th], [tw, tw, th]);
    let spire = s.between(0.4, 1.6);
    if s.chance(0.5) {
        s.wedge([x, y, th - 0.02], [1.1 * tw, 1.1 * tw, spire], [0.02, 0.02], [0.0, 0.0]);
    } else {
        s.cone([x, y, th - 0.02], [x, y, th + spire], 0.55 * tw, 0.01);
    }
    if s.chance(0.5) {
        let y = s.between(0.0, 0.3) * d;
        let (reach, lh) = (s.between(1.4, 2.2) * w, 0.8 * h);
        s.cuboid([0.0, y, 0.5 * lh], [reach, 0.6 * w, lh]); // the transept
        s.at([0.0, y, 0.0], [0.0, 0.0, 90.0], |s| roof(s, 0.6 * w, reach, lh - 0.02, 0.6 * rise));
    }
    if s.chance(0.6) {
        s.cone([0.0, 0.5 * d, 0.0], [0.0, 0.5 * d, 0.8 * h], 0.4 * w, 0.4 * w); // the apse
        s.ball([0.0, 0.5 * d, 0.8 * h], [0.4 * w, 0.4 * w, 0.3 * w]);
    }
    let buttresses = s.count(0, 4);
    for i in 0..buttresses {
        let y = d * ((i as f64 + 0.5) / buttresses as f64 - 0.5);
        for x in [-1.0, 1.0] {
            s.wedge([x * 0.52 * w, y, 0.0], [0.3 * w, 0.1, 0.8 * h], [0.3, 1.0], [-x * 0.08 * w, 0.0]);
        }
    }
}

pub(super) fn castle(s: &mut Sketch) {
    let (w, d, h) = (s.between(1.2, 2.0), s.between(1.0, 2.0), s.between(0.4, 0.8));
    for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
        if s.chance(0.12) {
            continue;
        }
        let (r, tall) = (s.between(0.15, 0.28), h * s.between(1.1, 2.2));
        let at = |z: f64| [x * w, y * d, z];
        s.rod(at(0.0), at(tall), r);
        if s.chance(0.5) {
            let tip = s.between(0.3, 0.8);
            s.cone(at(tall - 0.02), at(tall + tip), 1.2 * r, 0.01);
        } else {
            s.rod(at(tall - 0.1), at(tall + 0.05), 1.2 * r);
        }
    }
    for side in [-0.5, 0.5] {
        s.cuboid([0.0, side * d, 0.5 * h], [w, 0.12, h]);
        s.cuboid([side * w, 0.0, 0.5 * h], [0.12, d, h]);
        let merlons = s.count(3, 7);
        for i in 0..merlons {
            let x = w * ((i as f64 + 0.5) / merlons as f64 - 0.5);
            s.cuboid([x, side * d, h + 0.05], [0.45 * w / merlons as f64, 0.12, 0.14]);
        }
    }
    let (kx, ky) = (s.between(-0.25, 0.25) * w, s.between(-0.1, 0.3) * d);
    let (kw, kh) = (s.between(0.35, 0.6), s.between(0.9, 1.8));
    s.cuboid([kx, ky, 0.5 * kh], [kw, 0.8 * kw, kh]);
    s.wedge([kx, ky, kh - 0.02], [1.1 * kw, 0.9 * kw, 0.3], [0.1, 0.1], [0.0, 0.0]);
    let gate = s.between(-0.2, 0.2) * w;
    s.cuboid([gate, -0.5 * d - 0.1, 0.45 * h], [0.35, 0.3, 0.9 * h]);
}

pub(super) fn stairs(s: &mut Sketch) {
    let (steps, width) = (s.count(5, 13), s.between(0.6, 1.6));
    let (run, rise) = (s.between(0.18, 0.3), s.between(0.12, 0.22));
    let (n, open) = (steps as f64, s.chance(0.4));
    if s.chance(0.3) {
        // A winding stair.
        let (turn, r) = (s.between(18.0, 32.0) * s.side(), s.between(0.7, 1.1));
        s.rod([0.0; 3], [0.0, 0.0, n * rise + 0.8], 0.09);
        for i in 0..steps {
            s.at([0.0, 0.0, (i as f64 + 1.0) * rise], [0.0, 0.0, turn * i as f64], |s| {
                s.slab(&[[0.0, -0.05], [r, -0.25 * r], [r, 0.25 * r], [0.0, 0.05]], -0.03, 0.06);
                s.rod([0.95 * r, 0.0, 0.0], [0.95 * r, 0.0, 0.8], 0.02);
            });
        }
        let rail: Vec<[f64; 3]> = (0..steps)
            .map(|i| {
                let (sin, cos) = (turn * i as f64).to_radians().sin_cos();
                [0.95 * r * cos, 0.95 * r * sin, (i as f64 + 1.0) * rise + 0.8]
            })
            .collect();
        s.tube(&rail, 0.03);
        return;
    }
    if open {
        for i in 0..steps {
            s.cuboid([0.0, run * (i as f64 + 0.5), rise * (i as f64 + 1.0)], [width, 1.1 * run, 0.05]);
        }
        for x in [-0.48, 0.48] {
            s.beam([x * width, 0.0, 0.0], [x * width, n * run, n * rise], [0.06, 0.16]);
        }
    } else {
        for i in 0..steps {
            let (y, top) = (run * i as f64, rise * (i as f64 + 1.0));
            s.cuboid([0.0, 0.5 * (y + n * run), 0.5 * top], [width, n * run - y, top]);
        }
    }
    let landing = s.between(0.3, 1.0);
    s.cuboid([0.0, n * run + 0.5 * landing, 0.5 * n * rise], [width, landing + 0.04, n * rise]);
    let sides: &[f64] = if s.chance(0.5) { &[-0.46, 0.46] } else { &[0.46] };
    for &x in sides {
        let up = s.between(0.6, 0.9);
        s.tube(
            &[
                [x * width, 0.0, up + rise],
                [x * width, n * run, up + n * rise],
                [x * width, n * run + landing, up + n * rise],
            ],
            0.04,
        );
        for i in (0..steps).step_by(2) {
            let (y, z) = (run * (i as f64 + 0.5), rise * (i as f64 + 1.0));
            s.rod([x * width, y, z - 0.02], [x * width, y, z + up], 0.02);
        }
    }
    if s.chance(0.3) {
        // A second flight to one side.
        let side = s.side();
        for i in 0..steps / 2 {
            let x = side * (0.5 * width + run * (i as f64 + 0.5));
            let top = n * rise + rise * (i as f64 + 1.0);
            s.cuboid([x, n * run + 0.5 * landing, 0.5 * top], [run, landing, top]);
        }
    }
}

pub(super) fn fireplace(s: &mut Sketch) {
    let (w, h, d) = (s.between(1.2, 2.2), s.between(0.9, 1.4), s.between(0.25, 0.5));
    let post = s.between(0.15, 0.35);
    for x in [-0.5, 0.5] {
        s.cuboid([x * (w - post), 0.0, 0.5 * h], [post, d, h]);
        s.cuboid([x * (w - post), -0.05, 0.06], [1.2 * post, 1.1 * d, 0.12]);
    }
    let beam = s.between(0.15, 0.4) * h;
    if s.chance(0.5) {
        s.cuboid([0.0, 0.0, h - 0.5 * beam], [w, 0.96 * d, beam]);
    } else {
        let inner = 0.5 * w - post + 0.02;
        let mut outline = vec![[-inner, h], [-inner, h - beam]];
        outline.extend(
            arc([0.0, 0.0, h - beam], [inner, 0.0, 0.0], [0.0, 0.0, 0.7 * beam], 175.0, 5.0, 10)
                .iter()
                .map(|p| [p[0], p[2]]),
        );
        outline.extend([[inner, h - beam], [inner, h]]);
        s.panel(&outline, 0.0, 0.96 * d);
    }
    let over = s.between(1.05, 1.3);
    s.cuboid([0.0, -0.04, h + 0.04], [over * w, over * d, 0.1]);
    if s.chance(0.6) {
        s.cuboid([0.0, 0.45 * d, 0.5 * h], [w - post, 0.05, h]);
    }
    if s.chance(0.4) {
        s.wedge([0.0, 0.1 * d, h + 0.08], [0.8 * w, 0.7 * d, 1.0], [0.5, 0.8], [0.0, 0.05]); // the breast
    } else {
        let x = s.between(0.1, 0.4) * w * s.side();
        s.wedge([x, 0.0, h + 0.08], [0.25, 0.12, 0.4], [0.9, 0.7], [0.0, 0.0]); // a clock
    }
    if s.chance(0.4) {
        s.cuboid([0.0, -0.9 * d, 0.03], [1.1 * w, 0.9 * d, 0.06]);
    }
}

pub(super) fn ridge_tent(s: &mut Sketch) {
    let (w, d, h) = (s.between(1.0, 1.6), s.between(1.4, 2.6), s.between(0.8, 1.2));
    let lean = s.between(-0.2, 0.3);
    s.wedge([0.0; 3], [w, d, h], [0.03, ridge_share(lean)], [0.0, 0.0]);
    // The porch at one end, a flap, and pegs on ropes.
    let porch = s.between(0.3, 0.7);
    s.panel(&[[-0.4 * w, 0.0], [0.4 * w, 0.0], [0.0, 0.85 * h]], -0.5 * d - 0.5 * porch + 0.1, porch + 0.2);
    let side = s.side();
    s.beam(
        [side * 0.3 * w, -0.5 * d - porch, 0.02],
        [side * 0.55 * w, -0.5 * d - porch - 0.3, 0.35 * h],
        [0.3, 0.03],
    );
    s.rod([0.0, -0.5 * d - porch, 0.0], [0.0, -0.5 * d - porch, h], 0.03);
    for i in 0..s.count(2, 4) {
        let y = d * (0.3 * i as f64 - 0.4);
        let x = side * (0.5 * w + 0.3);
        s.rod([0.2 * side * w, y, 0.6 * h], [x, y, 0.0], 0.015);
    }
}

fn ridge_share(lean: f64) -> f64 {
    0.9 - lean.abs()
}
