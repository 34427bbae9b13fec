//! AccessorNumbers in the buffers of a glTF file.

use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::{Index, validation::Checked};

use super::super::FormatError;
use super::super::scalar::Scalar;
use super::document::{GltfDocument, compressed};

/// What an accessor holds.
#[derive(Debug)]
pub(super) struct AccessorNumbers {
    /// One after another, `components` for each item.
    pub values: Vec<f64>,
    pub components: usize,
    /// Whether the file holds floating point numbers of single precision.
    pub single: bool,
}

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

fn scalar(kind: ComponentType) -> Scalar {
    match kind {
        ComponentType::I8 => Scalar::I8,
        ComponentType::U8 => Scalar::U8,
        ComponentType::I16 => Scalar::I16,
        ComponentType::U16 => Scalar::U16,
        ComponentType::U32 => Scalar::U32,
        ComponentType::F32 => Scalar::F32,
    }
}

fn components(kind: Type) -> usize {
    match kind {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 | Type::Mat2 => 4,
        Type::Mat3 => 9,
        Type::Mat4 => 16,
    }
}

impl GltfDocument<'_> {
    /// The numbers of an accessor.
    ///
    /// # Errors
    /// [`FormatError`] where they are not inside the buffers.
    pub fn numbers(&self, index: Index<Accessor>) -> Result<AccessorNumbers, FormatError> {
        let number = index.value();
        let accessor = self.root.accessors.get(number);
        let accessor = accessor.ok_or_else(|| content(format!("there is no accessor {number}")))?;
        let (Checked::Valid(GenericComponentType(component)), Checked::Valid(kind)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err(content(format!("accessor {number} is of an unknown type")));
        };
        let (kind, components) = (scalar(component), components(kind));
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let mut values = match (accessor.buffer_view, self.compression()) {
            (Some(view), _) => self.rows(view, offset, count, kind, components)?,
            (None, Some(name)) => return Err(compressed(name)),
            // Without data, an accessor is zeros but for the items that it replaces.
            (None, None) if accessor.sparse.is_some() => self.zeros(number, count, components)?,
            (None, None) => return Err(content(format!("accessor {number} has no data"))),
        };
        if let Some(sparse) = &accessor.sparse {
            let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            let Checked::Valid(indices) = sparse.indices.component_type else {
                return Err(content(format!("accessor {number} has indices of an unknown type")));
            };
            let places = self.rows(
                sparse.indices.buffer_view,
                sparse.indices.byte_offset.0,
                count,
                scalar(indices.0),
                1,
            )?;
            let others =
                self.rows(sparse.values.buffer_view, sparse.values.byte_offset.0, count, kind, components)?;
            for (place, other) in places.iter().zip(others.chunks_exact(components)) {
                let begin = (*place as usize).saturating_mul(components);
                let slot = values.get_mut(begin..begin.saturating_add(components));
                slot.ok_or_else(|| content(format!("accessor {number} replaces item {place} of {count}")))?
                    .copy_from_slice(other);
            }
        }
        if accessor.normalized {
            let most = match kind {
                Scalar::I8 => 127.0,
                Scalar::U8 => 255.0,
                Scalar::I16 => 32_767.0,
                Scalar::U16 => 65_535.0,
                _ => 1.0,
            };
            values.iter_mut().for_each(|value| *value = (*value / most).max(-1.0));
        }
        // Integers of 8 and 16 bits fit too, unless they stand for fractions.
        let single = kind == Scalar::F32 || (!accessor.normalized && kind.size() <= 2);
        Ok(AccessorNumbers { values, components, single })
    }

    /// As many zeros as there are bytes in all buffers, at most: the count of an accessor without data is no more than a
    /// word.
    fn zeros(&self, number: usize, count: usize, components: usize) -> Result<Vec<f64>, FormatError> {
        let bytes: usize = self.buffers.iter().map(|buffer| buffer.len()).sum();
        match count.checked_mul(components) {
            Some(size) if size <= bytes.max(1 << 16) => Ok(vec![0.0; size]),
            _ => Err(content(format!("accessor {number} has {count} items and no data"))),
        }
    }

    /// `count` rows of a view.
    fn rows(
        &self,
        view: Index<View>,
        offset: u64,
        count: usize,
        kind: Scalar,
        components: usize,
    ) -> Result<Vec<f64>, FormatError> {
        let view = self.root.buffer_views.get(view.value());
        let view = view.ok_or_else(|| content("an accessor names a view that is not there"))?;
        let buffer = self.buffers.get(view.buffer.value());
        let buffer = buffer.ok_or_else(|| content("a view names a buffer that is not there"))?;
        let size = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        let begin = size(view.byte_offset.map_or(0, |offset| offset.0));
        let end = begin.saturating_add(size(view.byte_length.0));
        let row = kind.size() * components;
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0).unwrap_or(row);
        let offset = size(offset);
        let needed =
            count.saturating_sub(1).checked_mul(stride).and_then(|n| n.checked_add(row)?.checked_add(offset));
        let short = || {
            FormatError::truncated(
                format!("{count} items of {row} bytes in a buffer"),
                format!("{} bytes from byte {begin} on", buffer.len().saturating_sub(begin)),
            )
        };
        if count == 0 {
            return Ok(Vec::new());
        }
        if stride < row {
            return Err(content(format!("items of {row} bytes every {stride} bytes")));
        }
        let bytes = buffer.get(begin..end.min(buffer.len())).ok_or_else(short)?;
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(match self.compression().filter(|_| buffer.is_empty()) {
                Some(name) => compressed(name),
                None => short(),
            });
        }
        let value = |row: usize, component: usize| {
            kind.get(bytes, offset + row * stride + component * kind.size(), false).unwrap_or(f64::NAN)
        };
        Ok((0..count).flat_map(|row| (0..components).map(move |component| value(row, component))).collect())
    }
}
