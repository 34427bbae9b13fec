//! Poses in tables: a title with the names of the columns, and one row of numbers.

use std::collections::BTreeMap;

use super::matrix::{pose_of_matrix, pose_of_quaternion};
use super::{PoseFile, PoseFileError, PoseLayout, QuaternionOrder};
use crate::Rigid;

/// A table as it is in a text.
struct TitledRow<'a> {
    title: Vec<&'a str>,
    /// Number of the first row, from 1.
    line: usize,
    row: Vec<&'a str>,
    rows: usize,
}

impl TitledRow<'_> {
    /// Whether all fields are numbers, the last seven in the order x, y, z and x, y, z, w or w, x, y, z.
    fn is_plain(&self, places: &[usize]) -> bool {
        let first = self.row.len().saturating_sub(7);
        let of = |orders: [usize; 7]| places.iter().zip(orders).all(|(place, order)| *place == first + order);
        let named =
            places.iter().skip(3).all(|&place| self.title[place].to_ascii_lowercase().starts_with('q'));
        self.row.len() < 9
            && named
            && self.row.iter().all(|field| field.parse::<f64>().is_ok())
            && (of([0, 1, 2, 3, 4, 5, 6]) || of([0, 1, 2, 4, 5, 6, 3]))
    }
}

/// The pose of a table whose title names its columns; `None` for a text that is none, or whose title says nothing.
///
/// # Errors
/// [`PoseFileError`] for a column of a pose that holds no number, and for several rows.
pub(super) fn parse(text: &str, abstained: bool) -> Result<Option<PoseFile>, PoseFileError> {
    let Some(table) = table(text) else { return Ok(None) };
    let columns = PoseColumns::of(&table.title);
    if table.rows > 1 && !matches!(columns, PoseColumns::Unknown) {
        return Err(PoseFileError::Trajectory { poses: table.rows });
    }
    let (pose, layout) = match columns {
        PoseColumns::Unknown => return Ok(None),
        // As TUM and EuRoC have them: known without a table.
        PoseColumns::Quaternion(places) if table.is_plain(&places) => return Ok(None),
        PoseColumns::Quaternion(places) => {
            let numbers = numbers(&table, &places)?;
            let numbers = numbers.try_into().unwrap_or([f64::NAN; 7]);
            (pose_of_quaternion(numbers, QuaternionOrder::Xyzw)?, PoseLayout::Named)
        }
        PoseColumns::Matrix(places) => (matrix(&table, &places)?, PoseLayout::NamedMatrix),
    };
    Ok(Some(PoseFile { target_from_source: pose, layout, abstained }))
}

/// The title and the rows, if the first line that is no comment (or the last comment, as EuRoC writes it) has as many
/// names as the next one has fields.
fn table(text: &str) -> Option<TitledRow<'_>> {
    let mut title = "";
    let mut rows = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let (line, first) = loop {
        let (number, line) = rows.next()?;
        let bare = line.trim().trim_start_matches(['#', '%', '/']);
        let names = fields(bare).iter().all(|field| field.replacen(',', ".", 1).parse::<f64>().is_err());
        if !names && bare == line.trim() {
            break (number, line);
        }
        title = bare;
    };
    let (title, row) = (fields(title), fields(first));
    let begins = |line: &str| line.trim_start().starts_with(['#', '%', '/']);
    let rows = 1 + rows.filter(|(_, line)| !begins(line)).count();
    (title.len() == row.len() && title.len() > 1).then_some(TitledRow { title, line, row, rows })
}

/// The fields of a line, apart by semicolons, tabs, commas or blanks: the first of them that there is.
fn fields(line: &str) -> Vec<&str> {
    match [';', '\t', ','].into_iter().find(|mark| line.contains(*mark)) {
        Some(mark) => line.split(mark).map(unquoted).collect(),
        None => line.split_whitespace().map(unquoted).collect(),
    }
}

fn unquoted(field: &str) -> &str {
    field.trim().trim_matches(['"', '\'']).trim()
}

/// What the names of columns say.
enum PoseColumns {
    /// Places of tx, ty, tz, qx, qy, qz and qw.
    Quaternion(Vec<usize>),
    /// Places of the numbers of a matrix by row and column, from 0.
    Matrix(BTreeMap<(usize, usize), usize>),
    Unknown,
}

impl PoseColumns {
    fn of(title: &[&str]) -> Self {
        let names: Vec<String> = title.iter().map(|name| bare(name)).collect();
        let turn = ["x", "y", "z", "w"].map(|axis| only(&names, |name| is_turn(name, axis)));
        let place = ["x", "y", "z"].map(|axis| only(&names, |name| is_place(name, axis)));
        if let ([Some(x), Some(y), Some(z)], [Some(a), Some(b), Some(c), Some(d)]) = (place, turn) {
            return Self::Quaternion(vec![x, y, z, a, b, c, d]);
        }
        let mut cells = cells(&names);
        for (axis, found) in place.into_iter().enumerate() {
            let number =
                |from: usize| ["t", "trans", "translation"].map(|part| format!("{part}{}", axis + from));
            let found = found.or_else(|| {
                let from = usize::from(
                    !names.iter().any(|name| ["t0", "trans0", "translation0"].contains(&&**name)),
                );
                only(&names, |name| number(from).iter().any(|number| number == name))
            });
            if let Some(found) = found {
                cells.entry((axis, 3)).or_insert(found);
            }
        }
        let whole = (0..3).all(|row| (0..4).all(|column| cells.contains_key(&(row, column))));
        if whole { Self::Matrix(cells) } else { Self::Unknown }
    }
}

/// In small letters and digits, without a unit in brackets.
fn bare(name: &str) -> String {
    let name = name.split(['[', '(', '{']).next().unwrap_or_default();
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The one place for which `is` holds.
fn only(names: &[String], is: impl Fn(&str) -> bool) -> Option<usize> {
    let mut places = names.iter().enumerate().filter(|(_, name)| is(name)).map(|(place, _)| place);
    places.next().filter(|_| places.next().is_none())
}

/// Whether a name such as `qx`, `q_RS_x` or `orientation.x` is a part of a quaternion.
fn is_turn(name: &str, axis: &str) -> bool {
    name.strip_suffix(axis).is_some_and(|part| {
        part.starts_with('q')
            || ["orientation", "rotation", "quat", "quaternion", "rot"].iter().any(|w| part.ends_with(w))
    })
}

/// Whether a name such as `x`, `tx`, `p_RS_R_x` or `position.x` is a part of a place.
fn is_place(name: &str, axis: &str) -> bool {
    name.strip_suffix(axis).is_some_and(|part| {
        ["", "t", "p", "prsr"].contains(&part)
            || ["pos", "position", "trans", "translation", "loc", "location"]
                .iter()
                .any(|w| part.ends_with(w))
    })
}

/// The numbers of a matrix: names that end with a row and a column, both from 0 or both from 1.
fn cells(names: &[String]) -> BTreeMap<(usize, usize), usize> {
    let digits = |name: &String| {
        let tail: Vec<usize> =
            name.chars().rev().take(2).map_while(|c| Some(c.to_digit(10)? as usize)).collect();
        let letters = name.chars().rev().nth(2).is_none_or(|c| !c.is_ascii_digit());
        match tail[..] {
            [column, row] if letters => Some((row, column)),
            _ => None,
        }
    };
    let found: Vec<((usize, usize), usize)> =
        names.iter().enumerate().filter_map(|(place, name)| Some((digits(name)?, place))).collect();
    let from = usize::from(!found.iter().any(|((row, column), _)| *row == 0 || *column == 0));
    let mut cells = BTreeMap::new();
    for ((row, column), place) in found {
        let key = (row.wrapping_sub(from), column.wrapping_sub(from));
        // Two of one name cannot be told apart.
        if key.0 > 3 || key.1 > 3 || cells.insert(key, place).is_some() {
            return BTreeMap::new();
        }
    }
    cells
}

fn number(table: &TitledRow, place: usize) -> Result<f64, PoseFileError> {
    let word = table.row.get(place).copied().unwrap_or_default();
    // Spreadsheets of many countries write a decimal comma, and semicolons between the fields.
    let decimal = word.replacen(',', ".", 1);
    let parsed = decimal.parse().ok().filter(|value: &f64| value.is_finite());
    parsed.ok_or_else(|| PoseFileError::Number { line: table.line, word: word.chars().take(40).collect() })
}

fn numbers(table: &TitledRow, places: &[usize]) -> Result<Vec<f64>, PoseFileError> {
    places.iter().map(|place| number(table, *place)).collect()
}

fn matrix(table: &TitledRow, places: &BTreeMap<(usize, usize), usize>) -> Result<Rigid, PoseFileError> {
    let rows = if (0..4).all(|column| places.contains_key(&(3, column))) { 4 } else { 3 };
    let cells = (0..rows).flat_map(|row| (0..4).map(move |column| (row, column)));
    let numbers: Vec<f64> = cells
        .filter_map(|cell| places.get(&cell))
        .map(|place| number(table, *place))
        .collect::<Result<_, _>>()?;
    pose_of_matrix(&numbers)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::EulerXyz;

    fn truth() -> Rigid {
        let rotation = EulerXyz::from_deg([10.0, -40.0, 75.0]).to_matrix();
        Rigid { rotation, translation: Vector3::new(1.5, -2.25, 300.125) }
    }

    fn read(text: &str) -> Result<PoseFile, PoseFileError> {
        PoseFile::parse(text.as_bytes(), None)
    }

    fn check<'a>(text: &str, layout: impl Into<Option<&'a PoseLayout>>) {
        let pose = read(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let off = (pose.target_from_source.to_matrix4() - truth().to_matrix4()).abs().max();
        assert!(off < 1e-12, "{text}: {off}");
        if let Some(layout) = layout.into() {
            assert_eq!(pose.layout, *layout, "{text}");
        }
    }

    #[test]
    fn quaternions_by_the_names_of_their_columns() {
        let [x, y, z] = <[f64; 3]>::from(truth().translation);
        let [a, b, c, d] = truth().quaternion_xyzw();
        for text in [
            format!("tx,ty,tz,qx,qy,qz,qw\n{x},{y},{z},{a},{b},{c},{d}\n"),
            format!("tx,ty,tz,qw,qx,qy,qz\r\n{x},{y},{z},{d},{a},{b},{c}\r\n"),
            format!("qw,qx,qy,qz,x,y,z\n{d},{a},{b},{c},{x},{y},{z}"),
            format!(",name,time,pos_x,pos_y,pos_z,q_x,q_y,q_z,q_w\n0,a.ply,17,{x},{y},{z},{a},{b},{c},{d}\n"),
            format!(
                "\"x [m]\";\"y [m]\";\"z [m]\";\"qx\";\"qy\";\"qz\";\"qw\"\n{x};{y};{z};{a};{b};{c};{d}\n"
            )
            .replace('.', ","),
            format!("name;qw;qx;qy;qz;x;y;z\na.ply;{d};{a};{b};{c};{x};{y};{z}\n").replace('.', ","),
            format!("# timestamp tx ty tz qx qy qz qw\n5 {x} {y} {z} {a} {b} {c} {d}\n"),
            format!(
                "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x \
                 [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]\n14,{x},{y},{z},{d},{a},{b},{c},7,8,9\n"
            ),
            format!(
                "position.x,position.y,position.z,orientation.x,orientation.y,orientation.z,orientation.w\n{x},{y},{z},{a},{b},\
                 {c},{d}\n"
            ),
        ] {
            check(&text, None);
        }
        // Which of q0 to q3 is w, their names do not say; the user may.
        let numbered = format!("x,y,z,q0,q1,q2,q3\n{x},{y},{z},{d},{a},{b},{c}\n");
        assert!(matches!(read(&numbered), Err(PoseFileError::Number { line: 1, .. })));
        let said = PoseFile::parse(numbered.as_bytes(), Some(QuaternionOrder::Wxyz)).unwrap();
        assert!((said.target_from_source.to_matrix4() - truth().to_matrix4()).abs().max() < 1e-12);
        let two = "tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1,0,0,0,0,0,1\n";
        assert_eq!(read(two), Err(PoseFileError::Trajectory { poses: 2 }));
        let word = read("tx,ty,tz,qx,qy,qz,qw\n0,0,zero,0,0,0,1\n").unwrap_err().to_string();
        assert!(word.contains("line 2: \"zero\" is not a finite number"), "{word}");
    }

    #[test]
    fn matrices_by_the_names_of_their_columns() {
        let m = truth().to_matrix4();
        let cells = |rows: usize, name: &dyn Fn(usize, usize) -> String, by_column: bool| {
            let order: Vec<(usize, usize)> = match by_column {
                true => (0..4).flat_map(|c| (0..rows).map(move |r| (r, c))).collect(),
                false => (0..rows).flat_map(|r| (0..4).map(move |c| (r, c))).collect(),
            };
            let title: Vec<String> = order.iter().map(|&(r, c)| name(r, c)).collect();
            let row: Vec<String> = order.iter().map(|&(r, c)| m[(r, c)].to_string()).collect();
            format!("{}\n{}\n", title.join(","), row.join(","))
        };
        for by_column in [false, true] {
            for text in [
                cells(4, &|r, c| format!("m{r}{c}"), by_column),
                cells(4, &|r, c| format!("T_{}_{}", r + 1, c + 1), by_column),
                cells(
                    3,
                    &|r, c| if c == 3 { format!("t{}", r + 1) } else { format!("r{}{}", r + 1, c + 1) },
                    by_column,
                ),
                cells(
                    3,
                    &|r, c| if c == 3 { ["tx", "ty", "tz"][r].into() } else { format!("R{r}{c}") },
                    by_column,
                ),
                cells(
                    3,
                    &|r, c| {
                        if c == 3 { format!("t{r}") } else { format!("R[{r}][{c}]").replace(['[', ']'], "_") }
                    },
                    by_column,
                ),
            ] {
                check(&text, &PoseLayout::NamedMatrix);
            }
        }
        // Names that say nothing: row by row.
        let letters = cells(4, &|r, c| char::from(b'a' + (4 * r + c) as u8).to_string(), false);
        check(&letters, &PoseLayout::Row16);
    }

    #[test]
    fn tables_as_pandas_writes_them() {
        let m = truth().to_matrix4();
        let row = |r: usize| (0..4).map(|c| m[(r, c)].to_string()).collect::<Vec<_>>().join(",");
        check(&format!("0,1,2,3\n{}\n{}\n{}\n{}\n", row(0), row(1), row(2), row(3)), &PoseLayout::Matrix4);
        check(
            &format!(",0,1,2,3\n0,{}\n1,{}\n2,{}\n3,{}\n", row(0), row(1), row(2), row(3)),
            &PoseLayout::Matrix4,
        );
        check(
            &format!(",0,1,2,3\n0,{}\n1,{}\n2,{}\n3,{}\n", row(0), row(1), row(2), row(3)).replace(',', "\t"),
            &PoseLayout::Matrix4,
        );
        check(&format!("0,1,2,3\n{}\n{}\n{}\n", row(0), row(1), row(2)), &PoseLayout::Matrix3x4);
        let numbers: Vec<String> = (0..12).map(|n| n.to_string()).collect();
        check(&format!("{}\n{},{},{}\n", numbers.join(","), row(0), row(1), row(2)), &PoseLayout::Row12);
        let decimal = format!("{};{};{}\n", row(0), row(1), row(2)).replace(',', ";").replace('.', ",");
        check(&decimal, &PoseLayout::Row12);
    }
}
