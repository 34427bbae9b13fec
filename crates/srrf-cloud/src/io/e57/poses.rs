//! The poses of scans and images in the XML section of an E57 file.

use nalgebra::{Quaternion, Rotation3, UnitQuaternion};
use roxmltree::{Document, Node};

use super::super::FormatError;
use super::super::scan::put_number;
use crate::Rigid;

/// The XML with each pose `p` replaced by `motion` after `p`; scans without pose get one. With the number of a scan,
/// from 1, that scan alone moves.
///
/// # Errors
/// [`FormatError`] where it is not XML, or a pose is not made of numbers.
pub(super) fn moved(xml: &str, motion: &Rigid, scan: Option<usize>) -> Result<String, FormatError> {
    let document =
        Document::parse(xml).map_err(|e| FormatError::Content(format!("the XML section is damaged: {e}")))?;
    let mut changes = Vec::new();
    for (list, always) in [("data3D", true), ("images2D", false)] {
        let lists = document.root_element().children().filter(|node| node.tag_name().name() == list);
        let items = lists.flat_map(|list| list.children());
        let items = items.filter(|node| node.tag_name().name() == "vectorChild").enumerate();
        for (_, item) in items.filter(|(index, _)| scan.is_none_or(|scan| always && scan == index + 1)) {
            match item.children().find(|node| node.tag_name().name() == "pose") {
                Some(pose) => changes.push((pose.range(), text(&motion.compose(&read(&pose)?)))),
                None if always => {
                    // In front of the tag that closes the scan.
                    let range = item.range();
                    let end = xml[range.clone()].rfind("</").map_or(range.end, |at| range.start + at);
                    changes.push((end..end, text(motion)));
                }
                None => {}
            }
        }
    }
    changes.sort_by_key(|(range, _)| range.start);
    let mut copy = String::with_capacity(xml.len() + 600 * changes.len());
    let mut at = 0;
    for (range, pose) in changes {
        copy.push_str(&xml[at..range.start]);
        copy.push_str(&pose);
        at = range.end;
    }
    copy.push_str(&xml[at..]);
    Ok(copy)
}

fn read(pose: &Node) -> Result<Rigid, FormatError> {
    let number = |part: &str, name: &str, missing: f64| {
        let part = pose.children().find(|node| node.tag_name().name() == part);
        let node = part.and_then(|part| part.children().find(|node| node.tag_name().name() == name));
        // An element without text is 0.
        let value =
            node.map_or(Ok(missing), |node| node.text().map_or(Ok(0.0), |text| text.trim().parse::<f64>()));
        value.map_err(|_| FormatError::Content(format!("the pose has a {name} that is not a number")))
    };
    let rotation = |name: &str, missing: f64| number("rotation", name, missing);
    let q =
        Quaternion::new(rotation("w", 1.0)?, rotation("x", 0.0)?, rotation("y", 0.0)?, rotation("z", 0.0)?);
    let translation = [
        number("translation", "x", 0.0)?,
        number("translation", "y", 0.0)?,
        number("translation", "z", 0.0)?,
    ];
    let rotation = UnitQuaternion::from_quaternion(q).to_rotation_matrix().into_inner();
    Ok(Rigid { rotation, translation: translation.into() })
}

fn text(pose: &Rigid) -> String {
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(pose.rotation));
    let float = |(name, value): (&str, f64)| {
        let mut number = Vec::new();
        put_number(&mut number, value);
        format!("<{name} type=\"Float\">{}</{name}>", String::from_utf8_lossy(&number))
    };
    let rotation: String = [("w", q.w), ("x", q.i), ("y", q.j), ("z", q.k)].map(float).concat();
    let t = &pose.translation;
    let translation: String = [("x", t.x), ("y", t.y), ("z", t.z)].map(float).concat();
    format!(
        "<pose type=\"Structure\"><rotation type=\"Structure\">{rotation}</rotation>\
         <translation type=\"Structure\">{translation}</translation></pose>"
    )
}
