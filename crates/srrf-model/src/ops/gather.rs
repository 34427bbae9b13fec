//! Rows of a table by their numbers.

#[cfg(any(feature = "wgpu", feature = "cuda"))]
use burn::backend::DispatchDevice;
use burn::tensor::{Device, Int, Tensor, TensorData};

/// The rows `indices` of `table`, shape `[rows, channels]` to `[indices.len(), channels]`.
pub fn rows(table: Tensor<2>, indices: &[i64]) -> Tensor<2> {
    let indices = on_device(indices, &table.device());
    rows_at(table, indices)
}

/// Row numbers on a device.
fn on_device(indices: &[i64], device: &Device) -> Tensor<1, Int> {
    let device = device.clone().without_autodiff();
    Tensor::from_data(TensorData::new(indices.to_vec(), [indices.len()]), &device)
}

/// Row numbers for [`rows_at`], found on the host. They may be sent to the device that needs them ahead of their use, for
/// such a copy waits until a GPU has done all that it was given before.
#[derive(Debug, Clone)]
pub struct RowNumbers {
    host: Vec<i64>,
    sent: Option<Tensor<1, Int>>,
}

impl RowNumbers {
    /// Row numbers on the host.
    pub fn new(host: Vec<i64>) -> Self {
        Self { host, sent: None }
    }

    /// Sends them to `device`.
    pub fn send(&mut self, device: &Device) {
        self.sent = Some(on_device(&self.host, device));
    }

    /// The numbers on `device`, which is the one they were sent to, if they were.
    pub fn on(&self, device: &Device) -> Tensor<1, Int> {
        self.sent.clone().unwrap_or_else(|| on_device(&self.host, device))
    }
}

/// The rows `indices` of `table`, shape `[rows, channels]` to `[indices, channels]`.
pub fn rows_at(table: Tensor<2>, indices: Tensor<1, Int>) -> Tensor<2> {
    if on_cubecl(&indices.device()) {
        // Its backward pass of `select` adds the rows one after the other; that of `gather` side by side.
        let ([_, channels], [count]) = (table.dims(), indices.dims());
        return table.gather(0, indices.unsqueeze_dim::<2>(1).expand([count, channels]));
    }
    table.select(0, indices)
}

/// Whether the device runs CubeCL's kernels.
pub(crate) fn on_cubecl(device: &Device) -> bool {
    match device.as_dispatch() {
        #[cfg(any(feature = "wgpu", feature = "cuda"))]
        DispatchDevice::Cube(_) => true,
        _ => false,
    }
}
