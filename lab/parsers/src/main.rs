//! What crates for clouds and meshes read of the corpus: `parsers FOLDER [PAGE.md]`, the folder made by
//! `scripts/make_corpus.py FOLDER`. Writes, for each crate, which files of its format have the right points, other ones, or are
//! refused. What a crate leaves to its caller (flat arrays, names in capitals) the caller here does as simply as it can.

use std::error::Error;
use std::fs::File;
use std::io::BufReader;
use std::panic::catch_unwind;
use std::path::Path;

use serde_json::Value;

const HEAD: &str = "<!-- Written by lab/parsers. -->
# Parsers of other crates

What seven crates read of the files of their format in the corpus of `scripts/make_corpus.py`, with the simplest code around
them; SRRF reads all of these, or refuses them where they are broken. \"Refused\" in the second column is right.

Rows as these are why SRRF has parsers of its own for NPY, OBJ, STL, PLY and PCD. `lzf`, with a caller that reads the header of a PCD, and `las` read
all of theirs here, but for LAZ of LASzip 1, at which `las` panics: nothing in this table speaks against them. LAZ (`laz`), E57 (`e57`), Parquet (`parquet`), glTF
(`gltf`), MCAP (`mcap`) and ZIP (`zip`) are read by crates.

";

type Points = Result<Vec<[f64; 3]>, Box<dyn Error>>;

fn npy(path: &Path) -> Points {
    let bytes = std::fs::read(path)?;
    let file = npyz::NpyFile::new(&bytes[..])?;
    let shape = file.shape().to_vec();
    let order = file.order();
    let dtype = file.dtype().descr();
    let values: Vec<f64> = match dtype.as_str() {
        "'<f8'" => file.into_vec::<f64>()?,
        "'<f4'" => file.into_vec::<f32>()?.into_iter().map(f64::from).collect(),
        other => return Err(format!("the caller has to know the type {other}").into()),
    };
    // All axes but the last are rows.
    let Some((&columns, before)) = shape.split_last() else { return Err("no axes".into()) };
    let rows: u64 = before.iter().product();
    if columns < 3 || (order == npyz::Order::Fortran && before.len() > 1) {
        return Err(format!("shape {shape:?}").into());
    }
    let at = |row: u64, column: u64| match order {
        npyz::Order::C => values[(row * columns + column) as usize],
        npyz::Order::Fortran => values[(column * rows + row) as usize],
    };
    Ok((0..rows).map(|row| [at(row, 0), at(row, 1), at(row, 2)]).collect())
}

fn obj(path: &Path) -> Points {
    let (models, _) = tobj::load_obj(path, &tobj::LoadOptions { triangulate: true, ..Default::default() })?;
    let all = models.iter().flat_map(|model| model.mesh.positions.chunks(3));
    Ok(all.map(|p| [p[0] as f64, p[1] as f64, p[2] as f64]).collect())
}

fn stl(path: &Path) -> Points {
    let mesh = stl_io::read_stl(&mut BufReader::new(File::open(path)?))?;
    Ok(mesh.vertices.iter().map(|v| [v[0] as f64, v[1] as f64, v[2] as f64]).collect())
}

fn ply(path: &Path) -> Points {
    let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
    let ply = parser.read_ply(&mut BufReader::new(File::open(path)?))?;
    let rows = ply.payload.get("vertex").ok_or("no vertex")?;
    rows.iter()
        .map(|row| {
            let value =
                |name: &str| row.get(name).and_then(ply_rs_bw::ply::Property::to_f32_lossy).map(f64::from);
            Ok([value("x").ok_or("no x")?, value("y").ok_or("no y")?, value("z").ok_or("no z")?])
        })
        .collect()
}

fn pcd(path: &Path) -> Points {
    let reader = pcd_rs::DynReader::open(path)?;
    reader.map(|record| Ok(record?.to_xyz::<f32>().ok_or("no x, y, z")?.map(f64::from))).collect()
}

fn las(path: &Path) -> Points {
    let mut reader = las::Reader::from_path(path)?;
    let all = reader.read_all()?;
    all.points().map(|point| point.map(|p| [p.x, p.y, p.z]).map_err(Into::into)).collect()
}

/// A PCD in LZF whose fields are 4 bytes each, x, y and z first.
fn lzf(path: &Path) -> Points {
    let bytes = std::fs::read(path)?;
    let end = b"DATA binary_compressed\n";
    let body = bytes.windows(end.len()).position(|w| w == end).ok_or("not in LZF")? + end.len();
    let head = std::str::from_utf8(&bytes[..body])?;
    let count: usize = head
        .lines()
        .find_map(|line| line.strip_prefix("POINTS "))
        .ok_or("no POINTS")?
        .parse()?;
    let size = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[body + at + i])) as usize;
    let packed = bytes.get(body + 8..body + 8 + size(0)).ok_or("cut short")?;
    let plain = lzf::decompress(packed, size(4)).map_err(|e| format!("{e:?}"))?;
    let at = |place: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|i| plain[4 * place + i])));
    Ok((0..count).map(|i| [at(i), at(count + i), at(2 * count + i)]).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("parsers FOLDER")?;
    std::panic::set_hook(Box::new(|_| ()));
    let manifest: Vec<Value> = serde_json::from_slice(&std::fs::read(format!("{folder}/manifest.json"))?)?;
    let crates: [(&str, &str, fn(&Path) -> Points); 8] = [
        ("npyz 0.9.1", "npy", npy),
        ("tobj 4.0.5", "obj", obj),
        ("stl_io 0.11.0", "stl", stl),
        ("ply-rs-bw 4.0.1", "ply", ply),
        ("pcd-rs 0.13.0", "pcd", pcd),
        ("lzf 1.0.0", "pcd", lzf),
        ("las 0.11.2", "las", las),
        ("las 0.11.2 with `laz`", "laz", las),
    ];
    let mut page = format!(
        "{HEAD}| crate | right | other points, no error | refused, though it can be read |\n|---|---|---|---|\n"
    );
    for (name, extension, read) in crates {
        let (mut right, mut other, mut refused) = (Vec::new(), Vec::new(), Vec::new());
        for case in &manifest {
            let file = case["file"].as_str().ok_or("no file")?;
            if !file.ends_with(&format!(".{extension}")) || case["args"] != serde_json::json!([]) {
                continue;
            }
            let path = Path::new(&folder).join(file);
            // That crate unpacks; only files that are packed are of its kind.
            if name.starts_with("lzf") && !file.starts_with("packed") {
                continue;
            }
            let found = catch_unwind(|| read(&path).map_err(|e| e.to_string()));
            let cell = |words: &str| format!("`{file}` ({words})");
            match (found, case["points"].as_u64()) {
                (Ok(Ok(points)), Some(count)) => {
                    let near = |key: &str, pick: fn(f64, f64) -> f64, start: f64| {
                        (0..3).all(|c| {
                            let value = points.iter().map(|p| p[c]).fold(start, pick);
                            (value - case[key][c].as_f64().unwrap_or(f64::NAN)).abs() < 1e-6
                        })
                    };
                    let same = points.len() as u64 == count;
                    if same
                        && near("low", f64::min, f64::INFINITY)
                        && near("high", f64::max, f64::NEG_INFINITY)
                    {
                        right.push(format!("`{file}`"));
                    } else {
                        other.push(cell(&format!("{} points of {count}", points.len())));
                    }
                }
                (Ok(Ok(points)), None) => {
                    other.push(cell(&format!("{} points of a broken file", points.len())))
                }
                (Ok(Err(error)), Some(_)) => {
                    refused.push(cell(
                        &error
                            .split_whitespace()
                            .collect::<Vec<_>>()
                            .join(" ")
                            .chars()
                            .take(70)
                            .collect::<String>(),
                    ));
                }
                (Err(_), Some(_)) => refused.push(cell("panic")),
                (Err(_), None) => other.push(cell("panic on a broken file")),
                (Ok(Err(_)), None) => right.push(format!("`{file}` refused")),
            }
        }
        let list = |files: Vec<String>| files.join(", ");
        page += &format!("| {name} | {} | {} | {} |\n", list(right), list(other), list(refused));
    }
    match std::env::args().nth(2) {
        Some(path) => std::fs::write(path, page)?,
        None => print!("{page}"),
    }
    Ok(())
}
