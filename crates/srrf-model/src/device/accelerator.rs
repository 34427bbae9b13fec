//! Opens a GPU: asks its driver, computes one small sum, and turns whatever goes wrong into words.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Mutex};

#[cfg(feature = "wgpu")]
use burn::tensor::wgpu::WgpuBackend;
use burn::tensor::{Device, Tensor};

/// What opening each device gave: a runtime can be set up once only.
static OPENED: Mutex<BTreeMap<(&str, usize), Result<Device, String>>> = Mutex::new(BTreeMap::new());

/// Number `index` of the devices of a name that is built in, or why it cannot serve.
pub fn open(name: &'static str, index: usize) -> Result<Device, String> {
    let mut opened = OPENED.lock().map_err(|e| e.to_string())?;
    let acquired = || quietly(|| acquire(name, index)).and_then(|found| found);
    opened.entry((name, index)).or_insert_with(acquired).clone()
}

/// Sets the device up and sees whether it can add.
fn acquire(name: &str, index: usize) -> Result<Device, String> {
    let device = match name {
        "wgpu" | "vulkan" if index > 0 => {
            return Err("of a graphics interface this program takes the first device only".into());
        }
        #[cfg(feature = "wgpu")]
        "wgpu" => graphics(WgpuBackend::Auto)?,
        #[cfg(feature = "vulkan")]
        "vulkan" => graphics(WgpuBackend::Vulkan)?,
        #[cfg(feature = "cuda")]
        "cuda" => Device::cuda(index),
        #[cfg(feature = "libtorch")]
        "libtorch" => libtorch(index)?,
        _ => return Err("no such device".into()),
    };
    let sum = Tensor::<1>::from_floats([1.0, 2.0, 4.0], &device).sum();
    match sum.try_to_vec_as::<f32>() {
        Ok(values) if values == [7.0] => Ok(device),
        Ok(values) => Err(format!("1 + 2 + 4 gave {values:?} on it")),
        Err(e) => Err(e.to_string()),
    }
}

/// LibTorch's CUDA device of this number, or the CPU where it has none.
#[cfg(feature = "libtorch")]
#[allow(
    deprecated,
    reason = "Burn deprecates the backend; on one H100 it trains faster than its own kernels"
)]
fn libtorch(index: usize) -> Result<Device, String> {
    match tch::Cuda::device_count() {
        count if index >= 1.max(count as usize) => {
            Err(format!("LibTorch sees {count} CUDA devices, and no number {index}"))
        }
        0 => Ok(Device::libtorch()),
        _ => Ok(Device::libtorch_cuda(index)),
    }
}

/// A device behind a graphics interface.
#[cfg(feature = "wgpu")]
fn graphics(api: WgpuBackend) -> Result<Device, String> {
    let options = Device::wgpu_options().graphics_api(api);
    let (device, setup) = options.init_with_setup().map_err(|e| e.to_string())?;
    let adapter = setup.adapter.get_info();
    // A crash inside the driver is no panic, so it has to be known beforehand.
    if cfg!(feature = "vulkan") && adapter.driver == "llvmpipe" && adapter.driver_info.starts_with("Mesa 22.")
    {
        return Err(format!(
            "{} ({}) crashes on the SPIR-V shaders of the `vulkan` feature; a program with `--features wgpu` \
             alone works there",
            adapter.name, adapter.driver_info
        ));
    }
    Ok(device)
}

/// Runs `job` with panics caught, of its own thread and of the device's, and with nothing printed: the
/// first message is the error.
fn quietly<T>(job: impl FnOnce() -> T) -> Result<T, String> {
    let first: Arc<Mutex<Option<String>>> = Arc::default();
    let heard = first.clone();
    let hook = take_hook();
    set_hook(Box::new(move |info| {
        if let (Ok(mut first), Some(message)) = (heard.lock(), info.payload_as_str()) {
            first.get_or_insert_with(|| message.to_string());
        }
    }));
    let result = catch_unwind(AssertUnwindSafe(job));
    set_hook(hook);
    result.map_err(|_| {
        let message = first.lock().ok().and_then(|mut first| first.take());
        message.unwrap_or_else(|| "its driver gave up without a word".into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        assert_eq!(quietly(|| 3), Ok(3));
        let said = quietly(|| -> u8 { panic!("no library {}", 7) });
        assert_eq!(said, Err("no library 7".to_string()));
    }
}
