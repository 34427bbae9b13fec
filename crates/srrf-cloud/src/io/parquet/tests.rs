use std::sync::Arc;

use arrow_array::builder::{Decimal128Builder, FixedSizeListBuilder, Float64Builder, ListBuilder};
use arrow_array::{
    ArrayRef, Float32Array, Float64Array, Int64Array, RecordBatch, StringArray, StructArray, UInt8Array,
};
use arrow_schema::Field;
use nalgebra::Rotation3;
use parquet::arrow::ArrowWriter;
use parquet::basic::{BrotliLevel, Compression, GzipLevel, ZstdLevel};
use parquet::file::properties::WriterProperties;

use super::*;
use crate::io::AttributeValues;

fn table(columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    packed(columns, Compression::SNAPPY)
}

fn packed(columns: Vec<(&str, ArrayRef)>, compression: Compression) -> Vec<u8> {
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut writer = ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.into_inner().unwrap()
}

fn doubles(values: &[f64]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

fn points(bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
    Parquet.read(bytes, &ReadOptions::default()).map(|contents| contents.points)
}

fn with(columns: &str) -> ReadOptions {
    ReadOptions { columns: Some(columns.parse().unwrap()), ..ReadOptions::default() }
}

const EXPECTED: [[f64; 3]; 2] = [[1.5, -2.0, 3.25], [4.0, 5.0, 6.0]];

#[test]
fn numbers_of_every_kind() {
    let mut decimals = Decimal128Builder::new().with_precision_and_scale(20, 2).unwrap();
    decimals.append_value(-200);
    decimals.append_value(500);
    for compression in [
        Compression::SNAPPY,
        Compression::UNCOMPRESSED,
        Compression::ZSTD(ZstdLevel::default()),
        Compression::GZIP(GzipLevel::default()),
        Compression::BROTLI(BrotliLevel::default()),
        Compression::LZ4,
        Compression::LZ4_RAW,
    ] {
        let names: ArrayRef = Arc::new(StringArray::from(vec!["a", "b"]));
        let bytes = packed(
            vec![
                ("name", names),
                ("Z", Arc::new(Float32Array::from(vec![3.25, 6.0]))),
                ("X", doubles(&[1.5, 4.0])),
                ("Y", Arc::new(decimals.finish_cloned())),
            ],
            compression,
        );
        assert!(Parquet.recognises(&bytes));
        assert_eq!(points(&bytes).unwrap(), EXPECTED);
    }
    let whole = table(vec![
        ("x", Arc::new(Int64Array::from(vec![Some(1 << 40), None])) as ArrayRef),
        ("y", Arc::new(UInt8Array::from(vec![7, 255]))),
        ("z", Arc::new(Float32Array::from(vec![0.1, 2.0]))),
    ]);
    let read = points(&whole).unwrap();
    assert_eq!(read[0], [f64::from(1u32 << 20) * f64::from(1u32 << 20), 7.0, f64::from(0.1f32)]);
    assert!(read[1][0].is_nan() && read[1][1..] == [255.0, 2.0], "what is missing is NaN");
}

#[test]
fn lists_and_structures() {
    let mut fixed = FixedSizeListBuilder::new(Float64Builder::new(), 3);
    let mut list = ListBuilder::new(Float64Builder::new());
    let mut short = ListBuilder::new(Float64Builder::new());
    for point in EXPECTED {
        fixed.values().append_slice(&point);
        fixed.append(true);
        list.values().append_slice(&point);
        list.append(true);
        short.values().append_slice(&point[..2]);
        short.append(true);
    }
    let axes = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let field = Arc::new(Field::new(name, DataType::Float64, false));
        (field, doubles(&[EXPECTED[0][axis], EXPECTED[1][axis]]))
    });
    let structure = StructArray::from(axes.collect::<Vec<_>>());
    let id = || ("id", doubles(&[0.0, 1.0]));
    for column in [
        ("xyz", Arc::new(fixed.finish()) as ArrayRef),
        ("points", Arc::new(list.finish())),
        ("where", Arc::new(structure)),
    ] {
        assert_eq!(points(&table(vec![id(), column.clone()])).unwrap(), EXPECTED, "{}", column.0);
    }
    let error = points(&table(vec![id(), ("points", Arc::new(short.finish()))])).unwrap_err().to_string();
    assert!(error.contains("a list of 2 numbers"), "{error}");
}

#[test]
fn columns_are_known_by_their_names_as_in_a_text() {
    let named = |names: [&str; 3]| {
        let [x, y, z] = [0, 1, 2].map(|axis| doubles(&[EXPECTED[0][axis], EXPECTED[1][axis]]));
        table(vec![(names[0], x), ("id", doubles(&[7.0, 8.0])), (names[1], y), (names[2], z)])
    };
    for names in
        [["Easting", "Northing", "Elevation"], ["x [m]", "y [m]", "z [m]"], ["field.x", "field.y", "field.z"]]
    {
        assert_eq!(points(&named(names)).unwrap(), EXPECTED, "{names:?}");
    }
    let error = points(&named(["lon", "lat", "alt"])).unwrap_err().to_string();
    assert!(error.contains("degrees"), "{error}");
    let words: ArrayRef = Arc::new(StringArray::from(vec!["1", "2"]));
    let error = points(&table(vec![("x", words.clone()), ("y", words.clone()), ("z", words)])).unwrap_err();
    assert!(error.to_string().contains("of numbers"), "{error}");
    assert_eq!(
        points(&table(vec![("x", doubles(&[])), ("y", doubles(&[])), ("z", doubles(&[]))])).unwrap().len(),
        0
    );
}

#[test]
fn columns_are_asked_for_by_name() {
    let bytes = table(vec![
        ("a", doubles(&[0.0, 0.0])),
        ("b", doubles(&[1.5, 4.0])),
        ("c", doubles(&[-2.0, 5.0])),
        ("d", doubles(&[3.25, 6.0])),
        ("text", Arc::new(StringArray::from(vec!["a", "b"]))),
    ]);
    let error = points(&bytes).unwrap_err();
    assert!(matches!(error, FormatError::Unclear { switch: "--columns", .. }));
    assert!(error.to_string().contains("[\"a\", \"b\", \"c\", \"d\", \"text\"]"), "{error}");
    for columns in ["b,c,d", "B,C,D", "2,3,4"] {
        assert_eq!(Parquet.read(&bytes, &with(columns)).unwrap().points, EXPECTED, "{columns}");
    }
    assert_eq!(Parquet.read(&bytes, &with("d,c,b")).unwrap().points[0], [3.25, -2.0, 1.5]);
    for (columns, fact) in [("b,c,e", "no column e"), ("b,c,9", "no column 9"), ("b,c,text", "no number")] {
        let error = Parquet.read(&bytes, &with(columns)).unwrap_err().to_string();
        assert!(error.contains(fact) && error.contains("--columns"), "{error}");
    }
}

#[test]
fn what_is_written_reads_back_and_moves() {
    let many: Vec<[f64; 3]> = (0..70_001).map(|i| [f64::from(i), 0.1, -f64::from(i) / 3.0]).collect();
    let mut bytes = Vec::new();
    Parquet.write_cloud(&Outgoing::of_points(&many), &mut bytes).unwrap();
    let read = Parquet.read(&bytes, &ReadOptions::default()).unwrap();
    assert_eq!((read.points, read.single), (many, false));

    let motion = Rigid {
        rotation: Rotation3::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2).into_inner(),
        translation: [10.0, -0.5, 1.0].into(),
    };
    let bytes = table(vec![
        ("name", Arc::new(StringArray::from(vec!["a", "b"])) as ArrayRef),
        ("z", doubles(&[3.25, 6.0])),
        ("x", doubles(&[1.5, 4.0])),
        ("y", Arc::new(Float32Array::from(vec![-2.0, 5.0]))),
        ("nx", Arc::new(Float32Array::from(vec![1.0, 0.0]))),
        ("ny", Arc::new(Float32Array::from(vec![0.0, 1.0]))),
        ("nz", Arc::new(Float32Array::from(vec![0.0, 0.0]))),
        ("intensity", Arc::new(UInt8Array::from(vec![7, 8]))),
    ]);
    let (mut same, mut copy) = (Vec::new(), Vec::new());
    Parquet.rewrite(&bytes, &ReadOptions::default(), &Rigid::identity(), &mut same).unwrap();
    assert_eq!(same, bytes);
    Parquet.rewrite(&bytes, &ReadOptions::default(), &motion, &mut copy).unwrap();
    let moved = points(&copy).unwrap();
    for (old, new) in EXPECTED.iter().zip(moved) {
        let expected = motion.apply(old);
        assert!((0..3).all(|axis| (expected[axis] - new[axis]).abs() < 1e-12), "{expected:?} {new:?}");
    }
    let attributes = Parquet.attributes(&copy, &ReadOptions::default()).unwrap();
    let names: Vec<&str> = attributes.iter().map(|attribute| attribute.name.as_str()).collect();
    assert_eq!(names, ["nx", "ny", "nz", "intensity"]);
    assert_eq!(attributes[3].values, AttributeValues::U8(vec![7, 8]));
    let turned: Vec<f64> = attributes[..2].iter().map(|n| n.values.get(0).unwrap()).collect();
    assert!(turned[0].abs() < 1e-6 && (turned[1] - 1.0).abs() < 1e-6, "{turned:?}");
}

#[test]
fn damage_is_found() {
    let mut bytes = Vec::new();
    let many: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i), 0.1, -f64::from(i)]).collect();
    Parquet.write_cloud(&Outgoing::of_points(&many), &mut bytes).unwrap();
    for length in 0..bytes.len() {
        assert!(points(&bytes[..length]).is_err(), "{length}");
    }
    assert!(thrift::check_footer(&bytes).is_ok());
    let mut long = bytes.clone();
    let at = long.len() - 8;
    long[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(points(&long).unwrap_err().to_string().contains("a footer of 4294967295 bytes"));
    // A limit of memory is kept.
    let options = ReadOptions { max_memory: Some(bytes.len() as u64 + 100), ..ReadOptions::default() };
    assert!(matches!(Parquet.read(&bytes, &options), Err(FormatError::Memory { .. })));
}

#[test]
fn schemas_that_are_too_deep_are_refused() {
    let field = |inner: ArrayRef| {
        let field = Arc::new(Field::new("a", inner.data_type().clone(), true));
        Arc::new(StructArray::from(vec![(field, inner)])) as ArrayRef
    };
    let deep = |levels: usize| (0..levels).fold(doubles(&[1.0]), |inner, _| field(inner));
    assert!(thrift::check_footer(&table(vec![("a", deep(10))])).is_ok());
    let error = thrift::check_footer(&table(vec![("a", deep(40))])).unwrap_err().to_string();
    assert!(error.contains("too deep"), "{error}");
}

#[test]
fn attributes_are_columns() {
    use crate::io::AttributeValues as V;
    let attributes = [
        ("red", V::U8(vec![255, 7])),
        ("intensity", V::F32(vec![0.25, -1.0])),
        ("label", V::I64(vec![(1 << 53) + 1, -4])),
        ("time", V::F64(vec![1e9 + 0.1, 0.0])),
    ]
    .map(|(name, values)| Attribute { name: name.into(), values });
    for single in [true, false] {
        let mut bytes = Vec::new();
        let cloud = Outgoing { single, attributes: &attributes, ..Outgoing::of_points(&EXPECTED) };
        Parquet.write_cloud(&cloud, &mut bytes).unwrap();
        let options = ReadOptions::default();
        let contents = Parquet.read(&bytes, &options).unwrap();
        assert_eq!((&contents.points[..], contents.single), (&EXPECTED[..], single));
        let found = Parquet.attributes(&bytes, &options).unwrap();
        assert_eq!((found.len(), &found[..2], &found[3]), (4, &attributes[..2], &attributes[3]));
        assert_eq!(found[2].name, "label");
    }
}

#[test]
fn dictionaries_and_structures_in_structures() {
    use arrow_array::{DictionaryArray, Int32Array};
    let keys = || Int32Array::from(vec![Some(1), Some(0), None]);
    let coded = |values: &[f64]| -> ArrayRef { Arc::new(DictionaryArray::new(keys(), doubles(values))) };
    let bytes = table(vec![("x", coded(&[1.5, 2.5])), ("y", coded(&[-1.0, 3.0])), ("z", coded(&[7.0, 8.0]))]);
    let found = points(&bytes).unwrap();
    assert_eq!(found[..2], [[2.5, 3.0, 8.0], [1.5, -1.0, 7.0]]);
    assert!(found[2].iter().all(|c| c.is_nan()), "a key that is missing");

    let field = |name: &str, array: &ArrayRef| Arc::new(Field::new(name, array.data_type().clone(), true));
    let place = ["x", "y", "z"].map(|name| (name, doubles(&[1.0, 2.0])));
    let inner: ArrayRef = Arc::new(StructArray::from(
        place.iter().map(|(n, a)| (field(n, a), Arc::clone(a))).collect::<Vec<_>>(),
    ));
    let outer: ArrayRef = Arc::new(StructArray::from(vec![
        (field("time", &doubles(&[5.0, 6.0])), doubles(&[5.0, 6.0])),
        (field("position", &inner), Arc::clone(&inner)),
    ]));
    let bytes = table(vec![("pose", Arc::clone(&outer))]);
    assert_eq!(points(&bytes).unwrap(), [[1.0; 3], [2.0; 3]]);
    let two = table(vec![("pose", outer), ("other", inner)]);
    assert!(points(&two).unwrap_err().to_string().contains("[\"pose\", \"other\"]"));
}
