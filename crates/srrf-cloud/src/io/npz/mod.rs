//! NumPy's archives of arrays.

mod axes;
mod choice;

use std::io::{self, Cursor, Read, Write};

use zip::read::ZipFile;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use self::choice::{NpzCloud, choose};
use super::npy::{Npy, array_of, columns, known};
use super::outgoing::{COLOURS, INTENSITY, NORMALS};
use super::{Attribute, CloudFormat, Contents, FormatError, Outgoing, ReadOptions, ReadSwitch};
use crate::Rigid;

/// Arrays may unpack to this many times their size in the archive and `SLACK` more: real clouds do not
/// come near, and a small file cannot fill the memory.
const RATIO: u64 = 200;
const SLACK: u64 = 1 << 20;

/// NPZ archives, compressed or not. The cloud is the array that [`ReadOptions::array`] names, or the only one with a
/// usual name such as `points`, or three arrays that are x, y and z, or the only array whose shape is that of a cloud.
/// Written with the array `points`, and `colors`, `normals` and one more for each other attribute. A moved copy keeps
/// all other arrays as they are.
pub(super) struct Npz;

impl CloudFormat for Npz {
    fn name(&self) -> &'static str {
        "npz"
    }

    fn extensions(&self) -> &[&'static str] {
        &["npz"]
    }

    fn recognises(&self, bytes: &[u8]) -> bool {
        // Other archives, such as spreadsheets, begin with another file.
        let length = bytes.get(26..28).map_or(0, |size| usize::from(size[0]) | usize::from(size[1]) << 8);
        let name = bytes.get(30..30 + length);
        bytes.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(b".npy"))
    }

    fn takes(&self) -> &'static [ReadSwitch] {
        &[ReadSwitch::Columns, ReadSwitch::Array]
    }

    fn read(&self, bytes: &[u8], options: &ReadOptions) -> Result<Contents, FormatError> {
        let mut archive = open(bytes)?;
        match choose(&mut archive, options)? {
            NpzCloud::One(cloud) => Npy.read(&unpack_at(&mut archive, cloud, bytes.len(), options)?, options),
            NpzCloud::Axes(places) => axes::read(&mut archive, &places, bytes.len(), options)?.contents(),
        }
    }

    fn attributes(&self, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Attribute>, FormatError> {
        let points = self.read(bytes, options)?.points.len();
        let mut archive = open(bytes)?;
        let cloud = choose(&mut archive, options)?;
        let mut attributes = match &cloud {
            NpzCloud::One(cloud) => {
                Npy.attributes(&unpack_at(&mut archive, *cloud, bytes.len(), options)?, options)?
            }
            NpzCloud::Axes(_) => Vec::new(),
        };
        for index in (0..archive.len()).filter(|&index| !cloud.is_of(index)) {
            let name =
                archive.by_index(index).ok().and_then(|entry| entry.name().ok().map(|n| n.into_owned()));
            let Some(name) = name.as_deref().and_then(|name| name.strip_suffix(".npy")) else { continue };
            // An array of another kind is none of the points'.
            let Ok(array) = unpack_at(&mut archive, index, bytes.len(), options) else { continue };
            options.check_memory("the attributes", bytes.len(), array.len())?;
            let columns = columns(&array, points).unwrap_or_default();
            let names = column_names(name, columns.len());
            attributes.extend(names.zip(columns).map(|(name, values)| Attribute { name, values }));
        }
        Ok(attributes)
    }

    fn keeps(&self, _: &Attribute, _: &Outgoing<'_>) -> bool {
        true
    }

    fn has_both_precisions(&self) -> bool {
        true
    }

    fn write_cloud(&self, cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
        let mut array = Vec::new();
        Npy.write_cloud(&Outgoing { attributes: &[], ..*cloud }, &mut array)?;
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        put(&mut archive, "points.npy", CompressionMethod::Stored, &array)?;
        let mut together: Vec<&str> = Vec::new();
        for (name, parts) in [("colors", COLOURS), ("normals", NORMALS)] {
            let Some(three) = cloud.triple(parts) else { continue };
            let kind = three[0].values.scalar();
            if three.iter().all(|part| part.values.scalar() == kind) {
                let array = array_of(&three.map(|part| &part.values));
                put(&mut archive, &format!("{name}.npy"), CompressionMethod::Stored, &array)?;
                together.extend(parts);
            }
        }
        for attribute in cloud.attributes.iter().filter(|a| !together.contains(&a.name.as_str())) {
            let name: String =
                attribute.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
            let array = array_of(&[&attribute.values]);
            put(&mut archive, &format!("{name}.npy"), CompressionMethod::Stored, &array)?;
        }
        out.write_all(archive.finish()?.get_ref())
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        options: &ReadOptions,
        motion: &Rigid,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let mut archive = open(bytes)?;
        let cloud = choose(&mut archive, options)?;
        let copies: Vec<(usize, Vec<u8>)> = match &cloud {
            NpzCloud::One(cloud) => {
                let array = unpack_at(&mut archive, *cloud, bytes.len(), options)?;
                let mut copy = Vec::new();
                Npy.rewrite(&array, options, motion, &mut copy)?;
                vec![(*cloud, copy)]
            }
            NpzCloud::Axes(places) => {
                axes::read(&mut archive, places, bytes.len(), options)?.moved(places, motion)?
            }
        };
        let mut written = ZipWriter::new(Cursor::new(Vec::new()));
        for index in 0..archive.len() {
            let entry = archive.by_index_raw(index)?;
            match copies.iter().find(|(copied, _)| *copied == index) {
                Some((_, copy)) => {
                    let (name, method) = (entry.name()?.into_owned(), entry.compression());
                    put(&mut written, &name, method, copy)?;
                }
                None => written.raw_copy_file(entry)?,
            }
        }
        out.write_all(written.finish()?.get_ref())
    }
}

/// The names of the columns of an array of this name.
fn column_names(array: &str, columns: usize) -> impl Iterator<Item = String> {
    let array = array.to_ascii_lowercase();
    let parts: &[&str] = match (&*array, columns) {
        ("colors" | "colours" | "color" | "colour" | "rgb", 3) => &COLOURS,
        ("colors" | "colours" | "color" | "colour" | "rgba", 4) => &["red", "green", "blue", "alpha"],
        ("normals" | "normal", 3) => &NORMALS,
        ("intensities", 1) => &[INTENSITY],
        _ => &[],
    };
    (0..columns).map(move |column| match parts.get(column) {
        Some(part) => (*part).to_owned(),
        None if columns == 1 => known(&array),
        None => format!("{array}_{column}"),
    })
}

type Archive<'a> = ZipArchive<Cursor<&'a [u8]>>;

fn open(bytes: &[u8]) -> Result<Archive<'_>, FormatError> {
    let problem = |e| FormatError::Content(format!("not an NPZ archive, or cut short: {e}"));
    ZipArchive::new(Cursor::new(bytes)).map_err(problem)
}

/// The bytes of the array of this index.
fn unpack_at(
    archive: &mut Archive,
    index: usize,
    file: usize,
    options: &ReadOptions,
) -> Result<Vec<u8>, FormatError> {
    let mut entry = archive.by_index(index).map_err(|e| cannot_unpack(e.to_string()))?;
    let size = usize::try_from(entry.size()).unwrap_or(usize::MAX);
    options.check_memory("the unpacked array", file, size)?;
    unpack(&mut entry, file as u64)
}

fn cannot_unpack(problem: String) -> FormatError {
    FormatError::Content(format!("cannot unpack the array: {problem}"))
}

/// The bytes of an array, as far as they are in proportion to what the archive, a file of `file` bytes, holds of it.
pub(super) fn unpack(entry: &mut ZipFile<'_, impl Read>, file: u64) -> Result<Vec<u8>, FormatError> {
    let problem = cannot_unpack;
    let most = entry.compressed_size().min(file).saturating_mul(RATIO).saturating_add(SLACK);
    // The size that it says has been checked against the memory; the reader unpacks no more than that.
    let mut array = Vec::new();
    entry.take(most + 1).read_to_end(&mut array).map_err(|e| problem(e.to_string()))?;
    if array.len() as u64 > most {
        return Err(problem(format!(
            "it is more than {RATIO} times larger than the file; save it uncompressed"
        )));
    }
    Ok(array)
}

fn put(
    archive: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    method: CompressionMethod,
    array: &[u8],
) -> io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(method)
        .large_file(array.len() as u64 > u64::from(u32::MAX) / 2);
    archive.start_file(name, options)?;
    archive.write_all(array)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::{moved_copy, points_of};

    fn archive(arrays: &[(&str, &[[f64; 3]])], method: CompressionMethod) -> Vec<u8> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, points) in arrays {
            let mut array = Vec::new();
            Npy.write_cloud(&Outgoing::of_points(points), &mut array).unwrap();
            put(&mut archive, name, method, &array).unwrap();
        }
        put(&mut archive, "note.txt", method, b"a").unwrap();
        archive.finish().unwrap().into_inner()
    }

    const A: &[[f64; 3]] = &[[0.1, 2.0, 3.0]];
    const B: &[[f64; 3]] = &[[4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];

    #[test]
    fn the_cloud_is_chosen_by_name_or_shape() {
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            assert_eq!(points_of(&Npz, &archive(&[("other.npy", B), ("points.npy", A)], method)).unwrap(), A);
            assert_eq!(points_of(&Npz, &archive(&[("other.npy", B)], method)).unwrap(), B);
        }
        let two = archive(&[("a.npy", A), ("b.npy", B)], CompressionMethod::Stored);
        let error = points_of(&Npz, &two).unwrap_err().to_string();
        assert!(error.contains("[\"a\", \"b\"]") && error.contains("more than one"), "{error}");
        assert!(
            points_of(&Npz, &archive(&[], CompressionMethod::Stored))
                .unwrap_err()
                .to_string()
                .contains("none")
        );
    }

    #[test]
    fn a_moved_copy_keeps_the_other_arrays() {
        let bytes = archive(&[("b.npy", B), ("points.npy", A)], CompressionMethod::Deflated);
        let motion = Rigid { translation: [1.0, 0.0, 0.0].into(), ..Rigid::identity() };
        let mut copy = Vec::new();
        moved_copy(&Npz, &bytes, &motion, &mut copy).unwrap();
        assert_eq!(points_of(&Npz, &copy).unwrap(), [[1.1, 2.0, 3.0]]);
        let mut read = open(&copy).unwrap();
        assert_eq!(read.len(), 3);
        assert_eq!(
            points_of(&Npy, &unpack_at(&mut read, 0, copy.len(), &ReadOptions::default()).unwrap()).unwrap(),
            B
        );
    }

    #[test]
    fn bombs_and_damage() {
        let bomb = archive(&[("points.npy", &vec![[0.0; 3]; 300_000])], CompressionMethod::Deflated);
        assert!(bomb.len() < 20_000);
        assert!(points_of(&Npz, &bomb).unwrap_err().to_string().contains("200 times"));
        let good = archive(&[("points.npy", B)], CompressionMethod::Deflated);
        // An archive that says of an array that it has nearly 4 GB, and one that says that it has 64 bytes.
        let claiming = |size: u32| {
            let mut bytes = good.clone();
            let places = [(&b"PK\x03\x04"[..], 22), (b"PK\x01\x02", 24)];
            for (mark, field) in places {
                let at = bytes.windows(4).position(|word| word == mark).unwrap() + field;
                bytes[at..at + 4].copy_from_slice(&size.to_le_bytes());
            }
            bytes
        };
        let limited = ReadOptions { max_memory: Some(1 << 20), ..ReadOptions::default() };
        let error = Npz.read(&claiming(4_000_000_000), &limited).unwrap_err();
        assert!(matches!(error, FormatError::Memory { needed: 4_000_000_000.., .. }), "{error}");
        let error = points_of(&Npz, &claiming(64)).unwrap_err().to_string();
        assert!(error.contains("larger than its declared"), "{error}");
        for length in 0..good.len() {
            assert!(points_of(&Npz, &good[..length]).is_err(), "{length}");
        }
    }
}
