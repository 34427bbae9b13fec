//! Copies from a device to the host.

use burn::tensor::{Element, Tensor, TensorReadError};
use srrf_cloud::RegisterError;

/// What a device computed could not be copied to the host: it stopped, it ran out of memory, or its numbers are of a kind
/// that the host cannot take.
#[derive(Debug, thiserror::Error)]
#[error("what the device computed could not be copied to the host: {source}")]
pub struct CopyError {
    /// What the backend said.
    #[source]
    source: TensorReadError,
}

impl From<CopyError> for RegisterError {
    fn from(error: CopyError) -> Self {
        Self::Device(Box::new(error))
    }
}

/// The numbers of a tensor, row by row.
///
/// # Errors
/// [`CopyError`] where the device does not give them.
pub fn to_host<E: Element, const D: usize>(tensor: &Tensor<D>) -> Result<Vec<E>, CopyError> {
    tensor.try_to_vec_as::<E>().map_err(|source| CopyError { source })
}

#[cfg(test)]
mod tests {
    use burn::tensor::quantization::{QuantScheme, QuantValue};
    use burn::tensor::{DType, Device};

    use super::*;

    #[test]
    fn numbers_that_the_host_cannot_take_are_an_error() {
        let tensor = Tensor::<2>::from_floats([[1.0, -2.0], [0.5, 4.0]], &Device::flex());
        assert_eq!(to_host::<f64, 2>(&tensor).unwrap(), [1.0, -2.0, 0.5, 4.0]);
        let quantized = tensor.quantize_dynamic(&QuantScheme::default().with_value(QuantValue::Q8S));
        assert!(matches!(quantized.dtype(), DType::QFloat(_)));
        let error = to_host::<f32, 2>(&quantized).unwrap_err();
        assert!(error.to_string().starts_with("what the device computed could not be copied to the host: "));
        assert!(std::error::Error::source(&error).is_some());
    }
}
