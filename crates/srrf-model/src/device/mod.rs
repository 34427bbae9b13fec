//! Devices by name. Which ones a program has is settled when it is built, by the cargo features
//! `ndarray`, `wgpu`, `vulkan`, `cuda` and `libtorch`; which of them runs the network, by `--device`.

#[cfg(any(feature = "wgpu", feature = "cuda", feature = "libtorch"))]
mod accelerator;

use burn::tensor::Device;

/// Why a device cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// No device has this name.
    #[error("no device is called `{0}`; there are {known}", known = NAMES.join(", "))]
    Unknown(String),
    /// This program was built without the device.
    #[error(
        "device `{0}` is not built in; build with `--features {0}` (docs/backends.md). This program has: {built_in}",
        built_in = built_in().join(", ")
    )]
    NotBuiltIn(&'static str),
    /// The device is built in, and this machine cannot run it.
    #[error("device `{name}` cannot serve on this machine: {reason}. `--device flex` runs everywhere")]
    Unavailable {
        /// The device.
        name: &'static str,
        /// What its driver or library said.
        reason: String,
    },
}

/// Names of all devices, built in or not.
pub const NAMES: [&str; 6] = ["flex", "ndarray", "wgpu", "vulkan", "cuda", "libtorch"];

/// Whether the device of this name computes on another processor than the host. `libtorch` counts as one,
/// since it is there for CUDA.
pub fn is_accelerator(name: &str) -> bool {
    !["flex", "ndarray"].contains(&name)
}

/// Names of the devices that this program was built with.
pub fn built_in() -> Vec<&'static str> {
    let features = [
        cfg!(feature = "ndarray"),
        cfg!(feature = "wgpu"),
        cfg!(feature = "vulkan"),
        cfg!(feature = "cuda"),
        cfg!(feature = "libtorch"),
    ];
    let built = std::iter::once(true).chain(features); // flex always
    NAMES.into_iter().zip(built).filter_map(|(name, built)| built.then_some(name)).collect()
}

/// The device of a name, without autodiff. A GPU computes one small sum first, once a process, so that
/// a missing driver is an error here and no panic later.
///
/// # Errors
/// [`DeviceError`] for a name that is none, a device that is not built in, and one that cannot serve on
/// this machine.
pub fn device(name: &str) -> Result<Device, DeviceError> {
    let known = NAMES.into_iter().find(|known| *known == name);
    let name = known.ok_or_else(|| DeviceError::Unknown(name.to_string()))?;
    match name {
        "flex" => Ok(Device::flex()),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "Burn deprecates the backend; it stays supported here")]
        "ndarray" => Ok(Device::ndarray()),
        #[cfg(any(feature = "wgpu", feature = "cuda", feature = "libtorch"))]
        _ if built_in().contains(&name) => {
            accelerator::open(name).map_err(|reason| DeviceError::Unavailable { name, reason })
        }
        _ => Err(DeviceError::NotBuiltIn(name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_device_serves_or_says_why_not() {
        assert_eq!(device("flex").unwrap(), Device::flex());
        for name in NAMES {
            match device(name) {
                Ok(_) => assert!(built_in().contains(&name), "{name}"),
                Err(DeviceError::NotBuiltIn(_)) => assert!(!built_in().contains(&name), "{name}"),
                Err(DeviceError::Unavailable { reason, .. }) => {
                    assert!(!["flex", "ndarray"].contains(&name) && !reason.is_empty(), "{name}: {reason}");
                }
                Err(e) => panic!("{name}: {e}"),
            }
        }
    }

    #[test]
    fn an_error_names_the_way_out() {
        let said = device("abacus").unwrap_err().to_string();
        assert!(NAMES.iter().all(|name| said.contains(name)), "{said}");
        let said = DeviceError::NotBuiltIn("cuda").to_string();
        assert!(said.contains("--features cuda") && said.contains("flex"), "{said}");
    }
}
