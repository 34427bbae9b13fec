//! Clouds whose coordinates are three arrays of an archive.

use super::super::npy::{Array, array_of_shape, kind_of};
use super::super::outgoing::stays_single;
use super::super::scalar::Scalar;
use super::super::scan::moved;
use super::super::{Contents, FormatError, Note, ReadOptions};
use super::{Archive, unpack_at};
use crate::Rigid;

/// Three arrays of one shape.
pub(super) struct NpzAxes {
    shape: Vec<usize>,
    kinds: [Scalar; 3],
    points: Vec<[f64; 3]>,
}

/// Reads the arrays at `places`.
///
/// # Errors
/// [`FormatError`] where they are not of one shape, or damaged.
pub(super) fn read(
    archive: &mut Archive,
    places: &[usize; 3],
    file: usize,
    options: &ReadOptions,
) -> Result<NpzAxes, FormatError> {
    let mut arrays = Vec::new();
    let mut kinds = [Scalar::F64; 3];
    let mut held = file;
    for (kind, &place) in kinds.iter_mut().zip(places) {
        let bytes = unpack_at(archive, place, held, options)?;
        *kind = kind_of(&bytes)?;
        // Those of Fortran's order are put into another list.
        let numbers = (bytes.len() / kind.size()).saturating_mul(16);
        options.check_memory("a coordinate", held.saturating_add(bytes.len()), numbers)?;
        let array = Array::parse(&bytes)?;
        held = held.saturating_add(array.values.len().saturating_mul(8));
        arrays.push(array);
    }
    let lengths: Vec<usize> = arrays.iter().map(|array| array.values.len()).collect();
    let [x, y, z] = &arrays[..] else { return Err(FormatError::Content("an array is missing".into())) };
    if lengths.iter().any(|length| *length != lengths[0]) {
        return Err(FormatError::Content(format!(
            "the arrays of x, y and z have {}, {} and {} numbers; they have to be as many",
            lengths[0], lengths[1], lengths[2]
        )));
    }
    options.check_points(held, lengths[0])?;
    let points = x.values.iter().zip(&y.values).zip(&z.values).map(|((x, y), z)| [*x, *y, *z]).collect();
    // Rows and columns of one, as those of `x[:, None]`, are none.
    let shape = if x.shape == y.shape && y.shape == z.shape { x.shape.clone() } else { vec![lengths[0]] };
    Ok(NpzAxes { shape, kinds, points })
}

impl NpzAxes {
    /// The cloud.
    pub fn contents(self) -> Result<Contents, FormatError> {
        let single = self.kinds.iter().all(|kind| kind.is_single());
        let long: Vec<usize> = self.shape.iter().copied().filter(|axis| *axis != 1).collect();
        let (grid, notes) = match long[..] {
            [] | [_] => (None, Vec::new()),
            [height, width] => (Some([width, height]), Vec::new()),
            _ => {
                (None, vec![Note::Flattened { shape: self.shape.iter().map(|axis| *axis as u64).collect() }])
            }
        };
        Ok(Contents { points: self.points, single, grid, notes, ..Contents::default() })
    }

    /// The arrays anew, with their places, moved.
    pub fn moved(&self, places: &[usize; 3], motion: &Rigid) -> Result<Vec<(usize, Vec<u8>)>, FormatError> {
        let new: Vec<[f64; 3]> = self.points.iter().map(|&point| moved(motion, point)).collect();
        let single =
            self.kinds.iter().all(|kind| kind.is_single()) && stays_single(&self.points, &new).is_ok();
        let copies = (0..3).map(|axis| {
            let kind = self.kinds[axis].for_moved(axis, &self.points, &new, single);
            (places[axis], array_of_shape(&self.shape, kind, new.iter().map(|point| point[axis])))
        });
        Ok(copies.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{AttributeValues, CloudFile};
    use super::*;
    use crate::io::PointColumns;
    use crate::io::npy::array_of;

    fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, array) in arrays {
            super::super::put(&mut archive, &format!("{name}.npy"), zip::CompressionMethod::Deflated, array)
                .unwrap();
        }
        archive.finish().unwrap().into_inner()
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        array_of(&[&AttributeValues::F64(values.to_vec())])
    }

    fn triples(values: [f64; 3]) -> Vec<u8> {
        array_of_shape(&[2, 3], Scalar::F64, values.into_iter().chain(values))
    }

    fn open(bytes: &[u8], options: ReadOptions) -> CloudFile {
        CloudFile::from_reader_with(&mut &bytes[..], Some("npz"), options).unwrap()
    }

    fn points(arrays: &[(&str, Vec<u8>)]) -> Result<Vec<[f64; 3]>, String> {
        open(&archive(arrays), ReadOptions::default()).points().map_err(|e| e.to_string())
    }

    const EXPECTED: [[f64; 3]; 2] = [[1.5, 3.0, 5.0], [2.5, 4.0, 6.0]];

    fn xyz() -> [(&'static str, Vec<u8>); 3] {
        [("x", doubles(&[1.5, 2.5])), ("y", doubles(&[3.0, 4.0])), ("z", doubles(&[5.0, 6.0]))]
    }

    #[test]
    fn three_arrays_are_the_cloud_by_their_names() {
        assert_eq!(points(&xyz()).unwrap(), EXPECTED);
        let [x, y, z] = xyz();
        let named = [("easting", x.1.clone()), ("northing", y.1.clone()), ("Height", z.1.clone())];
        assert_eq!(points(&named).unwrap(), EXPECTED);
        // Colours, normals and matrices have the shape of a cloud, too.
        for name in ["colors", "normals", "K", "other"] {
            let with = [&xyz()[..], &[(name, triples([9.0, 8.0, 7.0]))]].concat();
            assert_eq!(points(&with).unwrap(), EXPECTED, "{name}");
        }
        let both = [&xyz()[..], &[("points", triples([9.0, 8.0, 7.0]))]].concat();
        assert_eq!(points(&both).unwrap(), [[9.0, 8.0, 7.0]; 2], "the name says it");
        for name in ["colors", "normals", "faces", "K"] {
            let error = points(&[(name, triples([9.0, 8.0, 7.0]))]).unwrap_err();
            assert!(error.contains("its name says another") && error.contains("--array"), "{error}");
        }
        let short = [("x", x.1), ("y", doubles(&[3.0])), ("z", z.1)];
        assert!(points(&short).unwrap_err().contains("have 2, 1 and 2 numbers"));
        let none = points(&[("a", doubles(&[1.0])), ("b", doubles(&[1.0]))]).unwrap_err();
        assert!(none.contains("none has a shape [points, 3]") && none.contains("`--columns`"), "{none}");
        let degrees = [("lon", doubles(&[1.0])), ("lat", doubles(&[1.0])), ("alt", doubles(&[1.0]))];
        assert!(points(&degrees).unwrap_err().contains("degrees and no lengths"));
    }

    #[test]
    fn arrays_are_named_as_columns() {
        let [x, y, z] = xyz();
        let bytes = archive(&[("a", x.1), ("b", y.1), ("c", z.1)]);
        let columns: PointColumns = "c,a,b".parse().unwrap();
        let options = ReadOptions { columns: Some(columns), ..ReadOptions::default() };
        assert_eq!(open(&bytes, options).points().unwrap(), [[5.0, 1.5, 3.0], [6.0, 2.5, 4.0]]);
    }

    #[test]
    fn pictures_of_coordinates_and_a_moved_copy() {
        let picture = |kind, from: f64| array_of_shape(&[2, 3], kind, (0..6).map(|i| from + f64::from(i)));
        let arrays = [
            ("X", picture(Scalar::F32, 0.0)),
            ("Y", picture(Scalar::F32, 10.0)),
            ("Z", picture(Scalar::I16, 20.0)),
            ("time", array_of_shape(&[6], Scalar::U8, (0..6).map(f64::from))),
        ];
        let bytes = archive(&arrays);
        let file = open(&bytes, ReadOptions::default());
        let contents = file.contents().unwrap();
        assert_eq!(
            (contents.grid, contents.single, contents.points[4]),
            (Some([3, 2]), true, [4.0, 14.0, 24.0])
        );
        assert_eq!(file.attributes().unwrap()[0].values, AttributeValues::U8(vec![0, 1, 2, 3, 4, 5]));
        let motion = Rigid { translation: [0.5, 0.0, 0.0].into(), ..Rigid::identity() };
        let mut copy = Vec::new();
        file.write_transformed_to(&mut copy, None, &motion).unwrap();
        let copy = open(&copy, ReadOptions::default());
        let moved = copy.contents().unwrap();
        assert_eq!((moved.grid, moved.single, moved.points[4]), (Some([3, 2]), true, [4.5, 14.0, 24.0]));
        assert_eq!(copy.attributes().unwrap().len(), 1);
    }
}
