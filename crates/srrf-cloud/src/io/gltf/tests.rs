use nalgebra::Rotation3;

use super::*;
use crate::io::testing::points_of;

/// Four corners of a square and its normals and colours, in one buffer: floats, then bytes.
fn buffer() -> Vec<u8> {
    let mut bytes = Vec::new();
    for value in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(value.to_le_bytes());
    }
    for _ in 0..4 {
        [0.0f32, 0.0, 1.0].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes.extend([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 51, 102, 153, 128]);
    [0u16, 1, 2, 3, 0, 2].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

const ACCESSORS: &str = r#""accessors":[
    {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
    {"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3"},
    {"bufferView":0,"byteOffset":96,"componentType":5121,"normalized":true,"count":4,"type":"VEC4"},
    {"bufferView":0,"byteOffset":112,"componentType":5123,"count":6,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":124}]"#;

/// A document with these nodes, primitives and buffers.
fn json(nodes: &str, primitives: &str, uri: Option<&str>) -> String {
    let uri = uri.map_or(String::new(), |uri| format!("\"uri\":\"{uri}\","));
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{nodes}],\
         \"meshes\":[{{\"primitives\":[{primitives}]}}],{ACCESSORS},\"buffers\":[{{{uri}\"byteLength\":124}}]}}"
    )
}

const MESH: &str = r#"{"attributes":{"POSITION":0,"NORMAL":1,"COLOR_0":2,"_ID":3},"indices":3}"#;
const PLAIN: &str = r#"{"mesh":0}"#;

fn glb(json: &str) -> Vec<u8> {
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let glb = Glb { header, json: json.as_bytes().into(), bin: Some(buffer().into()) };
    glb.to_vec().unwrap()
}

fn inline() -> String {
    format!("data:application/octet-stream;base64,{}", STANDARD.encode(buffer()))
}

fn contents(bytes: &[u8]) -> Result<Contents, FormatError> {
    GLTF.read(bytes, &ReadOptions::default())
}

const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn meshes_and_their_attributes() {
    let files = [glb(&json(PLAIN, MESH, None)), json(PLAIN, MESH, Some(&inline())).into_bytes()];
    for bytes in files {
        let kind = if bytes.starts_with(b"glTF") { &GLB } else { &GLTF };
        assert!(GLB.recognises(&bytes) != GLTF.recognises(&bytes) && kind.recognises(&bytes));
        let read = contents(&bytes).unwrap();
        assert_eq!((read.points.as_slice(), read.single), (&SQUARE[..], true));
        assert_eq!(read.faces, [[0, 1, 2], [3, 0, 2]]);
        let attributes = GLTF.attributes(&bytes, &ReadOptions::default()).unwrap();
        let names: Vec<&str> = attributes.iter().map(|attribute| attribute.name.as_str()).collect();
        assert_eq!(names, ["nx", "ny", "nz", "red", "green", "blue", "alpha"]);
        assert_eq!(attributes[2].values, AttributeValues::F32(vec![1.0; 4]));
        assert_eq!(attributes[4].values, AttributeValues::U8(vec![0, 255, 0, 102]));
        assert_eq!(attributes[6].values, AttributeValues::U8(vec![255, 255, 255, 128]));
    }
}

#[test]
fn points_strips_fans_and_lists() {
    let faces = |mode: usize, indices: &str| {
        let primitive = format!("{{\"attributes\":{{\"POSITION\":0}},\"mode\":{mode}{indices}}}");
        let read = contents(&glb(&json(PLAIN, &primitive, None))).unwrap();
        assert_eq!(read.points, SQUARE);
        read.faces
    };
    assert_eq!(faces(0, ""), Vec::<[u32; 3]>::new());
    assert_eq!(faces(3, ""), Vec::<[u32; 3]>::new(), "a line has no surface");
    assert_eq!(faces(4, ""), [[0, 1, 2]]);
    assert_eq!(faces(5, ""), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(faces(6, ""), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(faces(5, ",\"indices\":3").len(), 4);
    // Two primitives that share their points, and one of points alone.
    let both = format!(
        "{MESH},{{\"attributes\":{{\"POSITION\":0}},\"mode\":6}},{{\"attributes\":{{\"POSITION\":1}},\"mode\":0}}"
    );
    let read = contents(&glb(&json(PLAIN, &both, None))).unwrap();
    assert_eq!((read.points.len(), read.faces.len()), (8, 4));
    assert_eq!(read.notes, [Note::LoosePoints { points: 4 }]);
}

#[test]
fn nodes_place_their_meshes() {
    // Scaled by two, turned by 90 degrees about z, then moved; its parent stands on a map.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = format!(
        "{{\"translation\":[431234.567891,0,0],\"children\":[1]}},\
         {{\"mesh\":0,\"scale\":[2,2,2],\"rotation\":[0,0,{half},{half}],\"translation\":[1,2,3]}}"
    );
    let bytes = glb(&json(&nodes, MESH, None));
    let read = contents(&bytes).unwrap();
    let expected = [[431_235.567_891, 2.0, 3.0], [431_235.567_891, 4.0, 3.0], [431_233.567_891, 4.0, 3.0]];
    for (point, expected) in read.points.iter().zip(expected) {
        assert!((0..3).all(|axis| (point[axis] - expected[axis]).abs() < 1e-9), "{point:?} {expected:?}");
    }
    assert!(!read.single, "single precision does not hold it");
    // A matrix, column by column, that mirrors x.
    let matrix = json(r#"{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}"#, MESH, None);
    assert_eq!(contents(&glb(&matrix)).unwrap().points[1], [4.0, 6.0, 7.0]);
    let normals = GLTF.attributes(&glb(&matrix), &ReadOptions::default()).unwrap();
    assert_eq!(normals[2].values, AttributeValues::F32(vec![1.0; 4]));
    // Without scenes, what is nobody's child is shown.
    let loose = json(&format!("{{\"children\":[1]}},{PLAIN},{PLAIN}"), MESH, None)
        .replace("\"scene\":0,\"scenes\":[{\"nodes\":[0]}],", "");
    assert_eq!(contents(&glb(&loose)).unwrap().points.len(), 8);
}

#[test]
fn sparse_and_quantised_numbers() {
    let sparse = json(PLAIN, MESH, None).replacen(
        r#""count":4,"type":"VEC3"}"#,
        r#""count":4,"type":"VEC3","sparse":{"count":2,"indices":{"bufferView":1,"componentType":5123},
           "values":{"bufferView":0,"byteOffset":48}}}"#,
        1,
    );
    let sparse = sparse
        .replace("\"bufferViews\":[", "\"bufferViews\":[{\"buffer\":0,\"byteLength\":124},")
        .replace("\"bufferView\":1", "\"bufferView\":2")
        .replace(
            "{\"buffer\":0,\"byteLength\":124}]",
            "{\"buffer\":0,\"byteLength\":124},{\"buffer\":0,\"byteOffset\":114,\"byteLength\":8}]",
        );
    let mut expected = SQUARE;
    (expected[1], expected[2]) = ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    assert_eq!(contents(&glb(&sparse)).unwrap().points, expected);
    // An accessor without data is zeros but for what it replaces.
    let bare = sparse.replacen(
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4",
        "{\"componentType\":5126,\"count\":4",
        1,
    );
    let mut expected = [[0.0; 3]; 4];
    (expected[1], expected[2]) = ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    assert_eq!(contents(&glb(&bare)).unwrap().points, expected);
    let many = bare.replacen("\"count\":4", "\"count\":4000000000", 1);
    assert!(contents(&glb(&many)).unwrap_err().to_string().contains("items and no data"));
    let outside = sparse.replace("\"byteOffset\":114,\"byteLength\":8", "\"byteOffset\":96,\"byteLength\":8");
    assert!(contents(&glb(&outside)).unwrap_err().to_string().contains("replaces item"));
    // Colours as points: bytes that stand for fractions, and bytes that do not.
    let bytes = |normalized: bool| {
        let accessor = format!(
            "{{\"bufferView\":0,\"byteOffset\":96,\"componentType\":5121,\"normalized\":{normalized},\"count\":4,\"type\":\"VEC3\"}}"
        );
        let text = json(PLAIN, r#"{"attributes":{"POSITION":4},"mode":0}"#, None);
        let text = text.replace(r#""type":"SCALAR"}]"#, &format!("\"type\":\"SCALAR\"}},{accessor}]"));
        let needed =
            text.replacen("\"scene\"", "\"extensionsRequired\":[\"KHR_mesh_quantization\"],\"scene\"", 1);
        contents(&glb(&needed)).unwrap()
    };
    assert_eq!(bytes(false).points[0], [255.0, 0.0, 0.0]);
    assert_eq!((bytes(true).points[0], bytes(true).single), ([1.0, 0.0, 0.0], false));
}

#[test]
fn buffers_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("in");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(inner.join("a b.bin"), buffer()).unwrap();
    std::fs::write(folder.path().join("secret.bin"), buffer()).unwrap();
    let read = |uri: &str| {
        let path = inner.join("x.gltf");
        std::fs::write(&path, json(PLAIN, MESH, Some(uri))).unwrap();
        crate::io::CloudFile::open(&path).and_then(|file| file.points()).map_err(|error| error.to_string())
    };
    assert_eq!(read("a%20b.bin").unwrap(), SQUARE);
    assert_eq!(read("./a b.bin").unwrap(), SQUARE);
    let absolute = folder.path().join("secret.bin").to_string_lossy().into_owned();
    for uri in
        ["../secret.bin", "in/../../secret.bin", &absolute, "file:secret.bin", "https://example.org/a.bin"]
    {
        assert!(read(uri).unwrap_err().contains("only files there are read"), "{uri}");
    }
    assert!(read("none.bin").unwrap_err().contains("cannot be read"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.path().join("secret.bin"), inner.join("link.bin")).unwrap();
        assert!(read("link.bin").unwrap_err().contains("link out of the folder"));
    }
    let stream = contents(json(PLAIN, MESH, Some("a.bin")).as_bytes()).unwrap_err().to_string();
    assert!(stream.contains(".glb"), "{stream}");
}

#[test]
fn what_is_refused_is_named() {
    let good = json(PLAIN, MESH, None);
    let error = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        contents(&glb(&good.replacen(from, to, 1))).unwrap_err().to_string()
    };
    let need = |name: &str| error("\"scene\":0", &format!("\"extensionsRequired\":[\"{name}\"],\"scene\":0"));
    assert!(need("KHR_draco_mesh_compression").contains("compressed by KHR_draco_mesh_compression"));
    assert!(need("EXT_meshopt_compression").contains("EXT_meshopt_compression"));
    assert!(need("FOO_bar").contains("\"FOO_bar\""));
    let used =
        error("{\"bufferView\":0,\"componentType\":5126,\"count\":4", "{\"componentType\":5126,\"count\":4");
    assert!(used.contains("accessor 0 has no data"), "{used}");
    assert!(
        error("\"2.0\"", "\"1.0\"").contains("version \\\"1.0\\\"")
            || error("\"2.0\"", "\"1.0\"").contains("1.0")
    );
    assert!(error("\"mesh\":0", "\"mesh\":0,\"children\":[0]").contains("two parents"));
    assert!(error("\"mesh\":0", "\"mesh\":7").contains("no mesh 7"));
    assert!(error("\"mesh\":0", "\"mesh\":0,\"skin\":0").contains("skeleton"));
    assert!(error("\"nodes\":[0]", "\"nodes\":[5]").contains("no node 5"));
    assert!(error("\"POSITION\":0", "\"POSITION\":9").contains("no accessor 9"));
    assert!(error("\"count\":4", "\"count\":4000000000").contains("4000000000 items"));
    assert!(error("\"byteOffset\":112", "\"byteOffset\":18446744073709551615").contains("6 items"));
    assert!(error("\"count\":6", "\"count\":7").contains("7 items"));
    assert!(error("\"indices\":3", "\"indices\":2").contains("indices of 4 numbers"));
    let bytes = glb(&good);
    for length in 0..bytes.len() {
        assert!(contents(&bytes[..length]).is_err(), "{length}");
    }
    for version in [1u8, 3] {
        let mut other = bytes.clone();
        other[4] = version;
        assert!(contents(&other).unwrap_err().to_string().contains("version 2 is read"));
    }
}

#[test]
fn written_files_and_moved_copies() {
    let points = [[0.5, -2.0, 3.25], [0.1f32.into(), 1e-3f32.into(), 7.0], [4.0, 5.0, 6.0]];
    let mut bytes = Vec::new();
    GLB.write_cloud(&Outgoing::of_points(&points), &mut bytes).unwrap();
    assert_eq!(bytes.len() % 4, 0);
    let mut text = Vec::new();
    GLTF.write_cloud(&Outgoing::of_points(&points), &mut text).unwrap();
    assert!(GLB.recognises(&bytes) && GLTF.recognises(&text));
    for bytes in [&bytes, &text] {
        let read = contents(bytes).unwrap();
        assert_eq!((read.points.as_slice(), read.single), (&points[..], true));
    }
    let error = GLB
        .write_cloud(
            &Outgoing::of_points(&[[4_812_345.678, 0.0, 0.0], [4_812_346.0, 0.5, 1.0]]),
            &mut Vec::new(),
        )
        .unwrap_err()
        .to_string();
    assert!(error.contains("single precision"), "{error}");

    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.3, -0.2, 0.1).into_inner(),
        translation: [1000.5, -2000.25, 5.0].into(),
    };
    let files = [bytes, glb(&json(PLAIN, MESH, None)), json(PLAIN, MESH, Some(&inline())).into_bytes()];
    for bytes in files {
        let (mut same, mut copy) = (Vec::new(), Vec::new());
        GLTF.rewrite(&bytes, &ReadOptions::default(), &Rigid::identity(), &mut same).unwrap();
        assert_eq!(same, bytes);
        GLTF.rewrite(&bytes, &ReadOptions::default(), &motion, &mut copy).unwrap();
        let (old, new) = (contents(&bytes).unwrap(), contents(&copy).unwrap());
        assert_eq!((old.faces, old.points.len()), (new.faces, new.points.len()));
        for (old, new) in old.points.iter().zip(&new.points) {
            let expected = motion.apply(old);
            assert!((0..3).all(|axis| (expected[axis] - new[axis]).abs() < 1e-9), "{expected:?} {new:?}");
        }
    }
    let beside = json(PLAIN, MESH, Some("a.bin"));
    assert!(points_of(&GLTF, beside.as_bytes()).is_err());
}
