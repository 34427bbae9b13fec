//! The columns of text beside the place of the points, and text as the readers of each extension expect it.

use std::io::{self, Write};

use super::super::npy::known;
use super::super::outgoing::{COLOURS, INTENSITY};
use super::super::scalar::Scalar;
use super::super::scan::{number, put_number, put_single};
use super::super::{Attribute, AttributeValues, FormatError, Outgoing, ReadOptions};
use super::fields::{Records, is_missing};
use super::row::{Style, TextRow};

/// More columns than these are not attributes of points.
const MOST_COLUMNS: usize = 256;

/// The columns of a file that are not the place: their names, and their numbers, if all are numbers.
pub(super) struct OtherColumns {
    pub columns: Vec<(String, Option<Vec<f64>>)>,
}

/// Collects the columns row by row.
#[derive(Default)]
pub(super) struct ColumnCollector {
    /// Offset of the first row.
    first: Option<usize>,
    fields: usize,
    columns: Vec<(usize, Option<Vec<f64>>)>,
}

impl ColumnCollector {
    /// Takes a row, which begins at `start` in the file.
    pub fn take(
        &mut self,
        start: usize,
        text: &[u8],
        row: &TextRow,
        held: usize,
        options: &ReadOptions,
    ) -> Result<(), FormatError> {
        let is_place = |at: usize| row.places.iter().any(|place| place.start == at);
        if self.first.is_none() {
            self.first = Some(start);
            self.fields = row.style.fields(text).count();
            let others = row.style.fields(text).enumerate().filter(|(_, (at, _))| !is_place(*at));
            // A separator at the end of a line closes it, but where the title has a name for what follows.
            self.columns = others
                .filter(|(index, (_, word))| {
                    !word.is_empty() || index + 1 < self.fields || *index < row.width
                })
                .map(|(index, _)| (index, Some(Vec::new())))
                .take(MOST_COLUMNS)
                .collect();
        }
        if self.columns.is_empty() {
            return Ok(());
        }
        let words: Vec<&[u8]> = row.style.fields(text).map(|(_, word)| word).collect();
        for (index, values) in &mut self.columns {
            let Some(list) = values else { continue };
            let word = words.get(*index).copied().unwrap_or_default();
            match decimal(row.style, word) {
                Some(value) => {
                    options.grow("the columns", held, list)?;
                    list.push(value);
                }
                None => *values = None,
            }
        }
        Ok(())
    }

    /// The columns with their names: those of the title, of a PTS file, or their numbers.
    pub fn finish(self, bytes: &[u8], is_pts: bool) -> OtherColumns {
        let names = self.first.and_then(|first| title(bytes, first, self.fields));
        let of_pts: &[&str] = match (is_pts, self.fields) {
            (true, 4) => &[INTENSITY],
            (true, 6) => &COLOURS,
            (true, 7) => &[INTENSITY, "red", "green", "blue"],
            _ => &[],
        };
        let named = |place: usize, index: usize| match (&names, of_pts.get(place)) {
            (Some(names), _) if !names[index].is_empty() => known(&names[index]),
            (None, Some(name)) => (*name).to_owned(),
            _ => format!("column_{}", index + 1),
        };
        let columns = self.columns.into_iter().enumerate();
        OtherColumns { columns: columns.map(|(place, (index, v))| (named(place, index), v)).collect() }
    }
}

fn decimal(style: Style, word: &[u8]) -> Option<f64> {
    if let Ok(value) = number(word) {
        return Some(value);
    }
    if is_missing(word) {
        return Some(f64::NAN);
    }
    let spaced = matches!(style, Style::SpaceDecimalComma | Style::Semicolon | Style::Tab);
    let comma = spaced && word.contains(&b',');
    let point: Vec<u8> = word.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
    number(&point).ok().filter(|_| comma)
}

/// The names of a title before the first row that has as many fields as that.
fn title(bytes: &[u8], first: usize, fields: usize) -> Option<Vec<String>> {
    let head = bytes.get(..first)?;
    let names = |text: &[u8]| -> Option<Vec<String>> {
        let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text).trim_ascii();
        let bare = text.strip_prefix(b"//").unwrap_or(text);
        let bare = bare.strip_prefix(b"#").unwrap_or(bare);
        let words: Vec<&[u8]> = Style::of(bare).fields(bare).map(|(_, name)| name).collect();
        let is_title = words.len() == fields && words.iter().any(|word| number(word).is_err());
        is_title.then(|| words.iter().map(|w| String::from_utf8_lossy(w).trim().to_owned()).collect())
    };
    Records::new(head).filter_map(|line| names(line.text)).last()
}

impl OtherColumns {
    /// Those of numbers, each in the smallest type that holds them.
    pub fn attributes(self) -> Vec<Attribute> {
        let numbers = self.columns.into_iter().filter_map(|(name, values)| Some((name, values?)));
        numbers.map(|(name, list)| Attribute { values: smallest(&list), name }).collect()
    }

    /// Names of those that are no numbers.
    pub fn words(&self) -> Vec<String> {
        self.columns.iter().filter(|(_, values)| values.is_none()).map(|(name, _)| name.clone()).collect()
    }
}

/// The numbers in the smallest type that holds them.
pub(in super::super) fn smallest(list: &[f64]) -> AttributeValues {
    let whole = |least: f64, most: f64| {
        list.iter().all(|value| value.fract() == 0.0 && (least..=most).contains(value))
    };
    let kind = match () {
        () if whole(0.0, 255.0) => Scalar::U8,
        () if whole(0.0, 65535.0) => Scalar::U16,
        () if whole(f64::from(i32::MIN), f64::from(i32::MAX)) => Scalar::I32,
        () if list.iter().all(|&value| fits_single(value)) => Scalar::F32,
        () => Scalar::F64,
    };
    kind.of_numbers(list)
}

/// Whether single precision, written in its fewest digits, is the same decimal number.
pub(in super::super) fn fits_single(value: f64) -> bool {
    if !value.is_finite() {
        return true;
    }
    let mut text = Vec::with_capacity(24);
    put_single(&mut text, value as f32);
    number(&text).is_ok_and(|back| back == value)
}

/// Whether the columns of a file with this extension have room for an attribute.
pub(super) fn keeps(attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
    if cloud.extension != "pts" {
        return true;
    }
    attribute.name == INTENSITY || (COLOURS.contains(&&*attribute.name) && cloud.colours().is_some())
}

/// Writes text: `.csv` with a title and commas, `.pts` with the number of points first, all others with spaces and a
/// title behind `#` where there is more than the place.
pub(super) fn write(cloud: &Outgoing<'_>, out: &mut dyn Write) -> io::Result<()> {
    let pts = cloud.extension == "pts";
    let colours = if pts { cloud.colours().map(|(colours, _)| colours) } else { None };
    let mut kept: Vec<&Attribute> = cloud.attributes.iter().filter(|a| keeps(a, cloud)).collect();
    if pts {
        kept.retain(|attribute| attribute.name == INTENSITY);
    }
    let separator = if cloud.extension == "csv" { b',' } else { b' ' };
    let names = ["x", "y", "z"].into_iter().map(str::to_owned).chain(kept.iter().map(|a| plain(&a.name)));
    match cloud.extension {
        "pts" => writeln!(out, "{}", cloud.points.len())?,
        "csv" => writeln!(out, "{}", names.collect::<Vec<_>>().join(","))?,
        _ if !kept.is_empty() => writeln!(out, "# {}", names.collect::<Vec<_>>().join(" "))?,
        _ => {}
    }
    let mut row = Vec::with_capacity(96);
    for (index, point) in cloud.points.iter().enumerate() {
        row.clear();
        for (axis, &value) in point.iter().enumerate() {
            if axis > 0 {
                row.push(separator);
            }
            if cloud.single { put_single(&mut row, value as f32) } else { put_number(&mut row, value) }
        }
        for attribute in &kept {
            row.push(separator);
            attribute.values.put_text(index, &mut row);
        }
        for part in colours.iter().flat_map(|colours| colours[index]) {
            row.push(separator);
            row.extend(part.to_string().bytes());
        }
        row.push(b'\n');
        out.write_all(&row)?;
    }
    Ok(())
}

/// A name that is one word in any file.
fn plain(name: &str) -> String {
    let separates = |c: char| c.is_whitespace() || c.is_control() || ",;\"#".contains(c);
    name.chars().map(|c| if separates(c) { '_' } else { c }).collect()
}
