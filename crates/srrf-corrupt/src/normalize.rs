//! The box normalisation of ModelNet40-C.

/// The frame in which a cloud's bounding box is centred and has longest side 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxFrame {
    /// Centre of the original bounding box.
    pub centre: [f64; 3],
    /// Half of its longest side; 1 if that is 0.
    pub half_side: f64,
}

/// Centres the bounding box of `points` (shape `[n, 3]`) and scales its longest side to 2, in
/// place, and returns what was done. On clean unit-sphere shapes this scales by 1.28 on average:
/// it is not the unit-sphere normalisation. Empty lists are left alone.
pub fn box_normalize(points: &mut [[f64; 3]]) -> BoxFrame {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in points.iter() {
        for c in 0..3 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    let centre = std::array::from_fn(|c| if points.is_empty() { 0.0 } else { 0.5 * (low[c] + high[c]) });
    let half_side = (0..3).map(|c| 0.5 * (high[c] - low[c])).fold(0.0, f64::max);
    let frame = BoxFrame { centre, half_side: if half_side > 0.0 { half_side } else { 1.0 } };
    for p in points.iter_mut() {
        *p = std::array::from_fn(|c| (p[c] - frame.centre[c]) / frame.half_side);
    }
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_side_becomes_two() {
        let mut points = vec![[1.0, 2.0, 3.0], [5.0, 3.0, 2.0], [2.0, 2.5, 2.5]];
        let frame = box_normalize(&mut points);
        assert_eq!(frame, BoxFrame { centre: [3.0, 2.5, 2.5], half_side: 2.0 });
        assert_eq!(points, [[-1.0, -0.25, 0.25], [1.0, 0.25, -0.25], [-0.5, 0.0, 0.0]]);
    }

    #[test]
    fn a_point_or_nothing_is_no_trouble() {
        let mut points = vec![[7.0, 8.0, 9.0]];
        box_normalize(&mut points);
        assert_eq!(points, [[0.0; 3]]);
        assert_eq!(box_normalize(&mut []).half_side, 1.0);
    }
}
