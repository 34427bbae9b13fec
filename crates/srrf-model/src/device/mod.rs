//! Devices by name. Which ones a program has is settled when it is built, by the cargo features
//! `ndarray`, `wgpu`, `vulkan`, `cuda` and `libtorch`; which of them runs the network, by `--device`.
//! `cuda:1` is the second device of its kind, `cuda:0,cuda:1` a list for training on both.

#[cfg(any(feature = "wgpu", feature = "cuda", feature = "libtorch"))]
mod accelerator;

use burn::tensor::Device;

/// Why a device cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DeviceError {
    /// No device has this name.
    #[error("no device is called `{0}`; there are {known}, and `cuda:1` for the second of a kind", known = NAMES.join(", "))]
    Unknown(String),
    /// A list of devices that do not go together.
    #[error("devices `{0}`: name devices of one kind, each once, such as `cuda:0,cuda:1`")]
    List(String),
    /// This program was built without the device.
    #[error(
        "device `{0}` is not built in; build with `--features {0}` (book/src/train/devices.md). This program has: {built_in}",
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

/// Whether the device of this name, or the first of this list, computes on another processor than the
/// host. `libtorch` counts as one, since it is there for CUDA.
pub fn is_accelerator(name: &str) -> bool {
    !["flex", "ndarray"].contains(&kind(name))
}

/// The kind of the device of this name, or of those of this list: `cuda` of `cuda:0,cuda:1`.
pub fn kind(name: &str) -> &str {
    name.split([':', ',']).next().unwrap_or(name).trim()
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

/// The device of a name, without autodiff: `cuda` or `cuda:0` is the first of its kind, `cuda:1` the second. A GPU
/// computes one small sum first, once a process, so that a missing driver is an error here and no panic later.
///
/// # Errors
/// [`DeviceError`] for a name that is none, a device that is not built in, and one that cannot serve on
/// this machine.
pub fn device(name: &str) -> Result<Device, DeviceError> {
    let (name, index) = parse(name)?;
    open(name, index)
}

/// Number `index` of the devices of a name of [`NAMES`].
fn open(name: &'static str, index: usize) -> Result<Device, DeviceError> {
    match name {
        "flex" | "ndarray" if index > 0 => {
            let reason = format!("it is the processor, and there is no number {index} of it");
            Err(DeviceError::Unavailable { name, reason })
        }
        "flex" => Ok(Device::flex()),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "Burn deprecates the backend; it stays supported here")]
        "ndarray" => Ok(Device::ndarray()),
        #[cfg(any(feature = "wgpu", feature = "cuda", feature = "libtorch"))]
        _ if built_in().contains(&name) => {
            accelerator::open(name, index).map_err(|reason| DeviceError::Unavailable { name, reason })
        }
        _ => Err(DeviceError::NotBuiltIn(name)),
    }
}

/// The devices of a list such as `cuda:0,cuda:1`, or of one name.
///
/// # Errors
/// As [`device`]; [`DeviceError::List`] where they are of several kinds, or one is named twice.
pub fn devices(list: &str) -> Result<Vec<Device>, DeviceError> {
    let parsed: Vec<(&str, usize)> =
        list.split(',').map(|name| parse(name.trim())).collect::<Result<_, _>>()?;
    let twice = |i: usize| parsed[..i].contains(&parsed[i]);
    if parsed.iter().any(|(kind, _)| *kind != parsed[0].0) || (0..parsed.len()).any(twice) {
        return Err(DeviceError::List(list.to_string()));
    }
    parsed.into_iter().map(|(name, index)| open(name, index)).collect()
}

/// `NAME` or `NAME:INDEX`.
fn parse(name: &str) -> Result<(&'static str, usize), DeviceError> {
    let unknown = || DeviceError::Unknown(name.to_string());
    let (kind, index) = match name.split_once(':') {
        Some((kind, index)) => (kind, index.parse().map_err(|_| unknown())?),
        None => (name, 0),
    };
    NAMES.into_iter().find(|known| *known == kind).map(|kind| (kind, index)).ok_or_else(unknown)
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
        assert!(device("flex:x").is_err() && device("flex:-1").is_err() && device(":0").is_err());
        let said = device("flex:1").unwrap_err().to_string();
        assert!(said.contains("no number 1"), "{said}");
        let said = DeviceError::NotBuiltIn("cuda").to_string();
        assert!(said.contains("--features cuda") && said.contains("flex"), "{said}");
    }

    #[test]
    fn a_list_names_devices_of_one_kind_once() {
        assert_eq!(devices("flex").unwrap(), [Device::flex()]);
        assert_eq!(devices("flex:0").unwrap(), [Device::flex()]);
        for list in ["flex,flex:0", "flex,ndarray", "cuda:0,cuda:1,cuda:0", "cuda:0,libtorch:1"] {
            let said = devices(list).unwrap_err().to_string();
            assert!(said.contains(list) && said.contains("`cuda:0,cuda:1`"), "{said}");
        }
        assert!(matches!(devices("flex,"), Err(DeviceError::Unknown(name)) if name.is_empty()));
        assert!(
            is_accelerator("cuda:1") && is_accelerator("libtorch:0,libtorch:1") && !is_accelerator("flex:0")
        );
    }
}
