//! Plants.

use super::sketch::Sketch;

pub(super) fn plant(s: &mut Sketch) {
    let (h, r) = (s.between(0.4, 0.8), s.between(0.25, 0.45));
    let rim = r * s.between(1.0, 1.4);
    s.lathe(
        [0.0; 3],
        &[[0.0, 0.0], [r, 0.0], [rim, h], [0.85 * rim, h], [0.85 * rim, 0.85 * h], [0.0, 0.88 * h]],
        [1.0, 1.0],
    );
    let broad = s.chance(0.5);
    for _ in 0..s.count(5, 14) {
        let (turn, lean, reach) = (s.between(0.0, 360.0), s.between(5.0, 70.0), s.between(0.6, 1.5));
        let wide = if broad { s.between(0.12, 0.3) } else { s.between(0.04, 0.1) };
        s.at([0.0, 0.0, 0.8 * h], [0.0, 0.0, turn], |s| {
            let out = lean.to_radians();
            let middle = [0.55 * reach * out.sin(), 0.0, 0.6 * reach * out.cos()];
            s.tube(&[[0.0; 3], middle], 0.02);
            s.at(middle, [0.0, lean + 15.0, 0.0], |s| {
                s.panel(&[[0.0, 0.0], [0.0, 0.01], [0.02, 0.5 * reach], [0.02, 0.49 * reach]], 0.0, 0.02);
                s.ball([0.0, 0.0, 0.25 * reach], [0.02, wide, 0.3 * reach]);
            });
        });
    }
    if s.chance(0.3) {
        for _ in 0..s.count(1, 3) {
            let (x, y, z) = (s.between(-0.3, 0.3), s.between(-0.3, 0.3), s.between(1.0, 1.6));
            s.tube(&[[0.0, 0.0, 0.8 * h], [x, y, h + 0.8 * z]], 0.02);
            s.ball([x, y, h + 0.8 * z], [0.1, 0.1, 0.1]); // a flower
        }
    }
}

pub(super) fn tree(s: &mut Sketch) {
    let (height, r) = (s.between(1.2, 2.4), s.between(0.07, 0.16));
    let lean = [s.between(-0.2, 0.2), s.between(-0.2, 0.2)];
    let at = |up: f64| [lean[0] * up * up, lean[1] * up * up, height * up];
    s.tapered_tube(&[at(0.0), at(0.35), at(0.7), at(1.0)], &[1.5 * r, r, 0.7 * r, 0.3 * r]);
    let leafy = s.chance(0.7);
    for _ in 0..s.count(3, 8) {
        let (up, turn, reach) =
            (s.between(0.4, 1.0), s.between(0.0, std::f64::consts::TAU), s.between(0.3, 0.9));
        let root = at(up);
        let rise = s.between(0.1, 0.6) * reach;
        let tip = [root[0] + reach * turn.cos(), root[1] + reach * turn.sin(), root[2] + rise];
        s.tapered_tube(&[root, tip], &[0.5 * r, 0.2 * r]);
        if leafy {
            let size = s.between(0.2, 0.5);
            s.ball(tip, [size, size * flatness(up), 0.8 * size]);
        } else {
            let (dx, dy) = (s.between(-0.3, 0.3), s.between(-0.3, 0.3));
            s.tapered_tube(&[tip, [tip[0] + dx, tip[1] + dy, tip[2] + 0.3]], &[0.2 * r, 0.1 * r]);
        }
    }
}

fn flatness(up: f64) -> f64 {
    0.7 + 0.3 * up
}
