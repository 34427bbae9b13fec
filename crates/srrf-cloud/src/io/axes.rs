//! Which of the named columns of a file are x, y and z.

use super::{ColumnName, FormatError, PointColumns};

/// Names of the coordinates in bare letters, apart from `x` and what is made of it.
const SYNONYMS: [&[&str]; 3] = [
    &["easting", "eastings", "east", "utmx", "utmeast", "utme", "eastingm", "rechtswert", "ostwert"],
    &["northing", "northings", "north", "utmy", "utmnorth", "utmn", "hochwert", "nordwert"],
    &["height", "elevation", "altitude", "elev", "alt", "up", "utmz", "elevationz", "höhe", "hoehe"],
];
/// What stands before or behind the letter of an axis, or the number 0, 1, 2.
const AROUND: &[&str] = &[
    "",
    "p",
    "pos",
    "position",
    "coord",
    "coords",
    "coordinate",
    "coordinates",
    "point",
    "points",
    "pt",
    "cartesian",
    "location",
    "loc",
    "xyz",
    "vertex",
    "field",
    "local",
    "global",
    "world",
    "map",
    "lidar",
    "sensor",
    "cloud",
];
/// Degrees, in bare letters.
const DEGREES: &[&str] = &["lon", "long", "lng", "longitude", "lat", "latitude", "londeg", "latdeg"];

/// What the names say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axes {
    /// The columns of x, y and z.
    Found([usize; 3]),
    /// Longitude and latitude.
    Degrees,
    /// Nothing.
    Unknown,
}

/// In small letters and digits, without a unit behind it.
fn bare(name: &str) -> String {
    let name = name.trim().trim_matches(['"', '\'', '#', '/', '%']).trim().to_lowercase();
    // `x [m]`, `x (m)`, `x_m`, `x / m`.
    let name = name.split(['[', '(', '{']).next().unwrap_or_default().trim();
    let unit = [
        "_m", " m", "_mm", " mm", "_cm", " cm", "_km", " km", "_ft", " ft", "_in", "/m", "/ m", "_metres",
        "_meters",
    ];
    let name = unit.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    name.chars().filter(|c| c.is_alphanumeric()).collect()
}

/// How well a name fits an axis; small is better.
fn rank(name: &str, axis: usize) -> Option<usize> {
    let letter = ["x", "y", "z"][axis];
    if name == letter {
        return Some(0);
    }
    let number = ["0", "1", "2"][axis];
    let made = |around: &&&str| {
        name.strip_prefix(**around) == Some(letter)
            || name.strip_suffix(**around) == Some(letter)
            || (around.len() > 1 && name.strip_prefix(**around) == Some(number))
    };
    if AROUND.iter().any(|around| made(&around)) {
        return Some(1);
    }
    SYNONYMS[axis].contains(&name).then_some(2)
}

/// What `names` say of x, y and z.
pub(super) fn find(names: &[String]) -> Axes {
    let bare: Vec<String> = names.iter().map(|name| bare(name)).collect();
    let best = |axis: usize| {
        let ranked = bare.iter().enumerate().filter_map(|(column, name)| Some((rank(name, axis)?, column)));
        let ranked: Vec<(usize, usize)> = ranked.collect();
        let best = ranked.iter().map(|(rank, _)| *rank).min()?;
        let mut columns = ranked.iter().filter(|(rank, _)| *rank == best).map(|(_, column)| *column);
        // Two of a kind cannot be told apart.
        columns.next().filter(|_| columns.next().is_none()).map(|column| (best, column))
    };
    if let [Some((a, x)), Some((b, y)), Some((_, z))] = [0, 1, 2].map(best)
        // An easting beside a y is no frame.
        && (a == 2) == (b == 2)
    {
        return Axes::Found([x, y, z]);
    }
    if bare.iter().filter(|name| DEGREES.contains(&name.as_str())).count() >= 2 {
        return Axes::Degrees;
    }
    Axes::Unknown
}

/// The columns of x, y and z among `names`, as asked or as the names say.
///
/// # Errors
/// [`FormatError::Unclear`] with all names; [`FormatError::Content`] for degrees.
pub(super) fn choose(names: &[String], asked: Option<&PointColumns>) -> Result<[usize; 3], FormatError> {
    let list = || {
        // Names are others' words: short, and without control characters.
        let short = |name: &String| match name.is_empty() {
            true => "(no name)".to_owned(),
            false => name.chars().take(24).map(|c| if c.is_control() { '?' } else { c }).collect(),
        };
        let shown: Vec<String> = names.iter().take(16).map(short).collect();
        format!("{}{}", shown.join(", "), if names.len() > 16 { ", ..." } else { "" })
    };
    let Some(PointColumns(asked)) = asked else {
        return match find(names) {
            Axes::Found(axes) => Ok(axes),
            Axes::Degrees => Err(FormatError::Content(format!(
                "the columns are {}: longitude and latitude are degrees and no lengths; convert them to metres first (UTM, \
                 with pyproj or `pdal translate` and filters.reprojection), or name other columns with `--columns`",
                list()
            ))),
            Axes::Unknown => Err(FormatError::unclear(
                format!("the columns are {}, and they do not say which three are x, y and z", list()),
                "--columns",
            )),
        };
    };
    let mut axes = [0; 3];
    for (slot, wanted) in axes.iter_mut().zip(asked) {
        let exact = |name: &str| names.iter().position(|known| known.trim() == name);
        let loose = |name: &str| names.iter().position(|known| known.trim().eq_ignore_ascii_case(name));
        let found = match wanted {
            ColumnName::Name(name) => exact(name).or_else(|| loose(name)),
            ColumnName::Number(number) => {
                exact(&number.to_string()).or((*number <= names.len()).then(|| number - 1))
            }
        };
        *slot = found.ok_or_else(|| {
            FormatError::unclear(
                format!("there is no column {wanted}; the columns are {}", list()),
                "--columns",
            )
        })?;
    }
    Ok(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(names: &str) -> Axes {
        find(&names.split('|').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn names_of_coordinates() {
        for (names, found) in [
            ("x|y|z", [0, 1, 2]),
            ("Z|id|Y|X", [3, 2, 0]),
            ("x [m]|y [m]|z [m]", [0, 1, 2]),
            ("X_m|Y_m|Z_m", [0, 1, 2]),
            ("t|pos_x|pos_y|pos_z", [1, 2, 3]),
            ("position.x|position.y|position.z", [0, 1, 2]),
            ("Points:0|Points:1|Points:2|Normals:0", [0, 1, 2]),
            ("px|py|pz|nx|ny|nz", [0, 1, 2]),
            ("coord_x|coord_y|coord_z", [0, 1, 2]),
            ("Easting (m)|Northing (m)|Height (m)", [0, 1, 2]),
            ("northing|easting|elevation", [1, 0, 2]),
            ("Easting|Northing|altitude", [0, 1, 2]),
            ("easting|northing|z|height", [0, 1, 2]),
            ("east|north|up", [0, 1, 2]),
            ("vx|vy|vz|x|y|z", [3, 4, 5]),
            ("time|field.header.seq|field.x|field.y|field.z", [2, 3, 4]),
            ("x_lidar|y_lidar|z_lidar", [0, 1, 2]),
            ("LocalX|LocalY|LocalZ", [0, 1, 2]),
            ("vertex.x|vertex.y|vertex.z", [0, 1, 2]),
            ("Rechtswert|Hochwert|Höhe", [0, 1, 2]),
            ("lon|lat|x|y|z", [2, 3, 4]),
        ] {
            assert_eq!(axes(names), Axes::Found(found), "{names}");
        }
        for names in ["lon|lat|alt", "Latitude|Longitude|Height"] {
            assert_eq!(axes(names), Axes::Degrees, "{names}");
        }
        for names in [
            "a|b|c",
            "x|y",
            "x|X|y|z",
            "nx|ny|nz",
            "vx|vy|vz",
            "easting|y|z",
            "u|v|w",
            "x_lidar|y_lidar|z_lidar|x_map|y_map|z_map",
            "pose.position.x|pose.position.y|pose.position.z",
        ] {
            assert_eq!(axes(names), Axes::Unknown, "{names}");
        }
    }

    #[test]
    fn what_is_asked_counts() {
        let names: Vec<String> = ["a", "b", "c", "0"].map(str::to_owned).to_vec();
        let choose = |asked: &str| choose(&names, Some(&asked.parse().unwrap()));
        assert_eq!(choose("c,A,b"), Ok([2, 0, 1]));
        assert_eq!(choose("3,2,1"), Ok([2, 1, 0]));
        let error = choose("a,b,d").unwrap_err().to_string();
        assert!(
            error.contains("no column d") && error.contains("a, b, c, 0") && error.contains("--columns"),
            "{error}"
        );
        let error = super::choose(&names, None).unwrap_err().to_string();
        assert!(error.contains("a, b, c, 0") && error.contains("`--columns`"), "{error}");
    }
}
