//! Tables, beds and storage. The front is towards -y.

use super::seating::legs;
use super::sketch::Sketch;

/// A small thing standing at a place: a book, a mug, a ball or a frame.
fn trinket(s: &mut Sketch, [x, y, z]: [f64; 3], size: f64) {
    let turn = s.between(0.0, 360.0);
    let kind = s.count(0, 3);
    s.at([x, y, z], [0.0, 0.0, turn], |s| match kind {
        0 => s.cuboid([0.0, 0.0, 0.2 * size], [size, 0.7 * size, 0.42 * size]),
        1 => {
            s.rod([0.0, 0.0, -0.01], [0.0, 0.0, size], 0.35 * size);
            s.ring([0.4 * size, 0.0, 0.5 * size], [0.0, 1.0, 0.0], 0.25 * size, 0.07 * size);
        }
        2 => s.ball([0.0, 0.0, 0.45 * size], [0.5 * size, 0.5 * size, 0.47 * size]),
        _ => s.wedge([0.0, 0.0, -0.01], [0.8 * size, 0.1 * size, 1.2 * size], [1.0, 1.0], [0.0, 0.35 * size]),
    });
}

/// A box with fronts of drawers or doors, each with a handle.
fn chest(s: &mut Sketch, [x, y, z]: [f64; 3], size: [f64; 3], rows: usize, columns: usize) {
    s.cuboid([x, y, z + 0.5 * size[2]], size);
    let [w, d, h] = size;
    let (cell_w, cell_h) = (w / columns as f64, h / rows as f64);
    let proud = 0.03 * d.max(0.4);
    let knob = s.chance(0.5);
    for row in 0..rows {
        for column in 0..columns {
            let cx = x - 0.5 * w + (column as f64 + 0.5) * cell_w;
            let cz = z + (row as f64 + 0.5) * cell_h;
            let front = y - 0.5 * d - proud;
            s.cuboid([cx, front + 0.4 * proud, cz], [0.9 * cell_w, 1.5 * proud, 0.86 * cell_h]);
            if knob {
                s.ball([cx, front - proud, cz], [0.035, 0.045, 0.035]);
            } else {
                s.rod([cx - 0.2 * cell_w, front - proud, cz], [cx + 0.2 * cell_w, front - proud, cz], 0.02);
            }
        }
    }
}

pub(super) fn table(s: &mut Sketch) {
    let half = [s.between(0.6, 1.3), s.between(0.4, 0.7)];
    let (height, thickness, top) = (s.between(0.4, 1.0), s.between(0.05, 0.14), s.between(0.04, 0.12));
    match s.count(0, 3) {
        0 | 1 => legs(s, half, height, thickness),
        2 => {
            // A column on crossed feet.
            s.rod([0.0, 0.0, 0.02], [0.0, 0.0, height], 0.8 * thickness);
            s.beam([-0.7 * half[0], 0.0, 0.05], [0.7 * half[0], 0.0, 0.05], [thickness, 0.08]);
            s.beam([0.0, -0.8 * half[1], 0.05], [0.0, 0.8 * half[1], 0.05], [thickness, 0.08]);
        }
        _ => {
            // Two trestles and a beam.
            for x in [-0.7, 0.7] {
                for y in [-1.0, 1.0] {
                    let foot = [x * half[0], 0.9 * y * half[1], 0.0];
                    s.beam(foot, [x * half[0], 0.3 * y * half[1], height], [thickness, thickness]);
                }
            }
            s.beam(
                [-0.7 * half[0], 0.0, 0.5 * height],
                [0.7 * half[0], 0.0, 0.5 * height],
                [thickness, thickness],
            );
        }
    }
    if s.chance(0.25) {
        s.lathe([0.0, 0.0, height - 0.01], &[[0.0, 0.0], [1.0, 0.0], [1.0, top], [0.0, top]], half);
    } else {
        s.cuboid([0.0, 0.0, height + 0.5 * top - 0.01], [2.0 * half[0], 2.0 * half[1], top]);
    }
    if s.chance(0.5) {
        let x = s.between(-0.4, 0.4) * half[0];
        chest(s, [x, -0.5 * half[1], height - 0.2], [0.7 * half[0], 0.9 * half[1], 0.21], 1, 1);
    }
    for _ in 0..s.count(1, 3) {
        let at = [s.between(-0.7, 0.7) * half[0], s.between(-0.6, 0.6) * half[1], height + top - 0.02];
        let size = s.between(0.2, 0.45);
        trinket(s, at, size);
    }
}

pub(super) fn desk(s: &mut Sketch) {
    let (width, depth, height) = (s.between(1.2, 2.2), s.between(0.6, 0.9), s.between(0.65, 0.85));
    let top = s.between(0.04, 0.08);
    s.cuboid([0.0, 0.0, height], [width, depth, top]);
    let (side, pedestal) = (s.side(), s.between(0.25, 0.4) * width);
    let rows = s.count(2, 4);
    let clear = if s.chance(0.5) { 0.0 } else { s.between(0.0, 0.3) };
    chest(
        s,
        [side * 0.5 * (width - pedestal), 0.0, clear],
        [0.98 * pedestal, 0.95 * depth, height - clear],
        rows,
        1,
    );
    if s.chance(0.35) {
        chest(s, [-side * 0.5 * (width - pedestal), 0.0, 0.0], [0.98 * pedestal, 0.95 * depth, height], 1, 1);
    } else {
        for y in [-0.45, 0.45] {
            s.beam(
                [-side * 0.47 * width, y * depth, 0.0],
                [-side * 0.47 * width, y * depth, height],
                [0.06, 0.06],
            );
        }
    }
    if s.chance(0.6) {
        s.cuboid([0.0, 0.46 * depth, 0.65 * height], [0.98 * width, 0.03, 0.6 * height]);
    }
    if s.chance(0.4) {
        // A hutch with shelves.
        let up = s.between(0.4, 0.8);
        for x in [-0.48, 0.0, 0.48] {
            s.cuboid([x * width, 0.36 * depth, height + 0.5 * up], [0.03, 0.25 * depth, up]);
        }
        s.cuboid([0.0, 0.36 * depth, height + up], [width, 0.25 * depth, 0.04]);
    } else if s.chance(0.5) {
        // A screen on a foot.
        let x = s.between(-0.25, 0.25) * width;
        s.rod([x, 0.2 * depth, height], [x, 0.2 * depth, height + 0.2], 0.03);
        s.cuboid([x, 0.18 * depth, height + 0.35], [0.55, 0.05, 0.35]);
    }
    if s.chance(0.5) {
        let at = [s.between(-0.4, 0.4) * width, -0.2 * depth, height + 0.4 * top];
        trinket(s, at, 0.2);
    }
}

pub(super) fn bed(s: &mut Sketch) {
    let (width, length) = (s.between(0.9, 2.0), s.between(1.8, 2.3));
    let (base, mattress) = (s.between(0.15, 0.4), s.between(0.12, 0.35));
    s.cuboid([0.0, 0.0, 0.6 * base], [width, length, 0.8 * base]);
    s.wedge([0.0, 0.0, base - 0.02], [0.96 * width, 0.96 * length, mattress], [0.97, 0.98], [0.0, 0.0]);
    for x in [-0.46, 0.46] {
        for y in [-0.48, 0.48] {
            s.cuboid([x * width, y * length, 0.3 * base], [0.08, 0.08, 0.6 * base]);
        }
    }
    let head = s.between(0.3, 1.0);
    let y = 0.5 * length + 0.04;
    if s.chance(0.6) {
        s.wedge(
            [0.0, y, 0.0],
            [1.04 * width, 0.1, base + mattress + head],
            [crown_share(head), 1.0],
            [0.0, 0.1],
        );
    } else {
        for i in 0..=6 {
            let x = (i as f64 / 6.0 - 0.5) * width;
            s.rod([x, y, 0.0], [x, y, base + mattress + head], 0.03);
        }
        s.rod([-0.5 * width, y, base + mattress + head], [0.5 * width, y, base + mattress + head], 0.04);
    }
    if s.chance(0.5) {
        s.cuboid(
            [0.0, -y, 0.5 * (base + mattress + 0.3 * head)],
            [1.02 * width, 0.08, base + mattress + 0.3 * head],
        );
    }
    let pillows = if width > 1.3 { 2 } else { 1 };
    for i in 0..pillows {
        let x = (i as f64 - 0.5 * (pillows - 1) as f64) * 0.46 * width;
        s.ball([x, 0.38 * length, base + mattress + 0.04], [0.2 * width, 0.17, 0.09]);
    }
    if s.chance(0.5) {
        let x = s.side() * (0.5 * width + 0.3);
        chest(s, [x, 0.4 * length, 0.0], [0.45, 0.4, base + mattress], 2, 1);
    }
    if s.chance(0.4) {
        s.cuboid([0.0, -0.25 * length, base + mattress - 0.02], [1.03 * width, 0.4 * length, 0.08]); // a blanket
    }
}

/// How much a headboard narrows: tall ones more.
fn crown_share(head: f64) -> f64 {
    1.0 - 0.3 * head
}

pub(super) fn bookshelf(s: &mut Sketch) {
    let (width, depth, height) = (s.between(0.7, 1.8), s.between(0.25, 0.45), s.between(1.0, 2.2));
    let (board, shelves) = (s.between(0.03, 0.06), s.count(2, 6));
    for x in [-0.5, 0.5] {
        s.cuboid([x * (width - board), 0.0, 0.5 * height], [board, depth, height]);
    }
    if s.chance(0.7) {
        s.cuboid([0.0, 0.5 * depth - 0.01, 0.5 * height], [width, 0.02, height]);
    }
    let pitch = (height - board) / shelves as f64;
    for i in 0..=shelves {
        s.cuboid([0.0, 0.0, 0.5 * board + i as f64 * pitch], [width - board, depth, board]);
    }
    for i in 0..shelves {
        let floor = i as f64 * pitch + board - 0.005;
        if s.chance(0.25) {
            let x = s.between(-0.3, 0.3) * width;
            trinket(s, [x, 0.0, floor], 0.5 * pitch.min(depth));
            continue;
        }
        // A row of books that fills a part of the shelf.
        let mut x = -0.5 * width + board + s.between(0.0, 0.3) * width;
        let end = 0.5 * width - board - s.between(0.0, 0.4) * width;
        while x < end {
            let book = [s.between(0.03, 0.09), s.between(0.5, 0.85) * depth, s.between(0.5, 0.85) * pitch];
            s.cuboid([x + 0.5 * book[0], 0.5 * (depth - book[1]) - 0.02, floor + 0.5 * book[2]], book);
            x += book[0] + 0.004;
        }
    }
}

pub(super) fn cabinet(s: &mut Sketch) {
    let (width, depth, height) = (s.between(0.5, 1.8), s.between(0.4, 0.65), s.between(0.5, 2.0));
    let foot = s.between(0.04, 0.25);
    legs(s, [0.5 * width, 0.5 * depth], foot + 0.03, 0.07);
    let (rows, columns) =
        if height > 1.3 { (s.count(1, 2), s.count(1, 3)) } else { (s.count(1, 4), s.count(1, 2)) };
    chest(s, [0.0, 0.0, foot], [width, depth, height], rows, columns);
    s.cuboid([0.0, 0.0, foot + height], [1.06 * width, 1.06 * depth, 0.05]);
    if s.chance(0.65) {
        let drawer = s.between(0.3, 0.7) * depth;
        let x = s.side() * 0.25 * width;
        let z = foot + height * s.between(0.3, 0.8);
        s.cuboid([x, -0.5 * (depth + drawer), z], [0.42 * width, drawer + 0.02, 0.12]); // an open drawer
    }
    for _ in 0..s.count(1, 3) {
        let at = [s.between(-0.4, 0.4) * width, s.between(-0.2, 0.2) * depth, foot + height + 0.02];
        let size = s.between(0.15, 0.3);
        trinket(s, at, size);
    }
    if s.chance(0.25) {
        // A mirror.
        s.lathe(
            [0.0, 0.4 * depth, foot + height + 0.35],
            &[[0.0, -0.35], [0.9, -0.2], [1.0, 0.0], [0.9, 0.25], [0.0, 0.4]],
            [0.35 * width, 0.03],
        );
    }
}
