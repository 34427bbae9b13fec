//! Types that PLY does not have, such as `long`: how many bytes they take is told from the size of the file, or asked.

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::cursor::Cursor;
use super::header::{Element, PlyEncoding, PlyHeader, Property};

/// Whole numbers whose size depends on the machine, and the types that they may be.
fn sizes(word: &str) -> &'static [Scalar] {
    match word {
        "long" => &[Scalar::I32, Scalar::I64],
        "ulong" => &[Scalar::U32, Scalar::U64],
        _ => &[Scalar::U8, Scalar::U16, Scalar::U32, Scalar::U64],
    }
}

/// Whether the numbers of a property are known once its size is.
fn is_number(word: &str) -> bool {
    ["long", "ulong"].contains(&word)
}

/// The foreign properties of the first `elements` elements, each with its element.
fn foreign(header: &PlyHeader, elements: usize) -> impl Iterator<Item = (&Element, &Property, &str)> {
    header.elements.iter().take(elements).flat_map(|element| {
        element.properties.iter().filter_map(move |p| Some((element, p, p.foreign.as_deref()?)))
    })
}

/// The header of a file, with the size of every type.
///
/// # Errors
/// Those of [`PlyHeader::parse`]; [`FormatError::Content`] where several sizes fit, or none, or where a coordinate has
/// such a type.
pub(super) fn open(bytes: &[u8]) -> Result<PlyHeader, FormatError> {
    let mut header = PlyHeader::parse(bytes)?;
    // What stands behind the last rows that are read does no harm.
    let needed = header.needed();
    let Some((element, property, word)) = foreign(&header, needed).next() else { return Ok(header) };
    let said =
        format!("the property `{}` of the element `{}` has the type `{word}`", property.name, element.name);
    let way_out = "write it with one of PLY's types, such as int or float, or leave that property out";
    let word = word.to_owned();
    if header.encoding == PlyEncoding::Ascii {
        set(&mut header, |word| {
            if is_number(word) { *sizes(word).last().unwrap_or(&Scalar::F64) } else { Scalar::F64 }
        });
    } else {
        if foreign(&header, usize::MAX).any(|(_, _, other)| other != word) {
            return Err(FormatError::Content(format!(
                "{said}, which PLY does not have, and others have one more such type; {way_out}"
            )));
        }
        // Where faces have corners, it is no chance that the file ends with them.
        let ends = |scalar: &Scalar| ends(&mut header, *scalar, bytes);
        let fit: Vec<Scalar> = sizes(&word).iter().copied().filter(ends).collect();
        let [scalar] = fit[..] else {
            let how_many = if fit.is_empty() { "no size of it fits" } else { "several sizes of it fit" };
            return Err(FormatError::Content(format!(
                "{said}, which PLY does not have, and {how_many} the file; {way_out}"
            )));
        };
        set(&mut header, |_| scalar);
    }
    let of_place = |(element, p, word): &(&Element, &Property, &str)| {
        element.name == "vertex" && is_axis(p) && !is_number(word) && header.encoding != PlyEncoding::Ascii
    };
    if let Some((_, property, word)) = foreign(&header, needed).find(of_place) {
        return Err(FormatError::Content(format!(
            "the coordinate `{}` has the type `{word}`, which PLY does not have; write it as float or double",
            property.name
        )));
    }
    Ok(header)
}

fn set(header: &mut PlyHeader, scalar: impl Fn(&str) -> Scalar) {
    let properties = header.elements.iter_mut().flat_map(|element| &mut element.properties);
    for property in properties {
        if let Some(word) = &property.foreign {
            property.scalar = scalar(word);
        }
    }
}

/// Whether the rows come to their end at the end of the file, where the foreign type has this size, and all faces have
/// three corners or more.
fn ends(header: &mut PlyHeader, scalar: Scalar, bytes: &[u8]) -> bool {
    set(header, |_| scalar);
    let mut cursor = Cursor { bytes, at: header.body, encoding: header.encoding };
    let mut walk = || {
        for element in &header.elements {
            let Some(list) = element.face_list() else {
                cursor.skip_element(element).ok()?;
                continue;
            };
            for _ in 0..element.count {
                for (index, property) in element.properties.iter().enumerate() {
                    let place = cursor.property(property).ok()??;
                    if let Some(kind) = property.length.filter(|_| index == list) {
                        cursor.value(&place, kind).ok().filter(|corners| *corners >= 3.0)?;
                    }
                }
            }
        }
        Some(())
    };
    walk().is_some() && cursor.at == bytes.len()
}

/// What of the vertices cannot be told, in words.
pub(super) fn passed_over(header: &PlyHeader) -> Vec<String> {
    let what = |(element, property, word): (&Element, &Property, &str)| {
        (element.name == "vertex" && !is_number(word) && !is_axis(property))
            .then(|| format!("the property `{}`, whose type `{word}` PLY does not have", property.name))
    };
    foreign(header, usize::MAX).filter_map(what).collect()
}

/// Whether a property is passed over.
pub(super) fn is_passed_over(property: &Property) -> bool {
    property.foreign.as_deref().is_some_and(|word| !is_number(word))
}

fn is_axis(property: &Property) -> bool {
    ["x", "y", "z"].contains(&property.name.to_ascii_lowercase().as_str())
}
