//! Safetensors whose bytes depend on nothing but what they hold: the header is sorted, so equal weights have equal SHA-256.

use std::collections::BTreeMap;

use safetensors::SafeTensorError;
use safetensors::tensor::View;
use serde_json::Value;

/// The key of the header under which the entries of [`serialize`] stand.
const METADATA: &str = "__metadata__";
/// The bytes before the header: its length.
const LENGTH: usize = 8;

/// The bytes of a safetensors file with these tensors and entries of its header, in the order of their names.
///
/// # Errors
/// [`SafeTensorError`] for tensors whose shape and bytes do not agree.
pub fn serialize<V: View>(
    tensors: impl IntoIterator<Item = (String, V)>,
    entries: &BTreeMap<String, String>,
) -> Result<Vec<u8>, SafeTensorError> {
    // Entries go into the sorted header alone: with them and no tensor, safetensors 0.8.0 writes a header that is no JSON.
    let written = safetensors::serialize(tensors, None)?;
    let short = || SafeTensorError::InvalidHeaderLength;
    let (length, rest) = written.split_first_chunk::<LENGTH>().ok_or_else(short)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| short())?;
    let (header, body) = rest.split_at_checked(length).ok_or_else(short)?;

    let header: BTreeMap<String, Value> = serde_json::from_slice(header)?;
    let tensors = serde_json::to_string(&header)?;
    let entries = serde_json::to_string(entries)?;
    let mut sorted = match tensors.strip_prefix('{') {
        Some("}") | None => format!("{{\"{METADATA}\":{entries}}}"),
        Some(tensors) => format!("{{\"{METADATA}\":{entries},{tensors}"),
    };
    // The body begins at a multiple of 8 bytes.
    while sorted.len() % LENGTH != 0 {
        sorted.push(' ');
    }
    Ok([&(sorted.len() as u64).to_le_bytes(), sorted.as_bytes(), body].concat())
}

#[cfg(test)]
mod tests {
    use safetensors::SafeTensors;
    use safetensors::tensor::{Dtype, TensorView};

    use super::*;

    #[test]
    fn equal_content_has_equal_bytes() {
        let (a, b) = (1.5f32.to_le_bytes(), [7u8; 3]);
        let bytes = || {
            let entries: BTreeMap<String, String> =
                (0..20).map(|i| (format!("key {i}"), format!("\"{i}\"\n"))).collect();
            let tensors = vec![
                ("z".to_owned(), TensorView::new(Dtype::F32, vec![1], &a).unwrap()),
                ("b".to_owned(), TensorView::new(Dtype::U8, vec![3], &b).unwrap()),
            ];
            serialize(tensors, &entries).unwrap()
        };
        let first = bytes();
        for _ in 0..8 {
            assert_eq!(bytes(), first, "a map with random order would differ");
        }
        let read = SafeTensors::deserialize(&first).unwrap();
        assert_eq!(read.tensor("z").unwrap().data(), a);
        assert_eq!(read.tensor("b").unwrap().data(), b);
        let (length, metadata) = SafeTensors::read_metadata(&first).unwrap();
        assert_eq!(length % 8, 0);
        assert_eq!(metadata.metadata().as_ref().unwrap()["key 3"], "\"3\"\n");
        let none = serialize(Vec::<(String, TensorView<'_>)>::new(), &BTreeMap::new()).unwrap();
        assert_eq!(SafeTensors::deserialize(&none).unwrap().len(), 0);
    }
}
