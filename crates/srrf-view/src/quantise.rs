//! Points and distances as 16-bit numbers in base64.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

const STEPS: f64 = u16::MAX as f64;

/// Points in a frame whose origin is the centre of their bounding box and whose axes are the
/// cloud's.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct QuantisedPoints {
    /// Edges of the bounding box.
    pub extent: [f64; 3],
    /// Base64 of little-endian `u16`, shape `[n, 3]`: 0 and 65535 are the faces of the box.
    pub data: String,
    /// The centre of the box in the cloud's coordinates; not needed for drawing.
    #[serde(skip)]
    pub centre: [f64; 3],
}

/// Distances, or any numbers that are not negative.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct QuantisedValues {
    /// The largest value, which 65535 stands for.
    pub max: f64,
    /// Base64 of little-endian `u16`, shape `[n]`.
    pub data: String,
}

/// Rounds finite points; the error along an axis is at most `extent / 65535 / 2`.
pub(crate) fn quantise_points(points: impl Iterator<Item = [f64; 3]> + Clone) -> QuantisedPoints {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in points.clone() {
        for axis in 0..3 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    // Halved before the difference and the sum, which may be beyond f64 otherwise.
    let centre = std::array::from_fn(|axis| high[axis] / 2.0 + low[axis] / 2.0);
    let extent: [f64; 3] = std::array::from_fn(|axis| (high[axis] - low[axis]).min(f64::MAX));
    let mut bytes = Vec::new();
    for p in points {
        for axis in 0..3 {
            bytes.extend(step(p[axis] - low[axis], extent[axis]).to_le_bytes());
        }
    }
    QuantisedPoints { extent, data: STANDARD.encode(bytes), centre }
}

/// Rounds values from 0 to their maximum; the error is at most `max / 65535 / 2`. Infinity and NaN
/// count as the largest finite number, so that they stand out.
pub(crate) fn quantise_values(values: &[f64]) -> QuantisedValues {
    let max = values.iter().copied().fold(0.0, f64::max).min(f64::MAX);
    let bytes: Vec<u8> = values.iter().flat_map(|v| step(v.min(f64::MAX), max).to_le_bytes()).collect();
    QuantisedValues { max, data: STANDARD.encode(bytes) }
}

/// Any numbers as bytes: 0 up to the smallest percent of them, 255 from the largest percent on. NaN counts as the smallest.
pub(crate) fn quantise_bytes(values: &[f64]) -> Vec<u8> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| sorted.get((sorted.len().saturating_sub(1) as f64 * share).round() as usize);
    let (Some(&low), Some(&high)) = (at(0.01), at(0.99)) else { return vec![0; values.len()] };
    // A cast saturates, and takes NaN for 0. Halved, since a difference may be beyond f64.
    let width = high / 2.0 - low / 2.0;
    let byte =
        |v: &f64| if width > 0.0 { ((v / 2.0 - low / 2.0) / width * 255.0).round() as u8 } else { 128 };
    values.iter().map(byte).collect()
}

fn step(value: f64, extent: f64) -> u16 {
    // A cast saturates.
    if extent > 0.0 { (value / extent * STEPS).round() as u16 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(data: &str) -> Vec<f64> {
        let bytes = STANDARD.decode(data).unwrap();
        bytes.chunks_exact(2).map(|b| f64::from(u16::from_le_bytes([b[0], b[1]])) / STEPS).collect()
    }

    #[test]
    fn points_come_back_within_the_stated_error_far_from_the_origin() {
        let points: Vec<[f64; 3]> = (0..1003)
            .map(|i| {
                let s = f64::from(i);
                [500_000.0 + 40.0 * s.sin(), 5_400_000.0 + 7.0 * (1.3 * s).cos(), 120.0]
            })
            .collect();
        let packed = quantise_points(points.iter().copied());
        let back = decode(&packed.data);
        for (i, p) in points.iter().enumerate() {
            for axis in 0..3 {
                let local = (back[3 * i + axis] - 0.5) * packed.extent[axis];
                let error = (local + packed.centre[axis] - p[axis]).abs();
                assert!(error <= packed.extent[axis] / STEPS / 2.0 + 1e-8, "{error}");
            }
        }
        assert_eq!(packed.extent[2], 0.0);
        assert_eq!(packed.centre[2], 120.0);
    }

    #[test]
    fn intensities_fill_their_range() {
        let values: Vec<f64> = (0..=1000).map(f64::from).chain([1e9, f64::NAN, f64::INFINITY]).collect();
        let bytes = quantise_bytes(&values);
        assert_eq!((bytes[0], bytes[500], bytes[1000]), (0, 127, 255));
        assert_eq!(bytes[1001..], [255, 0, 255]);
        assert_eq!(quantise_bytes(&[7.0; 3]), [128; 3]);
        assert_eq!(quantise_bytes(&[f64::NAN]), [0]);
    }

    #[test]
    fn values_come_back_and_bad_ones_do_no_harm() {
        let values = [0.0, 0.125, 3.0, 0.9];
        let packed = quantise_values(&values);
        assert_eq!(packed.max, 3.0);
        for (v, b) in values.iter().zip(decode(&packed.data)) {
            assert!((v - b * packed.max).abs() <= packed.max / STEPS / 2.0);
        }
        assert_eq!(quantise_values(&[0.0; 3]).max, 0.0);
        assert_eq!(decode(&quantise_values(&[f64::NAN, 2.0, f64::INFINITY]).data), [1.0, 0.0, 1.0]);
    }
}
