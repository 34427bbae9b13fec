//! Binary flavours.

use super::{Sample, single};

/// Numbers in both byte orders.
fn put4(value: f64, big: bool) -> [u8; 4] {
    if big { (value as f32).to_be_bytes() } else { (value as f32).to_le_bytes() }
}

fn put8(value: f64, big: bool) -> [u8; 8] {
    if big { value.to_be_bytes() } else { value.to_le_bytes() }
}

pub fn samples(points: &[[f64; 3]]) -> Vec<Sample> {
    let mut all = Vec::new();
    for big in [false, true] {
        all.extend([ply(points, big, false), ply(points, big, true)]);
        all.extend([npy(points, big, false), npy(points, big, true)]);
    }
    all.extend([
        pcd(points, false),
        pcd(points, true),
        npy_fields(points),
        npz(points),
        kitti(points),
        stl(points),
    ]);
    all
}

/// With faces before the vertices, and with or without lists in the vertices.
fn ply(points: &[[f64; 3]], big: bool, list: bool) -> Sample {
    let order = if big { "big" } else { "little" };
    let extra = if list { "property list uchar short n\n" } else { "" };
    let header = format!(
        "ply\nformat binary_{order}_endian 1.0\nobj_info made by hand\nelement face 2\n\
         property list uchar int vertex_indices\nelement vertex {}\nproperty float y\n{extra}property double x\n\
         property uchar red\nproperty double z\nend_header\n",
        points.len()
    );
    let mut body = Vec::new();
    for _ in 0..2 {
        body.push(3);
        body.extend([0; 12]);
    }
    let expected: Vec<[f64; 3]> =
        points.iter().zip(single(points)).map(|(p, s)| [p[0], s[1], p[2]]).collect();
    for [x, y, z] in points {
        body.extend(put4(*y, big));
        if list {
            body.extend([2, 1, 2, 3, 4]);
        }
        body.extend(put8(*x, big));
        body.push(200);
        body.extend(put8(*z, big));
    }
    Sample::new(
        "ply",
        format!("ply-{order}{}", if list { "-list" } else { "" }),
        header.as_bytes(),
        &body,
        &expected,
    )
}

fn pcd(points: &[[f64; 3]], compressed: bool) -> Sample {
    let n = points.len();
    let data = if compressed { "binary_compressed" } else { "binary" };
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x normal_x z _ y normal_y normal_z\n\
         SIZE 4 4 8 1 8 4 4\nTYPE F F F U F F F\nCOUNT 1 1 1 3 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n\
         POINTS {n}\nDATA {data}\n"
    );
    let expected: Vec<[f64; 3]> =
        points.iter().zip(single(points)).map(|(p, s)| [s[0], p[1], p[2]]).collect();
    let column = |cell: &dyn Fn(&[f64; 3]) -> Vec<u8>| points.iter().map(cell).collect::<Vec<Vec<u8>>>();
    let columns = [
        column(&|p| put4(p[0], false).to_vec()),
        column(&|_| put4(0.0, false).to_vec()),
        column(&|p| put8(p[2], false).to_vec()),
        column(&|_| vec![1, 2, 3]),
        column(&|p| put8(p[1], false).to_vec()),
        column(&|_| put4(0.6, false).to_vec()),
        column(&|_| put4(0.8, false).to_vec()),
    ];
    let mut body: Vec<u8> = Vec::new();
    if compressed {
        let plain: Vec<u8> = columns.iter().flatten().flatten().copied().collect();
        // LZF without any copies: runs of up to 32 plain bytes.
        let packed: Vec<u8> = plain
            .chunks(32)
            .flat_map(|run| std::iter::once(run.len() as u8 - 1).chain(run.iter().copied()))
            .collect();
        body.extend((packed.len() as u32).to_le_bytes());
        body.extend((plain.len() as u32).to_le_bytes());
        body.extend(packed);
    } else {
        (0..n).for_each(|row| columns.iter().for_each(|column| body.extend(&column[row])));
    }
    Sample::new("pcd", format!("pcd-{data}"), header.as_bytes(), &body, &expected)
}

fn npy_header(descr: &str, fortran: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.bytes());
    header
}

/// Four columns: in C order double precision, in Fortran's order single.
fn npy(points: &[[f64; 3]], big: bool, fortran: bool) -> Sample {
    let n = points.len();
    let sign = if big { '>' } else { '<' };
    let at = |row: usize, column: usize| points[row].get(column).copied().unwrap_or(0.5);
    let mut body = Vec::new();
    let name = format!("npy-{}{}", if big { "big" } else { "little" }, if fortran { "-fortran" } else { "" });
    if fortran {
        (0..4).for_each(|column| (0..n).for_each(|row| body.extend(put4(at(row, column), big))));
        let header = npy_header(&format!("'{sign}f4'"), "True", &format!("({n}, 4)"));
        return Sample::new("npy", name, &header, &body, &single(points));
    }
    (0..n).for_each(|row| (0..4).for_each(|column| body.extend(put8(at(row, column), big))));
    Sample::new(
        "npy",
        name,
        &npy_header(&format!("'{sign}f8'"), "False", &format!("({n}, 4)")),
        &body,
        points,
    )
}

fn npy_fields(points: &[[f64; 3]]) -> Sample {
    let descr = "[('intensity', '|u1'), ('x', '<f8'), ('y', '>f8'), ('z', '<f4')]";
    let mut body = Vec::new();
    for [x, y, z] in points {
        body.push(9);
        body.extend(put8(*x, false));
        body.extend(put8(*y, true));
        body.extend(put4(*z, false));
    }
    let expected: Vec<[f64; 3]> =
        points.iter().zip(single(points)).map(|(p, s)| [p[0], p[1], s[2]]).collect();
    let header = npy_header(descr, "False", &format!("({},)", points.len()));
    Sample::new("npy", "npy-fields", &header, &body, &expected)
}

/// An archive with one stored array and another file, by hand.
fn npz(points: &[[f64; 3]]) -> Sample {
    let array = npy(points, false, false);
    let mut bytes = Vec::new();
    let mut directory = Vec::new();
    for (name, content) in [("points.npy", &array.bytes[..]), ("note.npy", &b"not an array"[..])] {
        let mut fields = vec![20, 0, 0, 0, 0, 0, 0, 0, 33, 0];
        fields.extend(crc32(content).to_le_bytes());
        fields.extend((content.len() as u32).to_le_bytes());
        fields.extend((content.len() as u32).to_le_bytes());
        fields.extend((name.len() as u16).to_le_bytes());
        fields.extend([0, 0]);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&fields);
        directory.extend([0; 10]);
        directory.extend((bytes.len() as u32).to_le_bytes());
        directory.extend(name.bytes());
        bytes.extend(b"PK\x03\x04");
        bytes.extend(fields);
        bytes.extend(name.bytes());
        bytes.extend(content);
    }
    let at = bytes.len() as u32;
    bytes.extend(&directory);
    bytes.extend(b"PK\x05\x06\x00\x00\x00\x00\x02\x00\x02\x00");
    bytes.extend((directory.len() as u32).to_le_bytes());
    bytes.extend(at.to_le_bytes());
    bytes.extend([0, 0]);
    let header = 40 + array.header;
    let (head, body) = bytes.split_at(header);
    Sample::new("npz", "npz", head, body, points)
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |v, _| if v & 1 == 1 { v >> 1 ^ 0xedb8_8320 } else { v >> 1 })
    })
}

fn kitti(points: &[[f64; 3]]) -> Sample {
    let body: Vec<u8> =
        points.iter().flat_map(|p| [p[0], p[1], p[2], 0.25].map(|c| put4(c, false))).flatten().collect();
    Sample::new("kitti", "kitti", &[], &body, &single(points))
}

/// Each point is the three corners of a triangle of its own.
fn stl(points: &[[f64; 3]]) -> Sample {
    let mut header = vec![b' '; 80];
    header.extend((points.len() as u32).to_le_bytes());
    let mut body = Vec::new();
    for p in points {
        body.extend([0.0, 0.0, 1.0].map(|c| put4(c, false)).concat());
        (0..3).for_each(|_| body.extend(p.map(|c| put4(c, false)).concat()));
        body.extend([3, 4]);
    }
    Sample::new("stl", "stl-binary", &header, &body, &single(points))
}
