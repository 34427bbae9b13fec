//! Files that are no clouds, or of formats that are not there, called by their names.

/// What the bytes are, and what to do about it; `None` where nobody knows them.
pub(super) fn name(bytes: &[u8]) -> Option<&'static str> {
    let bare = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let text = bare[..bare.len().min(1024)].trim_ascii_start().to_ascii_lowercase();
    let begins = |word: &str| text.starts_with(word.as_bytes());
    if begins("version https://git-lfs.github.com/spec") {
        return Some("a Git LFS pointer and not the file itself; fetch it with `git lfs pull`");
    }
    if begins("<!doctype html") || begins("<html") || begins("<head") {
        return Some("a web page (HTML), such as the answer of a failed download; download the file again");
    }
    if begins("<?xml") || begins("<vtkfile") {
        let has = |word: &[u8]| text.windows(word.len()).any(|part| part == word);
        return Some(match has(b"<vtkfile") {
            true => "a VTK file in XML that this build does not read; save it as .ply or .csv with ParaView",
            false => "an XML file; convert it to .ply with the program that wrote it, or with CloudCompare",
        });
    }
    if begins("# vtk datafile") {
        return Some(
            "a legacy VTK file that this build does not read; save it as .ply or .csv with ParaView",
        );
    }
    if begins("{") || begins("[{") {
        return Some("JSON; write the points as .csv, .ply or .npy");
    }
    if begins("ncols ") || begins("ncols\t") {
        return Some("a grid of heights (ESRI ASCII); make points of it with `gdal_translate -of XYZ`");
    }
    if begins("vertex_se3:quat") || begins("vertex_se2") || begins("edge_se3:quat") {
        return Some("a graph of poses (g2o) and no cloud");
    }
    MAGIC
        .iter()
        .find(|(at, magic, _)| bytes.get(*at..).is_some_and(|rest| rest.starts_with(magic)))
        .map(|m| m.2)
}

/// Whether the content says less than the name: archives, compressed files and XML hold files of many kinds.
pub(super) fn may_hold_anything(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    [&b"PK"[..], b"\x1f\x8b", b"<?xml", b"{"].iter().any(|begin| text.starts_with(begin))
}

/// Offsets, bytes there, and what they say.
const MAGIC: &[(usize, &[u8], &str)] = &[
    (0, b"\x1f\x8b", "compressed with gzip; unpack it first, with `gunzip` (or `tar xzf` for a .tar.gz)"),
    (0, b"BZh", "compressed with bzip2; unpack it first, with `bunzip2`"),
    (0, b"\xfd7zXZ\x00", "compressed with xz; unpack it first, with `unxz`"),
    (0, b"\x28\xb5\x2f\xfd", "compressed with Zstandard; unpack it first, with `unzstd`"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7z archive; unpack it first, with `7z x`"),
    (0, b"Rar!", "a RAR archive; unpack it first, with `unrar x`"),
    (0, b"PK\x05\x06", "an empty zip archive"),
    (0, b"PK\x03\x04", "a zip archive; unpack it first, with `unzip`"),
    (257, b"ustar", "a tar archive; unpack it first, with `tar xf`"),
    (
        0,
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file, as ModelNet40 comes in; `srrf-train` and `srrf-eval` read such data sets with --data, and a single \
         cloud is written with h5py: `numpy.save(\"cloud.npy\", file[\"data\"][0])`",
    ),
    (0, b"\x80\x02", PICKLE),
    (0, b"\x80\x03", PICKLE),
    (0, b"\x80\x04", PICKLE),
    (0, b"\x80\x05", PICKLE),
    (
        0,
        b"#ROSBAG",
        "a ROS 1 bag; convert it with `rosbags-convert` to MCAP, or its clouds with `bag_to_pcd` of pcl_ros",
    ),
    (
        0,
        b"SQLite format 3\x00",
        "a SQLite database, as ROS 2 bags are; convert it with `ros2 bag convert` to MCAP",
    ),
    (0, b"\x89MCAP0\r\n", "an MCAP file, which this build does not read; write the cloud as .pcd first"),
    (0, b"glTF", "a binary glTF, which this build does not read; convert it to .ply with trimesh or Blender"),
    (0, b"DRACO", "a Draco file; unpack it with `draco_decoder -i FILE -o cloud.ply`"),
    (0, b"PAR1", "a Parquet file, which this build does not read; write it as .csv first"),
    (
        0,
        b"AutoCAD Binary DXF",
        "a DXF drawing; export its points as .csv, or its meshes as .stl with FreeCAD",
    ),
    (0, b"AC10", "a DWG drawing; export its points or meshes with the CAD program as .csv or .stl"),
    (0, b"ISO-10303-21", "a STEP model; mesh it as .stl or .obj with FreeCAD or Gmsh"),
    (0, b"%PDF", "a PDF document"),
    (
        0,
        b"\x89PNG",
        "a PNG picture; a depth picture needs the camera's numbers: make a cloud of it with Open3D",
    ),
    (0, b"\xff\xd8\xff", "a JPEG picture"),
    (0, b"Kaydara FBX Binary", "an FBX scene; convert it to .obj or .ply with Blender"),
];

const PICKLE: &str =
    "a Python pickle, which may run code when it is opened; write the array with `numpy.save` as .npy";

/// Extensions of formats that are not there, their names, and what converts them.
const EXTENSIONS: &[(&[&str], &str)] = &[
    (
        &["h5", "hdf5"],
        "HDF5; a single cloud is written with h5py: `numpy.save(\"cloud.npy\", file[\"data\"][0])`",
    ),
    (&["dxf", "dwg"], "a CAD drawing; export its points as .csv, or its meshes as .stl with FreeCAD"),
    (&["drc"], "Draco; unpack it with `draco_decoder -i FILE -o cloud.ply`"),
    (&["rcp", "rcs"], "Autodesk ReCap; export it as .e57 or .pts with ReCap"),
    (&["fls", "lsproj"], "a FARO scan; export it as .e57 with FARO SCENE"),
    (&["zfs", "zfc"], "a Zoller + Froehlich scan; export it as .e57 with Z+F LaserControl"),
    (&["rdbx", "rxp"], "a RIEGL scan; export it as .las or .e57 with RiSCAN PRO"),
    (&["bag", "db3"], "a ROS bag; write its clouds as .pcd, or convert it to MCAP"),
    (
        &[
            "fbx", "dae", "3ds", "blend", "3mf", "usd", "usda", "usdc", "usdz", "wrl", "vrml", "x3d", "ctm",
            "3dm", "skp", "max", "ma", "mb",
        ],
        "a scene; convert it to .obj or .ply with Blender",
    ),
    (
        &["step", "stp", "iges", "igs", "sat", "x_t", "sldprt", "catpart", "ipt", "ifc"],
        "a CAD model; mesh it as .stl or .obj with FreeCAD or Gmsh",
    ),
    (&["pkl", "pickle", "pt", "pth"], "pickled Python; write the array with `numpy.save` as .npy"),
    (&["mat"], "MATLAB; write the points with `writematrix(P, 'cloud.csv')`"),
    (
        &["pcap"],
        "packets of a scanner; write its clouds as .pcd or .las with the maker's program, such as VeloView",
    ),
    (&["splat", "ksplat", "spz"], "Gaussian splats; export them as .ply with SuperSplat"),
    (&["feather", "arrow", "ipc", "orc"], "a table in columns; write it as .parquet or .csv"),
    (&["nc", "zarr"], "arrays of many dimensions; write the points with `numpy.save` as .npy"),
    (&["ptg", "imp"], "a Leica scan; export it as .e57 or .pts with Cyclone"),
    (
        &["pnts", "b3dm", "osgb"],
        "a tile of a scene; convert it to .las or .ply with py3dtiles or CloudCompare",
    ),
    (&["mtl"], "the materials of an OBJ; name the .obj beside it"),
    (&["xlsx", "xls", "ods"], "a spreadsheet; save it as .csv"),
    (&["jpg", "jpeg", "png", "tif", "tiff", "exr"], "a picture, which is no cloud"),
];

/// What a file with this extension (in small letters) is, where that is known and not read.
pub(super) fn of_extension(extension: &str) -> Option<&'static str> {
    EXTENSIONS.iter().find(|(extensions, _)| extensions.contains(&extension)).map(|(_, name)| *name)
}
