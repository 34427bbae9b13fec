//! Which shapes of a set are held out for validation.

/// Shapes that are held out for validation: `count` of `shapes`, evenly spread, in ascending order. At least one and at
/// most half of them.
pub fn held_out(shapes: usize, count: usize) -> Vec<usize> {
    let count = count.min(shapes / 2).max(1);
    let stride = shapes as f64 / count as f64;
    (0..count).map(|i| ((i as f64 + 0.5) * stride) as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::held_out;

    #[test]
    fn held_out_shapes_are_spread_and_never_more_than_half() {
        assert_eq!(held_out(12, 3), [2, 6, 10]);
        assert_eq!(held_out(5, 100), [1, 3]);
        assert_eq!(held_out(1, 0), [0]);
        let many = held_out(9843, 192);
        assert_eq!(many.len(), 192);
        assert!(many.windows(2).all(|pair| pair[1] - pair[0] >= 51), "{many:?}");
    }
}
