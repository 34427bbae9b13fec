//! Text flavours.

use super::Sample;

fn rows(points: &[[f64; 3]], row: impl Fn(usize, [String; 3]) -> String) -> Vec<u8> {
    points
        .iter()
        .enumerate()
        .map(|(i, p)| row(i, p.map(|c| format!("{c:?}"))))
        .collect::<String>()
        .into_bytes()
}

pub fn samples(points: &[[f64; 3]]) -> Vec<Sample> {
    let n = points.len();
    let mut all = Vec::new();
    let mut add = |format, name: &str, header: String, body: Vec<u8>| {
        all.push(Sample::new(format, name, header.as_bytes(), &body, points));
    };
    let ply = format!(
        "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex {n}\nproperty double z\nproperty uchar red\n\
         property double x\nproperty list uchar int n\nproperty double y\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n"
    );
    let mut body = rows(points, |i, [x, y, z]| format!("{z} {} {x} 2 7 8 {y}\n", i % 256));
    body.extend(b"3 0 0 0\n");
    add("ply", "ply-ascii", ply, body);
    let pcd = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS rgb z x y\nSIZE 4 8 8 8\nTYPE U F F F\n\
         COUNT 1 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA ascii\n"
    );
    add("pcd", "pcd-ascii", pcd, rows(points, |i, [x, y, z]| format!("{i} {z} {x} {y}\n")));
    add("xyz", "xyz", String::new(), rows(points, |_, [x, y, z]| format!("{x} {y} {z}\n")));
    add("csv", "csv", "id,x,y,z\n".into(), rows(points, |i, [x, y, z]| format!("{i},{x},{y},{z}\n")));
    add("pts", "pts", format!("{n}\n"), rows(points, |_, [x, y, z]| format!("{x} {y} {z} 12 255 255 255\n")));
    let comma = |number: String| number.replace('.', ",");
    let body = rows(points, |_, p| p.map(comma).join(";") + "\n");
    add("csv", "csv-locale", "x;y;z\n".into(), body);
    let mut body = rows(points, |_, [x, y, z]| format!("v {x} {y} {z}\n"));
    body.extend(b"vn 0 0 1\nf 1//1 1//1 -1//1\n");
    add("obj", "obj", "# by hand\nmtllib a.mtl\no a\n".into(), body);
    let mut body = rows(points, |_, [x, y, z]| format!("{x} {y} {z} 255 0 0\n"));
    body.extend(b"3 0 0 0\n");
    add("off", "off", format!("COFF\n{n} 1 0\n"), body);
    let facet = |_: usize, [x, y, z]: [String; 3]| {
        let corner = format!("vertex {x} {y} {z}\n");
        format!("facet normal 0 0 1\nouter loop\n{corner}{corner}{corner}endloop\nendfacet\n")
    };
    let mut body = rows(points, facet);
    body.extend(b"endsolid a\n");
    add("stl", "stl-ascii", "solid a\n".into(), body);
    all
}
