//! Weights that ship inside the library.

use std::path::Path;

use burn::tensor::Device;

use crate::weights::{self, LoadedModel, WeightsError, from_safetensors};

/// Trained weights in a program.
#[derive(Debug, Clone, Copy)]
pub struct TrainedWeights {
    /// A safetensors file, for [`weights::parse`].
    pub bytes: &'static [u8],
    /// How they were trained and what they are good for, in Markdown.
    pub card: &'static str,
}

/// A network in the program.
#[derive(Debug, Clone, Copy)]
pub struct EmbeddedModel {
    /// Its name.
    pub name: &'static str,
    /// Whether it registers; the others are skeleton modules to compare, whose branches are untrained.
    pub registers: bool,
    /// Its weights.
    pub weights: TrainedWeights,
}

/// The entry of the network whose weights and card lie in `weights/`.
macro_rules! model {
    ($name:literal, card $card:literal, registers $registers:literal) => {
        EmbeddedModel {
            name: $name,
            registers: $registers,
            weights: TrainedWeights {
                bytes: include_bytes!(concat!("../weights/", $name, ".safetensors")),
                card: include_str!(concat!("../weights/", $card, ".md")),
            },
        }
    };
}

/// The networks in the program, the default first. `weights/LINEAGE.toml` names these and what they were trained from.
/// A static, so that a program holds each once. Those that are there to compare need the feature `every-network`.
pub static MODELS: &[EmbeddedModel] = &[
    model!("srrf", card "srrf", registers true),
    #[cfg(feature = "every-network")]
    model!("srrf-small", card "srrf-small", registers true),
    model!("srrf-shapes", card "srrf-shapes", registers true),
    #[cfg(feature = "every-network")]
    model!("srrf-ddl", card "srrf-ddl", registers false),
    #[cfg(feature = "every-network")]
    model!("srrf-no-ddl", card "srrf-ddl", registers false),
];

/// The networks of the feature `every-network`.
const TO_COMPARE: [&str; 3] = ["srrf-small", "srrf-ddl", "srrf-no-ddl"];

/// Names of the models to register with, the default first.
pub fn names() -> impl Iterator<Item = &'static str> {
    MODELS.iter().filter(|model| model.registers).map(|model| model.name)
}

/// The network of this name, if the program has it.
pub fn model(name: &str) -> Option<&'static EmbeddedModel> {
    MODELS.iter().find(|model| model.name == name)
}

/// Whether [`load`] knows `name`.
pub fn contains(name: &str) -> bool {
    model(name).is_some()
}

/// An embedded model by name: `srrf` (trained on ModelNet40, the default), `srrf-small` (trained on the same shapes,
/// seven tenths of the time) or `srrf-shapes` (trained on the built-in shapes). `None` if there is no model of that name. `srrf-ddl`
/// and `srrf-no-ddl` are two skeleton modules to compare, whose branches are untrained.
pub fn load(name: &str, device: &Device) -> Option<Result<LoadedModel, WeightsError>> {
    Some(from_safetensors(model(name)?.weights.bytes, &format!("embedded weights {name}"), device))
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
        return Err(unknown(name));
    }
    weights::load(Path::new(name), device)
}

/// What is said of a name that is no file, and no model in the program.
pub fn unknown(name: &str) -> WeightsError {
    let (name, known) = (name.to_owned(), names().collect::<Vec<_>>().join(", "));
    match TO_COMPARE.contains(&&*name) {
        true => WeightsError::NotInThisBuild { name, known },
        false => WeightsError::Unknown { name, known },
    }
}

/// The default model, `srrf`.
///
/// # Errors
/// [`WeightsError`] if the embedded bytes were damaged at build time.
pub fn load_default(device: &Device) -> Result<LoadedModel, WeightsError> {
    let EmbeddedModel { name, weights, .. } = MODELS[0];
    from_safetensors(weights.bytes, &format!("embedded weights {name}"), device)
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
        let every = cfg!(feature = "every-network");
        assert_eq!(names().count(), if every { 3 } else { 2 });
        assert!(contains("srrf") && !contains("srrf-large"));
        for name in TO_COMPARE {
            assert_eq!(contains(name), every, "{name}");
        }
        for model in MODELS {
            assert!(load(model.name, &device).unwrap().is_ok(), "{}", model.name);
            assert!(model.weights.card.starts_with("# srrf"), "{}", model.name);
        }
        assert!(load("srrf-large", &device).is_none());
        assert_eq!(open("srrf-shapes", &device).unwrap().name, "srrf-shapes");
        let refused = open("srrf-large", &device).unwrap_err().to_string();
        assert!(refused.contains("srrf-large: no such file") && refused.contains("srrf-shapes"), "{refused}");
        let left_out = unknown("srrf-small").to_string();
        assert!(left_out.contains("crates/srrf-model/weights/srrf-small.safetensors"), "{left_out}");
        assert_eq!(load_default(&device).unwrap().name, "srrf");
    }
}
