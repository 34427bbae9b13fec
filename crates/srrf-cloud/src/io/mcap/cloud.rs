//! `sensor_msgs/PointCloud2`: a message with one cloud.

use super::super::scalar::Scalar;
use super::super::{Attribute, AttributeValues, Contents, FormatError, ReadOptions};
use super::fields::RosWords;
use super::messages::Encoding;

/// A field of a point.
#[derive(Debug, Clone, PartialEq)]
struct PointField {
    name: String,
    offset: usize,
    scalar: Scalar,
    count: usize,
}

/// A message.
#[derive(Debug)]
pub(super) struct Message<'a> {
    /// Seconds and nanoseconds.
    pub stamp: [u32; 2],
    pub frame: String,
    width: usize,
    height: usize,
    fields: Vec<PointField>,
    big_endian: bool,
    point_step: usize,
    row_step: usize,
    data: &'a [u8],
}

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

impl<'a> Message<'a> {
    /// Takes a message apart.
    ///
    /// # Errors
    /// [`FormatError`] where it is damaged, or its points are not inside its data.
    pub fn parse(bytes: &'a [u8], encoding: Encoding) -> Result<Self, FormatError> {
        let words = match encoding {
            Encoding::Cdr => {
                RosWords::cdr(bytes).ok_or_else(|| content("a message that is not in plain CDR"))?
            }
            Encoding::Ros1 => RosWords::plain(bytes),
        };
        let message = Self::words(words, encoding).ok_or_else(|| {
            FormatError::truncated("a PointCloud2", format!("a message of {} bytes", bytes.len()))
        })?;
        message?.checked()
    }

    fn words(mut words: RosWords<'a>, encoding: Encoding) -> Option<Result<Self, FormatError>> {
        if encoding == Encoding::Ros1 {
            words.u32()?; // a number in the order of sending
        }
        let stamp = [words.u32()?, words.u32()?];
        let frame = words.text()?;
        let (height, width) = (words.u32()? as usize, words.u32()? as usize);
        let mut fields = Vec::new();
        for _ in 0..words.u32()? {
            let (name, offset) = (words.text()?, words.u32()? as usize);
            let (kind, count) = (words.u8()?, words.u32()? as usize);
            let scalar = match kind {
                1 => Scalar::I8,
                2 => Scalar::U8,
                3 => Scalar::I16,
                4 => Scalar::U16,
                5 => Scalar::I32,
                6 => Scalar::U32,
                7 => Scalar::F32,
                8 => Scalar::F64,
                _ => return Some(Err(content(format!("the field {name:?} is of the unknown type {kind}")))),
            };
            fields.push(PointField { name, offset, scalar, count });
        }
        let big_endian = words.u8()? != 0;
        let (point_step, row_step) = (words.u32()? as usize, words.u32()? as usize);
        let data = words.bytes()?;
        Some(Ok(Self { stamp, frame, width, height, fields, big_endian, point_step, row_step, data }))
    }

    fn checked(self) -> Result<Self, FormatError> {
        if let Some(field) = self.fields.iter().find(|field| {
            let size = field.count.max(1).saturating_mul(field.scalar.size());
            field.offset.saturating_add(size) > self.point_step
        }) {
            return Err(content(format!(
                "the field {:?} ends behind the {} bytes of a point",
                field.name, self.point_step
            )));
        }
        let row = self.width.saturating_mul(self.point_step);
        let stride = self.stride();
        let needed = self.height.saturating_sub(1).saturating_mul(stride).saturating_add(row);
        if self.height > 0
            && (self.point_step == 0 || (self.height > 1 && stride < row) || needed > self.data.len())
        {
            return Err(FormatError::truncated(
                format!("{} x {} points of {} bytes", self.width, self.height, self.point_step),
                format!("{} bytes in rows of {}", self.data.len(), self.row_step),
            ));
        }
        Ok(self)
    }

    /// Bytes from row to row. Of a single row many drivers leave the number at 0.
    fn stride(&self) -> usize {
        if self.height > 1 { self.row_step } else { 0 }
    }

    /// Number of its points.
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    fn field(&self, name: &str) -> Option<&PointField> {
        self.fields.iter().find(|field| field.name.eq_ignore_ascii_case(name))
    }

    /// The numbers of a field, one a point.
    fn values(&self, field: &PointField) -> impl Iterator<Item = f64> {
        let (stride, step, offset) = (self.stride(), self.point_step, field.offset);
        let (scalar, big_endian, data) = (field.scalar, self.big_endian, self.data);
        let width = self.width;
        (0..self.height).flat_map(move |row| {
            (0..width).map(move |column| {
                scalar.get(data, row * stride + column * step + offset, big_endian).unwrap_or(f64::NAN)
            })
        })
    }

    /// The cloud.
    pub fn contents(&self, held: usize, options: &ReadOptions) -> Result<Contents, FormatError> {
        let axes = ["x", "y", "z"].map(|name| self.field(name));
        let [Some(x), Some(y), Some(z)] = axes else {
            let names: Vec<&str> = self.fields.iter().map(|field| field.name.as_str()).take(20).collect();
            return Err(content(format!("the message has no fields x, y and z, but {names:?}")));
        };
        options.check_points(held, self.len())?;
        let rows = self.values(x).zip(self.values(y)).zip(self.values(z));
        Ok(Contents {
            points: rows.map(|((x, y), z)| [x, y, z]).collect(),
            single: [x, y, z].iter().all(|field| field.scalar.is_single()),
            grid: (self.height > 1).then_some([self.width, self.height]),
            ..Contents::default()
        })
    }

    /// All other fields of one number a point. Colours in one number are taken apart.
    pub fn attributes(&self) -> Vec<Attribute> {
        let mut attributes = Vec::new();
        let others = self.fields.iter().filter(|field| field.count <= 1);
        for field in others {
            let name = field.name.to_ascii_lowercase();
            if ["x", "y", "z"].contains(&name.as_str()) {
                continue;
            }
            if ["rgb", "rgba"].contains(&name.as_str()) && field.scalar.size() == 4 {
                let bits = PointField { scalar: Scalar::U32, ..field.clone() };
                let channels = [("red", 16), ("green", 8), ("blue", 0), ("alpha", 24)];
                for (channel, shift) in &channels[..name.len()] {
                    let values = self.values(&bits).map(|bits| (bits as u32 >> shift) as u8).collect();
                    attributes
                        .push(Attribute { name: (*channel).into(), values: AttributeValues::U8(values) });
                }
                continue;
            }
            let name = match name.as_str() {
                "normal_x" => "nx".to_owned(),
                "normal_y" => "ny".to_owned(),
                "normal_z" => "nz".to_owned(),
                _ => name,
            };
            let values = super::super::scans::attribute_values(field.scalar, self.values(field));
            attributes.push(Attribute { name, values });
        }
        attributes
    }
}
