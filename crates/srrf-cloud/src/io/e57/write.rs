//! An E57 file with one scan.

use std::io::Cursor;

use e57::{E57Writer, Extension, IntensityLimits, Record, RecordDataType, RecordName, RecordValue};

use super::super::outgoing::{COLOURS, INTENSITY, NORMALS};
use super::super::{Attribute, Outgoing};
use super::attributes::normal;
use super::{E57Problem, NORMALS_NAMESPACE};

/// Whether a scan has a place for it.
pub(super) fn keeps(attribute: &Attribute, cloud: &Outgoing<'_>) -> bool {
    let name = attribute.name.as_str();
    name == INTENSITY
        || (COLOURS.contains(&name) && cloud.triple(COLOURS).is_some())
        || (NORMALS.contains(&name) && cloud.triple(NORMALS).is_some())
}

/// The colours: in 8 bits where that is all that there is, or as shares of 1.
enum Colours {
    Bytes(Vec<[u8; 3]>),
    Shares(Vec<[f32; 3]>),
}

impl Colours {
    fn of(cloud: &Outgoing<'_>) -> Option<Self> {
        match cloud.colours()? {
            (colours, false) => Some(Self::Bytes(colours)),
            (_, true) => cloud.shares().map(Self::Shares),
        }
    }

    fn kind(&self) -> RecordDataType {
        match self {
            Self::Bytes(_) => RecordDataType::Integer { min: 0, max: 255 },
            Self::Shares(_) => RecordDataType::Single { min: Some(0.0), max: Some(1.0) },
        }
    }

    fn values(&self, point: usize) -> [RecordValue; 3] {
        match self {
            Self::Bytes(list) => list[point].map(|part| RecordValue::Integer(part.into())),
            Self::Shares(list) => list[point].map(RecordValue::Single),
        }
    }
}

/// A whole file with one scan, and the colours, intensities and normals that it has.
pub(super) fn file(cloud: &Outgoing<'_>) -> Result<Vec<u8>, E57Problem> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "{00000000-0000-4000-8000-000000000000}")?;
    let single = RecordDataType::Single { min: None, max: None };
    let double = RecordDataType::Double { min: None, max: None };
    let record = |name: RecordName, data_type: &RecordDataType| Record { name, data_type: data_type.clone() };
    let axes = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let mut prototype = axes.map(|name| record(name, if cloud.single { &single } else { &double })).to_vec();
    let colours = Colours::of(cloud);
    if let Some(colours) = &colours {
        let parts = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        prototype.extend(parts.map(|name| record(name, &colours.kind())));
    }
    let intensity = cloud.attribute(INTENSITY);
    prototype.extend(intensity.map(|_| record(RecordName::Intensity, &double)));
    let normals = cloud.triple(NORMALS);
    if normals.is_some() {
        let url = "http://www.libe57.org/E57_NOR_surface_normals.txt";
        writer.register_extension(Extension::new(NORMALS_NAMESPACE, url))?;
        prototype.extend([0, 1, 2].map(|axis| record(normal(axis), &double)));
    }
    let mut scan = writer.add_pointcloud("{00000000-0000-4000-8000-000000000001}", prototype)?;
    if let Some(intensity) = intensity {
        let values = || (0..intensity.values.len()).filter_map(|point| intensity.values.get(point));
        let [least, most] =
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)];
        let limit = |value: f64| Some(RecordValue::Double(value)).filter(|_| least <= most);
        let limits = IntensityLimits { intensity_min: limit(least), intensity_max: limit(most) };
        scan.set_intensity_limits(Some(limits));
    }
    let number =
        |attribute: &Attribute, point| RecordValue::Double(attribute.values.get(point).unwrap_or(f64::NAN));
    for (index, point) in cloud.points.iter().enumerate() {
        let mut row = Vec::with_capacity(10);
        row.extend(
            point.map(|c| if cloud.single { RecordValue::Single(c as f32) } else { RecordValue::Double(c) }),
        );
        row.extend(colours.iter().flat_map(|colours| colours.values(index)));
        row.extend(intensity.map(|attribute| number(attribute, index)));
        row.extend(normals.iter().flatten().map(|attribute| number(attribute, index)));
        scan.add_point(row)?;
    }
    scan.finalize()?;
    drop(scan);
    writer.finalize()?;
    drop(writer);
    Ok(out.into_inner())
}
