//! The title of a text, and which columns are the points.

use super::super::scan::{Line, number, words};
use super::super::{FormatError, ReadOptions, axes};
use super::fields::{is_missing, without_quoted};
use super::row::{Style, Table};

/// Longest line that may be a title.
const LONGEST: usize = 1 << 20;

/// What stands before the first point.
#[derive(Default)]
pub(super) struct TitleNames<'a> {
    /// A line of words that is no comment.
    pub title: Option<&'a [u8]>,
    /// Comments, the last ones.
    pub comments: Vec<&'a [u8]>,
}

/// Without the mark of a comment.
fn uncommented(text: &[u8]) -> &[u8] {
    let text = text.trim_ascii();
    text.iter().position(|b| !b"#/%".contains(b)).map_or(&text[..0], |at| text[at..].trim_ascii())
}

/// Whether a line begins as a comment.
pub(super) fn is_comment(text: &[u8]) -> bool {
    let text = text.trim_ascii();
    let begins = |text: &[u8]| {
        let end = text.iter().position(|b| b",;\t ".contains(b)).unwrap_or(text.len());
        is_missing(&text[..end])
    };
    (text.starts_with(b"#") && !begins(text)) || text.starts_with(b"//") || text.starts_with(b"%")
}

/// Whether a line has separators only.
pub(super) fn is_blank(text: &[u8]) -> bool {
    text.iter().all(|b| b",;\t ".contains(b))
}

/// Whether a line tells Excel what separates, such as `sep=;`.
pub(super) fn says_separator(text: &[u8]) -> bool {
    let bare = text.strip_prefix(b"\"").unwrap_or(text);
    text.len() <= 8 && bare.get(..4).is_some_and(|word| word.eq_ignore_ascii_case(b"sep="))
}

/// Whether a line is made of words, and of no number. Words that stand for nothing are a row, where there is a title
/// already.
pub(super) fn is_title(text: &[u8], titled: bool) -> bool {
    if text.len() > LONGEST || text.iter().any(|b| b.is_ascii_control() && !b"\t\r\n".contains(b)) {
        return false;
    }
    let mut fields = Style::of(text).fields(text).filter(|(_, field)| !field.is_empty()).peekable();
    let missing = |mut all: super::fields::Fields<'_>| match titled {
        true => all.any(|(_, field)| !field.is_empty() && is_missing(field)),
        false => all.all(|(_, field)| is_missing(field)),
    };
    if missing(Style::of(text).fields(text)) {
        return false;
    }
    let word = |field: &[u8]| {
        field.first().is_some_and(|b| b.is_ascii_alphabetic() || !b.is_ascii() || b"\"'_#/[(".contains(b))
    };
    fields.peek().is_some() && fields.all(|(_, field)| word(field) && number(field).is_err())
}

/// Whether a line is 0, 1, 2 and so on, as pandas titles columns without names, and `next` is made of decimals.
pub(super) fn is_numbered(text: &[u8], next: &[u8]) -> bool {
    if text.len() > LONGEST || !text.contains(&b',') {
        return false;
    }
    let mut fields: Vec<&[u8]> = Style::Comma.fields(text).map(|(_, field)| field).collect();
    let index = fields.first().is_some_and(|field| field.is_empty());
    if index {
        fields.remove(0);
    }
    let in_turn = fields.iter().enumerate().all(|(n, field)| *field == n.to_string().as_bytes());
    fields.len() >= 3 && in_turn && (index || next.contains(&b'.'))
}

/// The names in a title.
pub(super) fn names(title: &[u8]) -> Vec<String> {
    let text = uncommented(title);
    let bare = without_quoted(text);
    let separator = [b';', b'\t', b','].into_iter().find(|byte| bare.contains(byte));
    let name = |word: &[u8]| {
        let text = String::from_utf8_lossy(word.trim_ascii());
        text.trim_matches('"').split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let mut names: Vec<String> = match separator {
        Some(separator) => {
            let mut begin = 0;
            let parts = bare.split(|&byte| byte == separator).map(|part| {
                let part = begin..begin + part.len();
                begin = part.end + 1;
                name(&text[part])
            });
            parts.collect()
        }
        None => {
            let mut names: Vec<String> = Vec::new();
            for (_, word) in words(text) {
                // `x [m]` is one name.
                match names.last_mut().filter(|_| word.starts_with(b"[") || word.starts_with(b"(")) {
                    Some(last) => last.push_str(&format!(" {}", name(word))),
                    None => names.push(name(word)),
                }
            }
            names
        }
    };
    while names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    names
}

/// Fields of a row, those apart that are empty at its end.
pub(super) fn width(style: Style, text: &[u8]) -> usize {
    let fields = style.fields(text).enumerate();
    fields.filter(|(_, (_, field))| !field.is_empty()).last().map_or(0, |(index, _)| index + 1)
}

/// The columns of x, y and z, from what stands before the `first` point and the line after it; how many columns a
/// title announces; and whether nothing said which they are.
///
/// # Errors
/// [`FormatError`] where a title does not say them.
pub(super) fn columns_of(
    heads: &TitleNames,
    first: &Line,
    next: &[u8],
    table: &Table,
    options: &ReadOptions,
) -> Result<([usize; 3], usize, bool), FormatError> {
    let width = width(table.style(first.text), first.text);
    let shift = |names: &[String]| usize::from(width == names.len() + 1 && has_index(first.text, next));
    let asked = options.columns.as_ref();
    if let Some(title) = heads.title {
        let names = names(title);
        if names.len() >= 3 {
            let shift = shift(&names);
            let chosen = axes::choose(&names, asked);
            return chosen.map(|axes| (axes.map(|axis| axis + shift), names.len() + shift, false));
        }
    }
    let columns = columns_of_comments(heads, first, next, width, options)?;
    Ok((columns.unwrap_or([0, 1, 2]), 0, columns.is_none()))
}

/// As [`columns_of`], where no title says it; `None` where no comment does either.
fn columns_of_comments(
    heads: &TitleNames,
    first: &Line,
    next: &[u8],
    width: usize,
    options: &ReadOptions,
) -> Result<Option<[usize; 3]>, FormatError> {
    let shift = |names: &[String]| usize::from(width == names.len() + 1 && has_index(first.text, next));
    let asked = options.columns.as_ref();
    for comment in heads.comments.iter().rev().filter(|comment| comment.len() < LONGEST) {
        let names = names(comment);
        let fits = names.len() == width || names.len() + 1 == width || (names.len() > width && width >= 3);
        match axes::find(&names) {
            axes::Axes::Found(axes) if fits && asked.is_none() && axes.iter().all(|&axis| axis < width) => {
                let shift = shift(&names);
                return Ok(Some(axes.map(|axis| axis + shift)));
            }
            axes::Axes::Degrees if names.len() == width => return axes::choose(&names, asked).map(Some),
            _ if asked.is_some() && names.len() == width => return axes::choose(&names, asked).map(Some),
            // A title behind the mark of a comment, which says no more than that the first three need not be it.
            axes::Axes::Unknown if width > 3 && names.len() == width && is_list(comment) => {
                return axes::choose(&names, None).map(Some);
            }
            _ => {}
        }
    }
    match asked {
        Some(_) => {
            let numbers: Vec<String> = (1..=width.min(1000)).map(|n| n.to_string()).collect();
            axes::choose(&numbers, asked).map(Some)
        }
        None => Ok(None),
    }
}

/// Whether a comment is a list of names with something between them that is no blank.
fn is_list(comment: &[u8]) -> bool {
    let text = uncommented(comment);
    let all_words = Style::of(text).fields(text).all(|(_, field)| number(field).is_err());
    text.iter().any(|byte| b",;\t".contains(byte)) && all_words
}

/// Whether rows begin with their number or a name that the title does not count.
fn has_index(first: &[u8], next: &[u8]) -> bool {
    let begin = |text: &[u8]| {
        let field = Style::of(text).fields(text).next()?.1.to_vec();
        String::from_utf8(field).ok()
    };
    match (begin(first), begin(next)) {
        (Some(a), Some(b)) => match (a.parse::<u64>(), b.parse::<u64>()) {
            (Ok(a), Ok(b)) => a <= 1 && b == a + 1,
            _ => number(a.as_bytes()).is_err(),
        },
        (Some(a), None) => number(a.as_bytes()).is_err(),
        _ => false,
    }
}
