//! Files as today's tools write them: read with the right values, or refused by name and with the way out.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::fs;

use srrf_cloud::io::{CloudFile, Contents, IoError, Note, ReadOptions};

/// Numbers from -2 to 2 in a fixed order.
fn cloud(n: usize) -> Vec<[f64; 3]> {
    let number = |i: usize| {
        let value = ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(4.0) - 2.0;
        f64::from(value as f32)
    };
    (0..n).map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)]).collect()
}

fn read_as(name: &str, bytes: &[u8], options: ReadOptions) -> Result<Contents, IoError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    CloudFile::open_with(&path, options)?.contents()
}

fn read(name: &str, bytes: impl AsRef<[u8]>) -> Contents {
    read_as(name, bytes.as_ref(), ReadOptions::default()).unwrap()
}

fn refused(name: &str, bytes: impl AsRef<[u8]>, facts: &[&str]) {
    let error = read_as(name, bytes.as_ref(), ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(name), "{error}");
    facts.iter().for_each(|fact| assert!(error.contains(fact), "{fact:?} in {error}"));
}

fn columns(text: &str) -> ReadOptions {
    ReadOptions { columns: Some(text.parse().unwrap()), ..ReadOptions::default() }
}

fn singles(rows: impl Iterator<Item = Vec<f64>>) -> Vec<u8> {
    rows.flatten().flat_map(|v| (v as f32).to_le_bytes()).collect()
}

#[test]
fn bare_numbers_by_name_and_by_plausibility() {
    let p = cloud(40);
    let sweep = singles(
        p.iter().enumerate().map(|(i, p)| [&p[..], &[(i * 7 % 256) as f64, (i % 32) as f64]].concat()),
    );
    for name in ["n.pcd.bin", "n.bin"] {
        let contents = read(name, &sweep);
        assert_eq!((contents.points.as_slice(), contents.single), (&p[..], true), "{name}");
        assert_eq!(contents.notes.len(), usize::from(name == "n.bin"), "what was found is said");
    }
    let kitti = singles(p.iter().enumerate().map(|(i, p)| [&p[..], &[(i % 100) as f64 / 100.0]].concat()));
    let contents = read("k.bin", &kitti);
    assert_eq!((contents.points.as_slice(), contents.notes.len()), (&p[..], 0));
    assert_eq!(read("p.bin", singles(p.iter().map(|p| p.to_vec()))).points, p);
    let doubles: Vec<u8> = p.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let contents = read("d.bin", &doubles);
    assert_eq!((contents.points.as_slice(), contents.single), (&p[..], false));
    let positive = singles(p.iter().map(|p| p.map(|c| c.abs() + 0.1).to_vec()));
    refused("a.bin", &positive, &["3xf32 (40 points)", "`--layout`"]);
    let options = ReadOptions { layout: Some("3xf32".parse().unwrap()), ..ReadOptions::default() };
    assert_eq!(read_as("a.bin", &positive, options).unwrap().points.len(), 40);
    let extreme = singles((0..40).map(|_| vec![1e38, 1e-42, 1e38, 1e-42]));
    refused("e.bin", &extreme, &["no points in any usual layout", "`--layout`"]);
}

/// A title, what begins a row and what ends it.
fn csv(title: &str, row: impl Fn(usize, [f64; 3]) -> String) -> String {
    let rows = cloud(40).into_iter().enumerate().map(|(i, p)| row(i, p) + "\n");
    format!("{title}\n{}", rows.collect::<String>())
}

#[test]
fn titles_of_all_kinds_count() {
    for (name, text) in [
        ("trailing comma in the rows", csv("z,y,x", |_, [x, y, z]| format!("{z},{y},{x},"))),
        ("trailing comma in the title", csv("z,y,x,", |_, [x, y, z]| format!("{z},{y},{x},"))),
        ("an unnamed column in the rows", csv("z,y,x", |_, [x, y, z]| format!("{z},{y},{x},7.5"))),
        ("pandas' index", csv(",x,y,z", |i, [x, y, z]| format!("{i},{x:?},{y:?},{z:?}"))),
        (
            "an index that the title does not count",
            csv("x,y,z", |i, [x, y, z]| format!("{i},{x:?},{y:?},{z:?}")),
        ),
        ("easting", csv("id,Easting,Northing,Height", |i, [x, y, z]| format!("{i},{x},{y},{z}"))),
        (
            "ParaView",
            csv("\"I\",\"Points:0\",\"Points:1\",\"Points:2\"", |i, [x, y, z]| format!("{i},{x},{y},{z}")),
        ),
        ("units", csv("t; x [m]; y [m]; z [m]", |i, [x, y, z]| format!("{i};{x};{y};{z}"))),
        ("tabs", csv("label\tpos_x\tpos_y\tpos_z", |i, [x, y, z]| format!("{i}\t{x}\t{y}\t{z}"))),
        (
            "a comment after the title",
            csv("# i z y x\n# made today", |i, [x, y, z]| format!("{i} {z} {y} {x}")),
        ),
        ("CloudCompare", csv("//Z Y X", |_, [x, y, z]| format!("{z} {y} {x}"))),
        ("capitals", csv("Intensity,Y,X,Z", |i, [x, y, z]| format!("{i},{y},{x},{z}"))),
    ] {
        assert_eq!(read("a.csv", &text).points, cloud(40), "{name}");
    }
    let numbered = read("p.csv", csv("0,1,2", |_, [x, y, z]| format!("{x:?},{y:?},{z:?}")));
    assert_eq!((numbered.points.len(), numbered.notes), (40, vec![Note::NumberedTitle]));
}

#[test]
fn titles_that_do_not_say_it_are_asked() {
    let text = csv("a,b,c,d", |i, [x, y, z]| format!("{i},{x},{y},{z}"));
    refused("a.csv", &text, &["a, b, c, d", "`--columns`"]);
    for asked in ["b,c,d", "2,3,4"] {
        assert_eq!(read_as("a.csv", text.as_bytes(), columns(asked)).unwrap().points, cloud(40), "{asked}");
    }
    let error = read_as("a.csv", text.as_bytes(), columns("b,c,e")).unwrap_err().to_string();
    assert!(error.contains("no column e") && error.contains("a, b, c, d"), "{error}");
    let degrees = csv("lon,lat,alt", |_, [x, y, z]| format!("{x},{y},{z}"));
    refused("g.csv", &degrees, &["lon, lat, alt", "degrees", "pyproj"]);
}

#[test]
fn poses_and_transposed_texts_are_no_clouds() {
    let tum: String = (0..9).map(|i| format!("{}.5 {i} 2 3 0 0.6 0 0.8\n", 100 + i)).collect();
    refused("tum.txt", &tum, &["trajectory", "`--columns`"]);
    let place = read_as("tum.txt", tum.as_bytes(), columns("2,3,4")).unwrap();
    assert_eq!(place.points[8], [8.0, 2.0, 3.0]);
    refused("poses.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n".repeat(5), &["KITTI"]);
    refused("t.txt", "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n", &["a pose"]);
    let row = |axis: usize| cloud(100).iter().map(|p| format!("{} ", p[axis])).collect::<String>() + "\n";
    refused("t.txt", row(0) + &row(1) + &row(2), &["look transposed", "`--columns`"]);
}

fn npy(descr: &str, shape: &str, body: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes(), body].concat()
}

#[test]
fn arrays_of_all_shapes() {
    let p = cloud(40);
    let flat: Vec<u8> = p.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    refused("t.npy", npy("'<f8'", "(3, 40)", &flat), &["[3, 40]", "transposed", "array.T"]);
    for shape in ["(1, 40, 3)", "(5, 8, 3)", "(2, 4, 5, 3)"] {
        let contents = read("a.npy", npy("'<f8'", shape, &flat));
        assert_eq!(contents.points, p, "{shape}");
        assert!(matches!(contents.notes[..], [Note::Flattened { .. }]), "{shape}");
        assert_eq!(contents.grid, (shape == "(5, 8, 3)").then_some([8, 5]));
    }
    refused("a.npy", npy("'<f8'", "(3, 5, 8)", &flat), &["transposed"]);
    refused("a.npy", npy("'<f8'", "(120,)", &flat), &["reshape(-1, 3)"]);
    let pose: Vec<u8> = (0..16).flat_map(|i| f64::from(u8::from(i % 5 == 0)).to_le_bytes()).collect();
    refused("t.npy", npy("'<f8'", "(4, 4)", &pose), &["a pose"]);
    let half: Vec<u8> = [0x3c00u16, 0xc000, 0x3555].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(read("h.npy", npy("'<f2'", "(1, 3)", &half)).points, [[1.0, -2.0, 0.333_251_953_125]]);
}

#[test]
fn structured_arrays_with_padding_text_and_capitals() {
    let p = cloud(7);
    let descr = "[('', '|V4'), ('X', '<f4'), ('name', '<U2'), ('Y', '<f4'), ('ok', '|b1'), ('rgb', '|u1', (3,)), ('Z', '<f4')]";
    let mut body = Vec::new();
    for [x, y, z] in &p {
        body.extend([9; 4]);
        body.extend((*x as f32).to_le_bytes());
        body.extend([1; 8]);
        body.extend((*y as f32).to_le_bytes());
        body.extend([1, 2, 3, 4]);
        body.extend((*z as f32).to_le_bytes());
    }
    let bytes = npy(descr, "(7,)", &body);
    let contents = read("s.npy", &bytes);
    assert_eq!((contents.points, contents.single), (p.clone(), true));
    let file = CloudFile::from_reader(&mut &bytes[..], None).unwrap();
    let motion = srrf_cloud::Rigid { translation: [0.1, 0.0, 0.0].into(), ..srrf_cloud::Rigid::identity() };
    let mut copy = Vec::new();
    file.write_transformed_to(&mut copy, None, &motion).unwrap();
    // Single precision stays single precision.
    let moved: Vec<[f64; 3]> = p.iter().map(|p| motion.apply(p).map(|c| f64::from(c as f32))).collect();
    assert_eq!(read("copy.npy", &copy).points, moved);
    let other = npy("[('a', '<f4'), ('b', '<f4'), ('c', '<f4')]", "(1,)", &[0; 12]);
    refused("o.npy", &other, &["a, b, c", "`--columns`"]);
    assert_eq!(read_as("o.npy", &other, columns("a,b,c")).unwrap().points, [[0.0; 3]]);
}

#[test]
fn archives_by_name_of_the_array() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, arrays: &[(&str, &[usize], f64)]| {
        let path = folder.path().join(name);
        let mut npz = srrf_cloud::io::NpzWriter::new(fs::File::create(&path).unwrap());
        for (name, shape, value) in arrays {
            npz.array(name, shape, &vec![*value; shape.iter().product()]).unwrap();
        }
        npz.finish().unwrap();
        path
    };
    let open = |path: &std::path::Path, options| CloudFile::open_with(path, options).unwrap().contents();
    let array = |name: &str| ReadOptions { array: Some(name.into()), ..ReadOptions::default() };
    for name in ["positions", "pts", "coord", "pc"] {
        let path =
            write("a.npz", &[("colors", &[5, 3], 0.5), (name, &[5, 3], 2.0), ("normals", &[5, 3], 1.0)]);
        assert_eq!(open(&path, ReadOptions::default()).unwrap().points, [[2.0; 3]; 5], "{name}");
    }
    let path = write("b.npz", &[("left", &[5, 3], 1.0), ("right", &[5, 3], 2.0), ("n", &[2], 0.0)]);
    let error = open(&path, ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("\"left\", \"right\"") && error.contains("`--array`"), "{error}");
    assert_eq!(open(&path, array("right")).unwrap().points, [[2.0; 3]; 5]);
    assert!(open(&path, array("middle")).unwrap_err().to_string().contains("no array \"middle\""));
    let path = write("t.npz", &[("points", &[3, 50], 1.0)]);
    assert!(open(&path, ReadOptions::default()).unwrap_err().to_string().contains("transposed"));
}

#[test]
fn headers_as_other_tools_write_them() {
    let expected = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let body = "1 2 3\n4 5 6\n";
    let pcd = "VERSION .5\nCOLUMNS X Y Z\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ASCII\n".to_owned() + body;
    assert_eq!(read("a.pcd", pcd).points, expected);
    let mut small = b"FIELDS x y z\nSIZE 4 4 4\nTYPE f f f\nWIDTH 2\nHEIGHT 1\nDATA BINARY\n".to_vec();
    expected.iter().flatten().for_each(|v| small.extend((*v as f32).to_le_bytes()));
    assert_eq!(read("b.pcd", &small).points, expected);
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty bool ok\nproperty long X\nproperty float Y\nproperty double Z\n\
               end_header\n1 1 2 3\n0 4 5 6\n";
    assert_eq!(read("a.ply", ply).points, expected);
    let obj = "\u{feff}v 1 2 \\\n3\nfoo bar\nv 4 5 6\nf 1 -1 \\\n2\n";
    let contents = read("a.obj", obj);
    assert_eq!((contents.points.as_slice(), contents.faces.as_slice()), (&expected[..], &[[0, 1, 1]][..]));
    assert!(contents.notes[0].to_string().contains("line 3: \"foo\""), "{:?}", contents.notes);
}

#[test]
fn an_stl_with_a_byte_too_many_or_in_capitals() {
    let mut bytes = vec![b' '; 80];
    bytes.extend(1u32.to_le_bytes());
    [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes.extend([0, 0, 10]);
    let contents = read("a.stl", &bytes);
    assert_eq!((contents.points.len(), contents.faces.len()), (3, 1));
    assert_eq!(contents.notes, [Note::ExtraBytes { bytes: 1 }]);
    let text = "SOLID a\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\nENDLOOP\nENDFACET\nENDSOLID a\n";
    assert_eq!(read("b.stl", text).points, contents.points);
}

#[test]
fn files_that_are_something_else_are_called_by_their_names() {
    for (name, bytes, facts) in [
        (
            "a.ply",
            &b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"[..],
            "`git lfs pull`",
        ),
        ("a.pcd", b"<!DOCTYPE html><html></html>", "a web page"),
        ("a.ply.gz", b"\x1f\x8b\x08\x00", "gunzip"),
        ("a.bin", b"\x1f\x8b\x08\x00", "gzip"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "HDF5"),
        ("a.npy", b"\x80\x04\x95", "pickle"),
        ("a.drc", b"DRACO\x02\x02", "draco_decoder"),
        ("a.rcp", b"\x01\x02\x03", "ReCap"),
        ("a.dxf", b"0\nSECTION\n", "CAD"),
        ("a.bag", b"#ROSBAG V2.0\n", "ROS 1 bag"),
        ("a.xyz", b"", "empty"),
    ] {
        refused(name, bytes, &[facts]);
    }
}

/// A switch that says nothing to a format is not passed over.
#[test]
fn switches_that_say_nothing_are_refused() {
    let off = "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n";
    let xyz = "0 0 0\n1 0 0\n0 1 0\n";
    let d = ReadOptions::default;
    for (name, text, options, facts) in [
        ("a.off", off, columns("1,2,3"), ["`--columns`", "format off", "none of the switches"]),
        (
            "a.off",
            off,
            ReadOptions { layout: "kitti".parse().ok(), ..d() },
            ["`--layout`", "leave it out", "off"],
        ),
        ("a.off", off, ReadOptions { topic: Some("t".into()), ..d() }, ["`--topic`", "leave it out", "off"]),
        (
            "a.xyz",
            xyz,
            ReadOptions { array: Some("a".into()), ..d() },
            ["`--array`", "xyz", "takes --columns;"],
        ),
        ("a.xyz", xyz, ReadOptions { message: Some(1), ..d() }, ["`--message`", "xyz", "leave it out"]),
        (
            "a.pts",
            xyz,
            ReadOptions { array: Some("a".into()), ..d() },
            ["`--array`", "pts", "takes --columns, --scan;"],
        ),
        ("a.off", off, ReadOptions { scan: Some(2), ..d() }, ["scan 2", "off", "holds one"]),
    ] {
        let error = read_as(name, text.as_bytes(), options).unwrap_err().to_string();
        facts.iter().for_each(|fact| assert!(error.contains(fact), "{fact:?} in {error}"));
    }
    assert_eq!(read_as("a.xyz", xyz.as_bytes(), columns("3,2,1")).unwrap().points[1], [0.0, 0.0, 1.0]);
    assert_eq!(
        read_as("a.off", off.as_bytes(), ReadOptions { scan: Some(1), ..d() }).unwrap().points.len(),
        3
    );
}

/// Text in UTF-16, as PowerShell and Notepad write it, and in UTF-32; with its mark and without.
#[test]
fn text_of_two_and_of_four_bytes_a_character() {
    let points = cloud(12);
    let rows: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\nproperty double z\nend_header\n{rows}"
    );
    let vertices: String = rows.lines().map(|line| format!("v {line}\n")).collect();
    let files = [
        ("a.xyz", rows.clone()),
        ("a.csv", csv("x,y,z", |_, [x, y, z]| format!("{x},{y},{z}"))),
        ("a.pts", format!("12\n{rows}")),
        ("a.off", format!("OFF\n12 0 0\n{rows}")),
        ("a.obj", vertices),
        ("a.ply", ply),
        ("without-extension", rows.clone()),
    ];
    let encodings: [fn(&str) -> Vec<u8>; 4] = [
        |text| text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
        |text| text.encode_utf16().flat_map(u16::to_be_bytes).collect(),
        |text| text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect(),
        |text| text.chars().flat_map(|c| u32::from(c).to_be_bytes()).collect(),
    ];
    for (name, text) in files {
        let expected = read(name, &text);
        for encode in encodings {
            for mark in ["", "\u{feff}"] {
                let found = read(name, encode(&format!("{mark}{text}")));
                assert_eq!(found.points, expected.points, "{name}");
                let said = found.notes.last().unwrap().to_string();
                assert!(
                    said.starts_with("the text is in UTF-") && said.ends_with("copy of it is in UTF-8"),
                    "{said}"
                );
            }
        }
    }
    let mut damaged = encodings[0](&format!("\u{feff}{rows}"));
    damaged.truncate(damaged.len() - 1);
    refused("a.xyz", damaged, &["UTF-16 (little endian)", "damaged at character", "save it as UTF-8"]);
}

#[test]
fn python_objects_are_called_by_their_name() {
    refused("a.npy", npy("'|O'", "(2,)", b"\x80\x04"), &["Python objects", "of shape [points, 3]"]);
}
