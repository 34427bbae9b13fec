//! Colours and intensities of the points of a file, for pages.

use srrf_args::files::Input;
use srrf_cloud::io::{Attribute, AttributeValues};
use srrf_view::PointValues;

/// What a cloud has for each of its points; empty where its file holds nothing, or its points were drawn from a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShownValues {
    colours: Option<Vec<[u8; 3]>>,
    intensities: Option<Vec<f64>>,
}

impl ShownValues {
    /// Of a pair.
    pub fn of_pair(source: &Input, target: &Input) -> [Self; 2] {
        [Self::of(source), Self::of(target)]
    }

    /// Of an input. What cannot be read is not shown: the points themselves have been read.
    pub fn of(input: &Input) -> Self {
        let attributes = input.file.attributes().unwrap_or_default();
        let kept = |i: usize| input.kept.as_ref().is_none_or(|kept| kept.get(i) == Some(&true));
        let values = Self::from_attributes(&attributes, kept);
        let fits = |n: usize| n == input.cloud.len();
        Self {
            colours: values.colours.filter(|v| fits(v.len())),
            intensities: values.intensities.filter(|v| fits(v.len())),
        }
    }

    fn from_attributes(attributes: &[Attribute], kept: impl Fn(usize) -> bool) -> Self {
        let named = |names: &[&str]| {
            let found = attributes.iter().find(|a| names.contains(&a.name.as_str()));
            found.map(|a| &a.values)
        };
        let all = [named(&["red", "r"]), named(&["green", "g"]), named(&["blue", "b"])];
        let colours = match all {
            [Some(red), Some(green), Some(blue)] => {
                let most = [red, green, blue].map(most).into_iter().fold(0.0, f64::max);
                let white = white(red, most);
                let byte = |values: &AttributeValues, i: usize| {
                    // A cast saturates, and takes NaN for 0.
                    values.get(i).map(|v| (v / white * 255.0).round() as u8)
                };
                let colour = |i| Some([byte(red, i)?, byte(green, i)?, byte(blue, i)?]);
                (0..red.len()).filter(|i| kept(*i)).map(colour).collect()
            }
            _ => None,
        };
        let intensity = named(&["intensity", "scalar_intensity", "reflectance", "reflectivity"]);
        let intensities = intensity
            .and_then(|values| (0..values.len()).filter(|i| kept(*i)).map(|i| values.get(i)).collect());
        Self { colours, intensities }
    }

    /// For a page.
    pub fn shown(&self) -> PointValues<'_> {
        PointValues { colours: self.colours.as_deref(), intensities: self.intensities.as_deref() }
    }
}

fn most(values: &AttributeValues) -> f64 {
    (0..values.len()).filter_map(|i| values.get(i)).fold(0.0, f64::max)
}

/// The number that stands for full light: by the type, and where the type does not say so by the largest number there is.
fn white(values: &AttributeValues, most: f64) -> f64 {
    match values {
        AttributeValues::U8(_) | AttributeValues::I8(_) => 255.0,
        // Many writers of LAS leave 8 bits in 16.
        _ if most > 255.0 => 65_535.0,
        AttributeValues::F32(_) | AttributeValues::F64(_) if most <= 1.0 => 1.0,
        _ => 255.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attributes(values: [AttributeValues; 3]) -> Vec<Attribute> {
        ["red", "green", "blue"]
            .into_iter()
            .zip(values)
            .map(|(n, values)| Attribute { name: n.into(), values })
            .collect()
    }

    #[test]
    fn colours_of_all_types_are_bytes() {
        let of = |values| ShownValues::from_attributes(&attributes(values), |_| true).colours.unwrap();
        let bytes = |v: [u8; 2]| AttributeValues::U8(v.to_vec());
        assert_eq!(of([bytes([1, 9]), bytes([2, 8]), bytes([3, 7])]), [[1, 2, 3], [9, 8, 7]]);
        let words = |v: [u16; 2]| AttributeValues::U16(v.to_vec());
        assert_eq!(of([words([65_535, 0]), words([257, 0]), words([0, 514])]), [[255, 1, 0], [0, 0, 2]]);
        assert_eq!(of([words([255, 0]), words([1, 0]), words([0, 2])]), [[255, 1, 0], [0, 0, 2]]);
        let floats = |v: [f32; 2]| AttributeValues::F32(v.to_vec());
        assert_eq!(
            of([floats([1.0, 0.0]), floats([0.5, 0.0]), floats([0.0, f32::NAN])]),
            [[255, 128, 0], [0, 0, 0]]
        );
    }

    #[test]
    fn points_that_were_left_out_take_theirs_along() {
        let mut all = attributes([1, 2, 3].map(|c| AttributeValues::U8(vec![c, 10 * c, 20 * c])));
        all.push(Attribute { name: "intensity".into(), values: AttributeValues::U16(vec![7, 8, 9]) });
        let values = ShownValues::from_attributes(&all, |i| i != 1);
        assert_eq!(values.colours.as_deref(), Some(&[[1, 2, 3], [20, 40, 60]][..]));
        assert_eq!(values.intensities.as_deref(), Some(&[7.0, 9.0][..]));
        assert_eq!(ShownValues::from_attributes(&all[..2], |_| true), ShownValues::default());
    }
}
