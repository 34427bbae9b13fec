//! PTX, VTK, glTF and MCAP.

use super::Sample;

fn rows(points: &[[f64; 3]]) -> String {
    points.iter().map(|[x, y, z]| format!("{x:?} {y:?} {z:?} 0.5\n")).collect()
}

/// A PTX file of one scan with points `points`, none of which may be at the origin.
fn ptx(points: &[[f64; 3]]) -> (String, Vec<u8>) {
    let n = points.len();
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    (format!("1\n{n}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{identity}"), rows(points).into_bytes())
}

fn vtk(points: &[[f64; 3]], binary: bool) -> (String, Vec<u8>) {
    let (n, kind) = (points.len(), if binary { "BINARY" } else { "ASCII" });
    let head = format!("# vtk DataFile Version 3.0\na\n{kind}\nDATASET POLYDATA\nPOINTS {n} double\n");
    let mut body = Vec::new();
    if binary {
        points.iter().flatten().for_each(|c| body.extend(c.to_be_bytes()));
        body.extend(b"\nPOLYGONS 1 4\n");
        [3i32, 0, 0, 0].iter().for_each(|i| body.extend(i.to_be_bytes()));
        body.extend(
            format!("\nPOINT_DATA {n}\nSCALARS a unsigned_char 1\nLOOKUP_TABLE default\n").into_bytes(),
        );
        body.extend((0..n).map(|i| i as u8));
        body.push(b'\n');
        return (head, body);
    }
    body.extend(
        points.iter().map(|[x, y, z]| format!("{x:?} {y:?} {z:?}\n")).collect::<String>().into_bytes(),
    );
    body.extend(format!("POLYGONS 1 4\n3 0 0 0\nPOINT_DATA {n}\nNORMALS n float\n").into_bytes());
    body.extend("0 0 1\n".repeat(n).into_bytes());
    (head, body)
}

fn vtp(points: &[[f64; 3]]) -> (String, Vec<u8>) {
    let n = points.len();
    let text: String = points.iter().map(|[x, y, z]| format!("{x:?} {y:?} {z:?}\n")).collect();
    let head = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n\
         <Piece NumberOfPoints=\"{n}\" NumberOfPolys=\"1\"><Points>\n\
         <DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n{text}</DataArray></Points><Polys>\n"
    );
    let array = |name: &str, at: usize| {
        format!("<DataArray type=\"Int32\" Name=\"{name}\" format=\"appended\" offset=\"{at}\"/>\n")
    };
    let mut body = (array("connectivity", 0) + &array("offsets", 16)).into_bytes();
    body.extend(b"</Polys></Piece></PolyData><AppendedData encoding=\"raw\">_");
    [12i32, 0, 0, 0, 4, 3].iter().for_each(|i| body.extend(i.to_le_bytes()));
    body.extend(b"</AppendedData></VTKFile>\n");
    (head, body)
}

/// A `.glb` in single precision.
fn glb(points: &[[f64; 3]]) -> (Vec<u8>, Vec<u8>) {
    let n = points.len();
    let length = 12 * n + 12;
    let mut json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1}}]}}],\"accessors\":[\
         {{\"bufferView\":0,\"componentType\":5126,\"count\":{n},\"type\":\"VEC3\"}},\
         {{\"bufferView\":0,\"byteOffset\":{},\"componentType\":5125,\"count\":3,\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{length}}}],\"buffers\":[{{\"byteLength\":{length}}}]}}",
        12 * n
    );
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    let word = |value: usize| (value as u32).to_le_bytes();
    let all = 12 + 8 + json.len() + 8 + length;
    let head = [&b"glTF"[..], &word(2), &word(all), &word(json.len()), b"JSON", json.as_bytes()].concat();
    let mut body = [&word(length)[..], b"BIN\0"].concat();
    points.iter().flatten().for_each(|&c| body.extend((c as f32).to_le_bytes()));
    [0u32, 0, 0].iter().for_each(|i| body.extend(i.to_le_bytes()));
    (head, body)
}

/// A file without chunks, of one message in double precision.
fn mcap(points: &[[f64; 3]]) -> (Vec<u8>, Vec<u8>) {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let record = |op: u8, body: Vec<u8>| [&[op][..], &(body.len() as u64).to_le_bytes(), &body].concat();
    let magic = b"\x89MCAP0\r\n".to_vec();
    let header = record(1, [text("ros2"), text("by hand")].concat());
    let schema =
        record(3, [vec![1, 0], text("sensor_msgs/msg/PointCloud2"), text("ros2msg"), text("#")].concat());
    let channel = record(4, [vec![0, 0, 1, 0], text("/p"), text("cdr"), vec![0; 4]].concat());
    let mut message = vec![0, 1, 0, 0];
    let word = |message: &mut Vec<u8>, value: usize| {
        message.resize(message.len().next_multiple_of(4), 0);
        message.extend((value as u32).to_le_bytes());
    };
    // Time, frame, height, width, fields.
    for value in [7, 8, 1, 0] {
        word(&mut message, value);
    }
    *message.last_mut().unwrap() = 0;
    message.truncate(message.len() - 4);
    message.push(0);
    for value in [1, points.len(), 3] {
        word(&mut message, value);
    }
    for (offset, name) in [(0, b'x'), (8, b'y'), (16, b'z')] {
        word(&mut message, 2);
        message.extend([name, 0]);
        word(&mut message, offset);
        message.push(8);
        word(&mut message, 1);
    }
    message.push(0);
    word(&mut message, 24);
    word(&mut message, 24 * points.len());
    word(&mut message, 24 * points.len());
    points.iter().flatten().for_each(|c| message.extend(c.to_le_bytes()));
    message.push(1);
    let message = record(5, [vec![0; 22], message].concat());
    let end = [record(15, vec![0; 4]), record(2, vec![0; 20]), magic.clone()].concat();
    ([magic, header, schema, channel].concat(), [message, end].concat())
}

pub fn samples(points: &[[f64; 3]]) -> Vec<Sample> {
    let mut all = Vec::new();
    let mut add = |format, name: &str, head: &[u8], body: &[u8], points: &[[f64; 3]]| {
        all.push(Sample::new(format, name, head, body, points));
    };
    let (head, body) = ptx(points);
    add("ptx", "ptx", head.as_bytes(), &body, points);
    for (name, binary) in [("vtk-ascii", false), ("vtk-binary", true)] {
        let (head, body) = vtk(points, binary);
        add("vtk", name, head.as_bytes(), &body, points);
    }
    let (head, body) = vtp(points);
    add("vtp", "vtp", head.as_bytes(), &body, points);
    let (head, body) = glb(points);
    if cfg!(feature = "gltf") {
        add("glb", "glb", &head, &body, &super::single(points));
    }
    let (head, body) = mcap(points);
    if cfg!(feature = "mcap") {
        add("mcap", "mcap", &head, &body, points);
    }
    all
}
