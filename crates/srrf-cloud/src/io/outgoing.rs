//! [`Outgoing`]: what is to be written, and [`Kept`]: what became of it.

use std::fmt;

use super::single::rounding;
use super::{Attribute, AttributeValues, CloudFormat};

/// Names of the parts of a colour, in the order in which files have them.
pub(super) const COLOURS: [&str; 3] = ["red", "green", "blue"];
/// Names of the parts of a normal.
pub(super) const NORMALS: [&str; 3] = ["nx", "ny", "nz"];
/// The name of what a laser scanner got back.
pub(super) const INTENSITY: &str = "intensity";

/// A cloud that is to be written.
#[derive(Debug, Clone, Copy)]
pub struct Outgoing<'a> {
    /// The points; shape `[n, 3]`.
    pub points: &'a [[f64; 3]],
    /// Whether coordinates are written in single precision by formats that have both.
    pub single: bool,
    /// The points before they were moved; none where they were not. Single precision is enough where it is no less exact
    /// than it was for these.
    pub before: &'a [[f64; 3]],
    /// What the points have besides; as many values as points.
    pub attributes: &'a [Attribute],
    /// The extension of the file in small letters, for formats that have several; or the name of the format.
    pub extension: &'a str,
}

impl<'a> Outgoing<'a> {
    /// Points in double precision, and nothing else.
    pub fn of_points(points: &'a [[f64; 3]]) -> Self {
        Self { points, single: false, before: &[], attributes: &[], extension: "" }
    }

    /// The attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&'a Attribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// Three attributes, if all are there.
    pub(super) fn triple(&self, names: [&str; 3]) -> Option<[&'a Attribute; 3]> {
        let [a, b, c] = names.map(|name| self.attribute(name));
        Some([a?, b?, c?])
    }

    /// The colours in 8 bits a part, and whether they were rounded to it: whole numbers up to 255 are taken as they are,
    /// larger ones as 16 bits, fractions as shares of 1.
    pub(super) fn colours(&self) -> Option<(Vec<[u8; 3]>, bool)> {
        let (parts, scale) = self.scaled_colours()?;
        let mut rounded = false;
        let colours = (0..self.points.len())
            .map(|point| {
                parts.map(|part| {
                    let value = part.values.get(point).unwrap_or(0.0) * scale;
                    rounded |= value != value.round();
                    value.round().clamp(0.0, 255.0) as u8
                })
            })
            .collect();
        Some((colours, rounded))
    }

    /// The colours as shares of 1.
    pub(super) fn shares(&self) -> Option<Vec<[f32; 3]>> {
        let (parts, scale) = self.scaled_colours()?;
        let share = |value: f64| (value * scale / 255.0) as f32;
        let colour = |point| parts.map(|part| share(part.values.get(point).unwrap_or(0.0)));
        Some((0..self.points.len()).map(colour).collect())
    }

    /// The parts of the colours, and by what they are multiplied to be shares of 255.
    fn scaled_colours(&self) -> Option<([&'a Attribute; 3], f64)> {
        let parts = self.triple(COLOURS)?;
        let most = parts.iter().map(|part| part.most()).fold(0.0, f64::max);
        let shares = parts.iter().all(|part| part.is_fraction()) && most <= 1.0;
        let scale = match () {
            () if shares => 255.0,
            () if most <= 255.0 => 1.0,
            () => 255.0 / 65535.0,
        };
        Some((parts, scale))
    }
}

impl Attribute {
    /// The largest value, 0 at least.
    pub(super) fn most(&self) -> f64 {
        (0..self.values.len()).filter_map(|i| self.values.get(i)).fold(0.0, f64::max)
    }

    fn is_fraction(&self) -> bool {
        matches!(self.values, AttributeValues::F32(_) | AttributeValues::F64(_))
    }
}

/// What a written copy has of its original.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Kept {
    /// Names of what the format has no room for: attributes, or `faces`.
    pub lost: Vec<String>,
    /// Names of attributes of another format that came along.
    pub carried: Vec<String>,
    /// Why the copy has double precision in a format that has both.
    pub double: Option<WhyDouble>,
    /// Whether colours were rounded to 8 bits.
    pub rounded_colours: bool,
}

impl Kept {
    /// Whether nothing is missing.
    pub fn is_everything(&self) -> bool {
        self.lost.is_empty() && !self.rounded_colours
    }
}

/// Why a copy has double precision, which some readers do not take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WhyDouble {
    /// The original has it too.
    AsOriginal,
    /// The original has single precision, which would move points by up to this.
    SingleWouldMove(f64),
}

/// What is kept and what is not, such as `with red, green, blue; without faces`.
impl fmt::Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        match (self.is_everything(), self.carried.is_empty()) {
            (true, true) => parts.push("with all else that its file holds".to_owned()),
            (_, false) => parts.push(format!("with {}", self.carried.join(", "))),
            (false, true) => {}
        }
        if !self.lost.is_empty() {
            parts.push(format!("without {}, for which this format has no room", self.lost.join(", ")));
        }
        if self.rounded_colours {
            parts.push("colours rounded to 8 bits".to_owned());
        }
        match self.double {
            Some(WhyDouble::AsOriginal) => parts.push(
                "in double precision as the original, which Open3D and PCL before 1.15 do not read from a PCD".to_owned(),
            ),
            Some(WhyDouble::SingleWouldMove(moved)) => parts.push(format!(
                "in double precision, since single would move points by up to {moved:.1e}; some readers take single only"
            )),
            None => {}
        }
        f.write_str(&parts.join("; "))
    }
}

/// Whether coordinates in single precision stay so once they are `new`; otherwise by how much it would move points.
pub(super) fn stays_single(old: &[[f64; 3]], new: &[[f64; 3]]) -> Result<(), f64> {
    let (moved, size) = rounding(new);
    // What the original could tell apart.
    let largest = old.iter().flatten().filter(|c| c.is_finite()).fold(0.0, |most: f64, c| most.max(c.abs()));
    let step = f64::from(f32::EPSILON) * largest;
    if moved.is_finite() && moved <= (super::single::TOLERANCE * size).max(step) {
        Ok(())
    } else {
        Err(moved)
    }
}

/// Whether single precision holds all of these as they are.
fn are_single(points: &[[f64; 3]]) -> bool {
    points.iter().flatten().all(|&c| !c.is_finite() || f64::from(c as f32) == c)
}

/// The cloud as `format` takes it, in single precision only where that is enough, and what that keeps.
pub(super) fn fitted<'a>(format: &dyn CloudFormat, cloud: &Outgoing<'a>) -> (Outgoing<'a>, Kept) {
    // Numbers of single precision in a file of doubles, as NumPy makes them: many readers of PCD take no doubles.
    let cloud = match cloud.before {
        _ if format.name() != "pcd" => *cloud,
        [] if are_single(cloud.points) => Outgoing { single: true, before: cloud.points, ..*cloud },
        before if !before.is_empty() && are_single(before) => Outgoing { single: true, ..*cloud },
        _ => *cloud,
    };
    let single = if cloud.single { stays_single(cloud.before, cloud.points) } else { Ok(()) };
    let cloud = Outgoing { single: cloud.single && single.is_ok(), ..cloud };
    let double = match single {
        Err(moved) if format.has_both_precisions() => Some(WhyDouble::SingleWouldMove(moved)),
        Ok(()) if format.name() == "pcd" && !cloud.single => Some(WhyDouble::AsOriginal),
        _ => None,
    };
    let (carried, lost): (Vec<&Attribute>, Vec<&Attribute>) =
        cloud.attributes.iter().partition(|attribute| format.keeps(attribute, &cloud));
    let names = |list: Vec<&Attribute>| list.into_iter().map(|attribute| attribute.name.clone()).collect();
    let eight_bits = ["ply", "pcd", "glb", "gltf"].contains(&format.name()) || cloud.extension == "pts";
    let has_colours = carried.iter().any(|attribute| attribute.name == COLOURS[0]);
    let rounded_colours = has_colours && eight_bits && cloud.colours().is_some_and(|(_, rounded)| rounded);
    (cloud, Kept { carried: names(carried), lost: names(lost), double, rounded_colours })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, values: AttributeValues) -> Attribute {
        Attribute { name: name.into(), values }
    }

    #[test]
    fn colours_come_to_8_bits() {
        let points = [[0.0; 3]; 2];
        let of = |make: &dyn Fn(f64) -> AttributeValues, values: [f64; 3]| {
            let attributes: Vec<Attribute> =
                COLOURS.iter().zip(values).map(|(name, v)| attribute(name, make(v))).collect();
            Outgoing { attributes: &attributes, ..Outgoing::of_points(&points) }.colours().unwrap()
        };
        let bytes = |v: f64| AttributeValues::U8(vec![v as u8; 2]);
        assert_eq!(of(&bytes, [1.0, 0.0, 255.0]), (vec![[1, 0, 255]; 2], false));
        let shares = |v: f64| AttributeValues::F64(vec![v; 2]);
        assert_eq!(of(&shares, [1.0, 0.2, 0.0]), (vec![[255, 51, 0]; 2], false));
        assert!(of(&shares, [0.5, 0.2, 0.0]).1);
        let words = |v: f64| AttributeValues::U16(vec![v as u16; 2]);
        assert_eq!(of(&words, [257.0 * 9.0, 65535.0, 0.0]), (vec![[9, 255, 0]; 2], false));
        assert_eq!(of(&words, [9.0, 200.0, 0.0]), (vec![[9, 200, 0]; 2], false), "8 bits in 16");
    }

    #[test]
    fn single_stays_single_where_it_is_enough() {
        let near = [[0.1f32, 2.0, -3.0], [8.0, 7.0, 0.3]].map(|p| p.map(f64::from));
        let shifted = near.map(|p| p.map(|c| c + 1.0 / 3.0));
        let far = near.map(|p| p.map(|c| c + 4_812_345.678));
        assert_eq!(stays_single(&near, &near), Ok(()));
        assert_eq!(stays_single(&near, &shifted), Ok(()));
        assert!(stays_single(&near, &far).is_err_and(|moved| moved > 0.01 && moved < 0.5));
        let coarse = far.map(|p| p.map(|c| f64::from(c as f32)));
        let turned = coarse.map(|[x, y, z]| [-y + 0.1, x, z]);
        assert_eq!(stays_single(&coarse, &turned), Ok(()), "no less exact than before");
        assert!(stays_single(&near, &[[1e300, 0.0, 0.0]]).is_err());
    }
}
