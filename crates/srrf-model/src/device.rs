//! Devices by name.

use burn::tensor::Device;

/// A device that this program has not.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("device `{0}` is not built in; this program has: {available}", available = NAMES.join(", "))]
pub struct UnknownDevice(pub String);

/// Names of the devices that this program has.
pub const NAMES: &[&str] = &["flex"];

/// The device of a name, without autodiff.
///
/// # Errors
/// [`UnknownDevice`] for a name that is not in [`NAMES`].
pub fn device(name: &str) -> Result<Device, UnknownDevice> {
    match name {
        "flex" => Ok(Device::flex()),
        _ => Err(UnknownDevice(name.to_string())),
    }
}
