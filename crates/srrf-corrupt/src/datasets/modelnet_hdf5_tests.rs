use std::fs;
use std::path::Path;

use hdf5_pure::FileBuilder;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use crate::datasets::{SourceError, Split, default_data_path, open};

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(5)
}

/// `shapes` clouds of `points` points; coordinate `c` of point `p` of shape `s` is `s + p / 100 + c / 10`.
fn write(path: &Path, shapes: usize, points: usize, width: usize, change: impl Fn(&mut Vec<f32>)) {
    let mut data: Vec<f32> = (0..shapes * points * width)
        .map(|i| {
            let (s, p, c) = (i / (points * width), i / width % points, i % width);
            s as f32 + p as f32 / 100.0 + c as f32 / 10.0
        })
        .collect();
    change(&mut data);
    let labels: Vec<u8> = (0..shapes).map(|s| [0, 39, 5][s % 3]).collect();
    let mut file = FileBuilder::new();
    file.create_dataset("data")
        .with_f32_data(&data)
        .with_shape(&[shapes as u64, points as u64, width as u64])
        .with_chunks(&[1, points as u64, width as u64])
        .with_shuffle()
        .with_deflate(4);
    file.create_dataset("label").with_u8_data(&labels).with_shape(&[shapes as u64, 1]);
    file.write(path).unwrap();
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("ply_data_test0.h5"), 3, 17, 3, |_| ());
    write(&folder.path().join("ply_data_test1.h5"), 2, 17, 3, |_| ());
    write(&folder.path().join("ply_data_train0.h5"), 7, 17, 3, |_| ());
    fs::write(
        folder.path().join("test_files.txt"),
        "/gone/modelnet40_ply_hdf5_2048/ply_data_test0.h5\ndata/x/ply_data_test1.h5\n\n",
    )
    .unwrap();
    fs::write(
        folder.path().join("ply_data_test_0_id2file.json"),
        r#"["airplane/airplane_0627.ply", "xbox/xbox_0001", "bottle_0003"]"#,
    )
    .unwrap();
    folder
}

#[test]
fn reads_a_folder() {
    let folder = folder();
    let source = open(folder.path(), Split::Test).unwrap();
    assert_eq!(source.len(), 5);
    assert!(source.description().contains("test split: 5 shapes of 17 points"), "{}", source.description());
    assert_eq!((source.id(0).as_str(), source.class(0)), ("airplane_0627", "airplane"));
    assert_eq!((source.id(1).as_str(), source.class(1)), ("xbox_0001", "xbox"));
    assert_eq!((source.id(4).as_str(), source.class(4)), ("ply_data_test1_0001", "xbox"));
    assert_eq!(
        (0..5).map(|i| source.is_symmetric(i)).collect::<Vec<_>>(),
        [false, false, true, false, false]
    );

    let cloud = source.sample(4, 11, &mut rng()).unwrap();
    assert_eq!(cloud.len(), 11);
    let expected = [1.10, 1.20, 1.30];
    assert!((0..3).all(|c| (cloud.points()[10][c] - expected[c]).abs() < 1e-6));
    assert_eq!(source.sample(4, 99, &mut rng()).unwrap().len(), 17);
    assert!(matches!(source.sample(5, 9, &mut rng()), Err(SourceError::NoSuchShape { index: 5, len: 5 })));
    assert!(source.sample(0, 0, &mut rng()).is_err());

    assert_eq!(open(folder.path(), Split::Train).unwrap().len(), 7);
    assert_eq!(open(&folder.path().join("ply_data_train0.h5"), Split::Test).unwrap().len(), 7);
}

#[test]
fn halves_share_no_point() {
    let folder = folder();
    let source = open(folder.path(), Split::Test).unwrap();
    for (count, each) in [(5, 5), (8, 8), (17, 8)] {
        let (a, b) = source.sample_two(2, count, &mut rng()).unwrap();
        assert_eq!((a.len(), b.len()), (each, each));
        assert!(a.points().iter().all(|p| !b.points().contains(p)));
        assert_eq!(source.sample_two(2, count, &mut rng()).unwrap(), (a, b));
    }
}

#[test]
fn finds_the_folder_from_its_parent_and_the_files_without_lists() {
    let parent = tempfile::tempdir().unwrap();
    let inner = parent.path().join("modelnet40_ply_hdf5_2048");
    fs::create_dir(&inner).unwrap();
    for number in [0, 1, 2, 10] {
        write(&inner.join(format!("ply_data_train{number}.h5")), 1 + number, 5, 3, |_| ());
    }
    fs::write(inner.join("train_files.txt"), "elsewhere/other.h5\n").unwrap();
    fs::write(inner.join("shape_names.txt"), "first\n").unwrap();
    let source = open(parent.path(), Split::Train).unwrap();
    assert_eq!(source.len(), 1 + 2 + 3 + 11);
    assert_eq!(
        (source.id(16).as_str(), source.class(0), source.class(7)),
        ("ply_data_train10_0010", "first", "")
    );
    let missing = open(parent.path(), Split::Test).err().unwrap().to_string();
    assert!(missing.contains("ply_data_test*.h5") && missing.contains("accepted layouts"), "{missing}");
}

#[test]
fn nothing_there() {
    let empty = tempfile::tempdir().unwrap();
    for path in [empty.path().to_owned(), empty.path().join("nowhere")] {
        let message = open(&path, Split::Test).err().unwrap().to_string();
        assert!(message.contains(path.to_str().unwrap()) && message.contains("HDF5"), "{message}");
    }
    let folder = folder();
    fs::remove_file(folder.path().join("ply_data_test1.h5")).unwrap();
    let message = open(folder.path(), Split::Test).err().unwrap().to_string();
    assert!(message.contains("ply_data_test1.h5") && message.contains("test_files.txt"), "{message}");
}

#[test]
fn truncated_files_are_named_at_every_length() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ply_data_test0.h5");
    write(&file, 2, 600, 3, |_| ());
    let whole = fs::read(&file).unwrap();
    let step = whole.len() / 97;
    for length in (0..whole.len() - 1).step_by(step.max(1)) {
        fs::write(&file, &whole[..length]).unwrap();
        let error =
            open(folder.path(), Split::Test).err().unwrap_or_else(|| panic!("{length} bytes accepted"));
        assert!(error.to_string().contains("ply_data_test0.h5"), "{error}");
    }
    fs::write(&file, b"not HDF5 at all").unwrap();
    assert!(matches!(open(folder.path(), Split::Test), Err(SourceError::Hdf5 { .. })));
}

#[test]
fn wrong_content_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ply_data_test0.h5");
    let message = || open(folder.path(), Split::Test).err().unwrap().to_string();

    write(&file, 3, 7, 4, |_| ());
    assert!(message().contains("[3, 7, 4], expected [shapes, points, 3]"), "{}", message());
    write(&file, 3, 7, 3, |data| data[(7 + 5) * 3 + 1] = f32::NAN);
    assert!(message().contains("shape 1: point 5 "), "{}", message());
    write(&file, 3, 7, 3, |data| data[0] = f32::INFINITY);
    assert!(message().contains("shape 0: point 0 "), "{}", message());

    write(&file, 3, 7, 3, |_| ());
    let json = folder.path().join("ply_data_test_0_id2file.json");
    fs::write(&json, r#"["a"]"#).unwrap();
    assert!(message().contains("1 names for 3 shapes"), "{}", message());
    fs::write(&json, "{").unwrap();
    assert!(message().contains("not a list of names"), "{}", message());

    let mut bare = FileBuilder::new();
    bare.create_dataset("points").with_f32_data(&[0.0; 9]).with_shape(&[1, 3, 3]);
    bare.write(&file).unwrap();
    assert!(message().contains("data"), "{}", message());
}

/// Reads the data set at `$SRRF_DATA`; passes at once where that is not set.
#[test]
fn reads_the_real_set() {
    let Some(path) = default_data_path() else { return };
    let source = open(&path, Split::Test).unwrap();
    assert_eq!(source.len(), 2468);
    let symmetric = (0..source.len()).filter(|&i| source.is_symmetric(i)).count();
    assert!(symmetric > 300 && symmetric < 600, "{symmetric}");
    let cloud = source.sample(0, 1024, &mut rng()).unwrap();
    assert_eq!(cloud.len(), 1024);
    let (_, frame) = cloud.to_unit_sphere();
    assert!((frame.radius - 1.0).abs() < 0.05 && frame.centre.norm() < 0.05, "{frame:?}");
    assert!(!source.id(0).is_empty() && source.id(0).starts_with(source.class(0)));
}
