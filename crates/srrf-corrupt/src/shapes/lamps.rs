//! Lamps with arms. None is symmetric about its axis.

use super::sketch::{Sketch, arc};

/// An open shade below `top`, wider at its mouth.
fn shade(s: &mut Sketch, top: [f64; 3], tilt_deg: f64, size: f64) {
    let (mouth, neck, height) = (size, size * s.between(0.25, 0.8), size * s.between(0.7, 1.5));
    let bell = s.chance(0.4);
    s.at(top, [0.0, tilt_deg, 0.0], |s| {
        if bell {
            let profile = [
                [0.0, 0.0],
                [0.5 * neck, -0.02],
                [neck, -0.2 * height],
                [0.8 * mouth, -0.6 * height],
                [mouth, -height],
            ];
            s.lathe([0.0; 3], &profile, [1.0, 1.0]);
        } else {
            s.lathe([0.0; 3], &[[neck, 0.0], [mouth, -height]], [1.0, 1.0]);
        }
        s.ball([0.0, 0.0, -0.5 * height], [0.3 * size, 0.3 * size, 0.4 * size]);
        s.rod([0.0, 0.0, 0.05 * height], [0.0, 0.0, -0.3 * height], 0.12 * size);
    });
}

fn foot(s: &mut Sketch, size: f64) {
    match s.count(0, 2) {
        0 => s.cone([0.0; 3], [0.0, 0.0, 0.2 * size], size, 0.7 * size),
        1 => s.wedge([0.0; 3], [2.0 * size, 1.5 * size, 0.2 * size], [0.9, 0.9], [0.0, 0.0]),
        _ => {
            for i in 0..3 {
                s.at([0.0; 3], [0.0, 0.0, 120.0 * i as f64], |s| {
                    s.beam(
                        [0.0, 0.0, 0.4 * size],
                        [1.2 * size, 0.0, 0.05 * size],
                        [0.12 * size, 0.12 * size],
                    );
                });
            }
        }
    }
}

pub(super) fn desk_lamp(s: &mut Sketch) {
    let size = s.between(0.2, 0.35);
    foot(s, size);
    let (lower, upper) = (s.between(0.5, 0.9), s.between(0.4, 0.8));
    let (a, b) = (s.between(-30.0f64, 30.0).to_radians(), s.between(40.0f64, 110.0).to_radians());
    let elbow = [-lower * a.sin(), 0.0, 0.1 + lower * a.cos()];
    let head = [elbow[0] + upper * b.sin(), s.between(-0.1, 0.1), elbow[2] + upper * b.cos()];
    if s.chance(0.5) {
        for y in [-0.05, 0.05] {
            s.rod([0.0, y, 0.1], [elbow[0], y, elbow[2]], 0.02);
            s.rod([elbow[0], y, elbow[2]], head, 0.02);
        }
    } else {
        s.tube(&[[0.0, 0.0, 0.1], elbow, head], 0.03);
    }
    s.ball(elbow, [0.07, 0.09, 0.07]);
    let (tilt, shade_size) = (s.between(-50.0, 30.0), s.between(0.15, 0.32));
    shade(s, head, tilt, shade_size);
}

pub(super) fn floor_lamp(s: &mut Sketch) {
    let size = s.between(0.2, 0.4);
    foot(s, size);
    let height = s.between(1.2, 2.2);
    let shade_size = s.between(0.2, 0.45);
    s.rod([0.0, 0.0, 0.05], [0.0, 0.0, height], 0.03);
    match s.count(0, 2) {
        0 => {
            // A bow to one side.
            let reach = s.between(0.4, 1.0);
            let path = arc(
                [0.5 * reach, 0.0, height],
                [-0.5 * reach, 0.0, 0.0],
                [0.0, 0.0, 0.5 * reach],
                0.0,
                160.0,
                12,
            );
            s.tube(&path, 0.03);
            shade(s, path[12], 0.0, shade_size);
        }
        1 => {
            // Branches at different heights.
            for _ in 0..s.count(2, 4) {
                let (turn, reach) = (s.between(0.0, 360.0), s.between(0.25, 0.6));
                let (z, rise) = (height * s.between(0.55, 1.0), s.between(-0.1, 0.35));
                let each = shade_size * s.between(0.4, 0.7);
                s.at([0.0; 3], [0.0, 0.0, turn], |s| {
                    s.tube(&[[0.0, 0.0, z], [reach, 0.0, z + rise]], 0.025);
                    shade(s, [reach, 0.0, z + rise], -20.0, each);
                });
            }
        }
        _ => {
            shade(s, [0.0, 0.0, height + 0.1], 0.0, shade_size);
            // A reading arm and a small table.
            let z = height * s.between(0.5, 0.75);
            s.tube(&[[0.0, 0.0, z], [0.35, 0.0, z + 0.15], [0.5, 0.1, z]], 0.02);
            shade(s, [0.5, 0.1, z], 20.0, 0.12);
            if s.chance(0.5) {
                s.cone([-0.1, 0.0, 0.35 * height], [-0.1, 0.0, 0.35 * height + 0.04], 0.3, 0.3);
            }
        }
    }
}
