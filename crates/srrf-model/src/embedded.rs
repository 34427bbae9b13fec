//! Weights that ship inside the library.

use burn::tensor::Device;

use crate::weights::{LoadedModel, WeightsError, from_safetensors};

/// Names of the embedded models with their files; the model cards lie beside them in `weights/`.
/// The first is the default.
const EMBEDDED: &[(&str, &[u8])] = &[
    ("srrf-small", include_bytes!("../weights/srrf-small.safetensors")),
    ("srrf-small-start", include_bytes!("../weights/srrf-small-start.safetensors")),
    ("srrf-shapes", include_bytes!("../weights/srrf-shapes.safetensors")),
];

/// Names of the embedded models, the default first.
pub fn names() -> impl Iterator<Item = &'static str> {
    EMBEDDED.iter().map(|(name, _)| *name)
}

/// An embedded model by name: `srrf-small` (trained on ModelNet40, the default), `srrf-small-start`
/// (what its training started from) or `srrf-shapes` (trained on the built-in shapes). `None` if there
/// is no model of that name.
pub fn load(name: &str, device: &Device) -> Option<Result<LoadedModel, WeightsError>> {
    let (name, bytes) = EMBEDDED.iter().find(|(known, _)| *known == name)?;
    Some(from_safetensors(bytes, &format!("embedded weights {name}"), device))
}

/// The default model, `srrf-small`.
///
/// # Errors
/// [`WeightsError`] if the embedded bytes were damaged at build time.
pub fn load_default(device: &Device) -> Result<LoadedModel, WeightsError> {
    let (name, bytes) = EMBEDDED[0];
    from_safetensors(bytes, &format!("embedded weights {name}"), device)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_model_loads_under_its_name() {
        let device = Device::flex();
        assert_eq!(names().next(), Some("srrf-small"));
        for name in names() {
            assert_eq!(load(name, &device).unwrap().unwrap().name, name);
        }
        assert_eq!(names().count(), 3);
        assert!(load("srrf-large", &device).is_none());
        assert_eq!(load_default(&device).unwrap().name, "srrf-small");
    }
}
