//! Poses in text: numbers, or names and numbers as ROS prints them.

use super::matrix::{pose_of_matrix, pose_of_quaternion};
use super::{PoseFile, PoseFileError, PoseLayout, QuaternionOrder};

/// More rows than these are not looked at: a pose has four.
const MOST_ROWS: usize = 1_000_000;

/// The numbers of a line or of a row of an array.
pub(super) struct Row {
    /// The line, from 1; `None` in an array.
    pub line: Option<usize>,
    pub values: Vec<f64>,
}

/// What is known of a quaternion's order.
#[derive(Clone, Copy)]
pub(super) struct Titled {
    /// By a title of the file.
    pub order: Option<QuaternionOrder>,
    /// By the user.
    pub asked: Option<QuaternionOrder>,
}

/// Numbers apart by spaces, commas or semicolons, with or without brackets; `#`, `//` and `%` begin comments.
pub(super) fn parse(text: &str, asked: Option<QuaternionOrder>) -> Result<PoseFile, PoseFileError> {
    if let Some(pose) = named(text)? {
        return Ok(PoseFile {
            target_from_source: pose,
            layout: PoseLayout::Named,
            abstained: abstained(text),
        });
    }
    if let Some(pose) = super::titled::parse(text, abstained(text))? {
        return Ok(pose);
    }
    let mut titled = Titled { order: None, asked };
    let mut rows: Vec<Row> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let bare = ["#", "//", "%"].iter().fold(line, |line, mark| line.split(mark).next().unwrap_or(line));
        let decimal = with_decimal_points(bare);
        let bare = decimal.as_deref().unwrap_or(bare);
        let words = || bare.split(is_apart).filter(|word| !word.is_empty());
        let is_title = words().next().is_none_or(|word| word.parse::<f64>().is_err());
        if is_title && rows.is_empty() {
            titled.order = titled.order.or_else(|| order_of_title(line));
        }
        // A line of names alone, as a CSV file has it.
        let of_names = words().all(|word| word.parse::<f64>().is_err());
        // Names that say nothing of an order of numbers: it is that of the rows of a matrix, or the user says it.
        let (count, known) = (words().count(), order_of_title(line).is_some() || asked.is_some());
        let of_many = count > 11 || (count > 6 && known);
        if words().next().is_none() || (rows.is_empty() && of_names && of_many) {
            continue;
        }
        let value = |word: &str| {
            word.parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .ok_or_else(|| PoseFileError::Number { line: number, word: word.chars().take(40).collect() })
        };
        rows.push(Row { line: Some(number), values: words().map(value).collect::<Result<_, _>>()? });
        if rows.len() > MOST_ROWS {
            break;
        }
    }
    without_numbers_of_rows(text, &mut rows);
    Ok(PoseFile { abstained: abstained(text), ..pose_of_rows(&rows, titled)? })
}

/// The line with points in its numbers, where it has decimal commas and semicolons between the fields.
fn with_decimal_points(line: &str) -> Option<String> {
    let fields: Vec<&str> = line.split(';').map(str::trim).filter(|field| !field.is_empty()).collect();
    let decimal =
        |field: &&str| field.matches(',').count() < 2 && field.replace(',', ".").parse::<f64>().is_ok();
    let all = fields.len() > 2 && line.contains(',') && fields.iter().all(decimal);
    all.then(|| line.replace(',', "."))
}

/// Takes the numbers of columns and rows away that pandas writes: a first row 0, 1, 2, 3 and so on, and a first column.
/// Neither can be a part of a pose.
fn without_numbers_of_rows(text: &str, rows: &mut Vec<Row>) {
    let counts =
        |numbers: &mut dyn Iterator<Item = f64>| numbers.enumerate().all(|(place, n)| n == place as f64);
    let Some(first) = rows.first().map(|row| row.values.clone()) else { return };
    if !matches!(first.len(), 4 | 12 | 16) || rows.len() < 2 || !counts(&mut first.iter().copied()) {
        return;
    }
    let behind = first.len() + 1;
    let numbered = text.trim_start_matches([' ', '\r', '\n', '\u{feff}']).starts_with([',', ';', '\t'])
        && rows[1..].iter().all(|row| row.values.len() == behind)
        && counts(&mut rows[1..].iter().map(|row| row.values[0]));
    rows.remove(0);
    if numbered {
        rows.iter_mut().for_each(|row| {
            row.values.remove(0);
        });
    }
}

/// What stands between numbers.
fn is_apart(c: char) -> bool {
    c.is_whitespace() || matches!(c, ',' | ';' | '[' | ']' | '(' | ')')
}

/// Whether a comment says that the pose was abstained from.
fn abstained(text: &str) -> bool {
    text.lines()
        .any(|line| line.trim_start().strip_prefix('#').is_some_and(|c| c.trim().starts_with("abstain")))
}

/// The order of a quaternion in a title such as `# timestamp tx ty tz qx qy qz qw` or EuRoC's `q_RS_w [], q_RS_x []`.
fn order_of_title(line: &str) -> Option<QuaternionOrder> {
    let letters: Vec<char> = line
        .to_ascii_lowercase()
        .split(|c: char| {
            c.is_whitespace() || matches!(c, ',' | ';' | '#' | '/' | '%' | '[' | ']' | '(' | ')')
        })
        .filter(|word| word.starts_with('q') && word.len() > 1)
        .filter_map(|word| word.chars().last().filter(|last| "wxyz".contains(*last)))
        .collect();
    match letters[..] {
        ['x', 'y', 'z', 'w'] => Some(QuaternionOrder::Xyzw),
        ['w', 'x', 'y', 'z'] => Some(QuaternionOrder::Wxyz),
        _ => None,
    }
}

/// The pose that rows of numbers are, by their shape.
pub(super) fn pose_of_rows(rows: &[Row], titled: Titled) -> Result<PoseFile, PoseFileError> {
    let lengths: Vec<usize> = rows.iter().map(|row| row.values.len()).collect();
    let numbers = || rows.iter().flat_map(|row| row.values.iter().copied()).collect::<Vec<f64>>();
    let (pose, layout) = match lengths[..] {
        [4, 4, 4, 4] => (pose_of_matrix(&numbers())?, PoseLayout::Matrix4),
        [4, 4, 4] => (pose_of_matrix(&numbers())?, PoseLayout::Matrix3x4),
        [16] => (pose_of_matrix(&numbers())?, PoseLayout::Row16),
        [12] => (pose_of_matrix(&numbers())?, PoseLayout::Row12),
        [7 | 8] => {
            let order = titled.order.or(titled.asked).unwrap_or(QuaternionOrder::Xyzw);
            let numbers = numbers();
            let last: [f64; 7] =
                numbers.last_chunk().copied().ok_or_else(|| PoseFileError::Shape { rows: in_words(rows) })?;
            let layout = PoseLayout::Quaternion { order, titled: titled.order.is_some() };
            (pose_of_quaternion(last, order)?, layout)
        }
        // Sixteen numbers, one a line, or in lines of another length.
        _ if lengths.iter().all(|&length| length == 1) && matches!(lengths.len(), 12 | 16) => {
            let layout = if lengths.len() == 16 { PoseLayout::Row16 } else { PoseLayout::Row12 };
            (pose_of_matrix(&numbers())?, layout)
        }
        _ => return Err(wrong_shape(rows, &lengths)),
    };
    Ok(PoseFile { target_from_source: pose, layout, abstained: false })
}

fn wrong_shape(rows: &[Row], lengths: &[usize]) -> PoseFileError {
    let all = |n: usize| lengths.iter().all(|&length| length == n);
    match lengths.len() {
        poses @ 2.. if all(7) || all(8) || all(12) || all(16) => PoseFileError::Trajectory { poses },
        rows if rows > 4 && all(4) && rows.is_multiple_of(4) => PoseFileError::Trajectory { poses: rows / 4 },
        _ => PoseFileError::Shape { rows: in_words(rows) },
    }
}

/// Such as `2 rows of 4 and 3 numbers (lines 1 and 2)`.
fn in_words(rows: &[Row]) -> String {
    let odd = rows.iter().find(|row| row.values.len() != 4);
    match (rows.len(), odd) {
        (0, _) => "it has no numbers".into(),
        (_, Some(Row { line: Some(line), values })) => {
            format!("it has {} rows of numbers, and line {line} has {} numbers", rows.len(), values.len())
        }
        (n, Some(row)) => format!("it has {n} rows of {} numbers", row.values.len()),
        (n, None) => format!("it has {n} rows of 4 numbers"),
    }
}

/// A pose with names, as ROS prints it: `translation` or `position` with x, y and z, and `rotation` or `orientation` with
/// x, y, z and w, a line each.
fn named(text: &str) -> Result<Option<crate::Rigid>, PoseFileError> {
    #[derive(Clone, Copy, PartialEq)]
    enum Part {
        Place,
        Turn,
    }
    let mut part = None;
    let mut found = [None::<f64>; 7];
    for (number, line) in (1..).zip(text.lines()) {
        let Some((key, value)) = line.split('#').next().unwrap_or_default().split_once(':') else { continue };
        let (key, value) = (key.trim().trim_start_matches("- "), value.trim());
        match (key, value.is_empty()) {
            ("translation" | "position", true) => part = Some(Part::Place),
            ("rotation" | "orientation", true) => part = Some(Part::Turn),
            ("x" | "y" | "z" | "w", false) => {
                let axis = ["x", "y", "z", "w"].iter().position(|axis| *axis == key).unwrap_or(0);
                let slot = match part {
                    Some(Part::Place) if axis < 3 => axis,
                    Some(Part::Turn) => 3 + axis,
                    _ => continue,
                };
                let wrong = || PoseFileError::Number { line: number, word: value.chars().take(40).collect() };
                found[slot] =
                    Some(value.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(wrong)?);
            }
            _ => {}
        }
    }
    let [Some(x), Some(y), Some(z), Some(a), Some(b), Some(c), Some(d)] = found else { return Ok(None) };
    pose_of_quaternion([x, y, z, a, b, c, d], QuaternionOrder::Xyzw).map(Some)
}
