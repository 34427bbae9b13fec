//! Weights that ship inside the library.

use std::path::Path;

use burn::tensor::Device;

use crate::weights::{self, LoadedModel, WeightsError, from_safetensors};

/// Names of the embedded models with their files; the model cards lie beside them in `weights/`.
/// The first is the default.
const EMBEDDED: &[(&str, &[u8])] = &[
    ("srrf", include_bytes!("../weights/srrf.safetensors")),
    ("srrf-small", include_bytes!("../weights/srrf-small.safetensors")),
    ("srrf-shapes", include_bytes!("../weights/srrf-shapes.safetensors")),
];

/// Embedded networks that are no models to register with: two skeleton modules, trained with and without the
/// distribution distance loss, for the comparison of the two.
const ABLATIONS: &[(&str, &[u8])] = &[
    ("srrf-ddl", include_bytes!("../weights/srrf-ddl.safetensors")),
    ("srrf-no-ddl", include_bytes!("../weights/srrf-no-ddl.safetensors")),
];

/// Names of the embedded models, the default first.
pub fn names() -> impl Iterator<Item = &'static str> {
    EMBEDDED.iter().map(|(name, _)| *name)
}

/// The file of a network in the program.
fn file(name: &str) -> Option<&'static [u8]> {
    EMBEDDED.iter().chain(ABLATIONS).find(|(known, _)| *known == name).map(|(_, bytes)| *bytes)
}

/// Whether [`load`] knows `name`.
pub fn contains(name: &str) -> bool {
    file(name).is_some()
}

/// An embedded model by name: `srrf` (trained on ModelNet40, the default), `srrf-small` (trained on the same shapes,
/// seven tenths of the time) or `srrf-shapes` (trained on the built-in shapes). `None` if there is no model of that name. What
/// they were trained from lies beside them as files, `srrf-start`, `srrf-2`, `srrf-small-start` and `srrf-small-2`. `srrf-ddl`
/// and `srrf-no-ddl` are two skeleton modules to compare, whose branches are untrained.
pub fn load(name: &str, device: &Device) -> Option<Result<LoadedModel, WeightsError>> {
    Some(from_safetensors(file(name)?, &format!("embedded weights {name}"), device))
}

/// The weights that a user names: a model in the program, or a file.
///
/// # Errors
/// [`WeightsError::Unknown`] where there is neither, and others for a file that cannot be used.
pub fn open(name: &str, device: &Device) -> Result<LoadedModel, WeightsError> {
    if let Some(loaded) = load(name, device) {
        return loaded;
    }
    if !Path::new(name).exists() {
        let known = names().collect::<Vec<_>>().join(", ");
        return Err(WeightsError::Unknown { name: name.to_owned(), known });
    }
    weights::load(Path::new(name), device)
}

/// The default model, `srrf`.
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
        assert_eq!(names().next(), Some("srrf"));
        for name in names() {
            assert_eq!(load(name, &device).unwrap().unwrap().name, name);
        }
        assert_eq!(names().count(), 3);
        assert!(contains("srrf-ddl") && contains("srrf") && !contains("srrf-large"));
        for (name, _) in ABLATIONS {
            assert!(load(name, &device).unwrap().is_ok(), "{name}");
        }
        assert!(load("srrf-large", &device).is_none());
        assert_eq!(open("srrf-shapes", &device).unwrap().name, "srrf-shapes");
        let unknown = open("srrf-large", &device).unwrap_err().to_string();
        assert!(unknown.contains("srrf-large: no such file") && unknown.contains("srrf-shapes"), "{unknown}");
        assert_eq!(load_default(&device).unwrap().name, "srrf");
    }
}
