//! Plane polygons: the point test and triangulation.

/// Whether `point` lies inside `polygon` (corners in order, either direction), by the even-odd rule.
pub(crate) fn contains(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let mut inside = false;
    for (i, &[ax, ay]) in polygon.iter().enumerate() {
        let [bx, by] = polygon[(i + 1) % polygon.len()];
        if (ay > y) != (by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay) {
            inside = !inside;
        }
    }
    inside
}

/// Triangles (corner indices) that cover a simple `polygon`, by ear clipping.
///
/// Source: Meisters, "Polygons have ears", 1975.
pub(crate) fn triangulate(polygon: &[[f64; 2]]) -> Vec<[usize; 3]> {
    let cross = |a: usize, b: usize, c: usize| {
        let ([ax, ay], [bx, by], [cx, cy]) = (polygon[a], polygon[b], polygon[c]);
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    };
    let mut left: Vec<usize> = (0..polygon.len()).collect();
    let twice_area: f64 = (1..polygon.len().max(2) - 1).map(|i| cross(0, i, i + 1)).sum();
    if twice_area < 0.0 {
        left.reverse();
    }
    let mut triangles = Vec::with_capacity(polygon.len().saturating_sub(2));
    while left.len() >= 3 {
        let n = left.len();
        let is_ear = |i: usize| {
            let [a, b, c] = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            cross(a, b, c) > 0.0
                && left.iter().all(|&p| {
                    p == a
                        || p == b
                        || p == c
                        || cross(a, b, p) <= 0.0
                        || cross(b, c, p) <= 0.0
                        || cross(c, a, p) <= 0.0
                })
        };
        // A polygon that crosses itself has no ear at some step: take any corner, to come to an end.
        let ear = (0..n).find(|&i| is_ear(i)).unwrap_or(0);
        triangles.push([left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]]);
        left.remove(ear);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_l_is_covered_once() {
        let mut l = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
        for _ in 0..2 {
            let triangles = triangulate(&l);
            assert_eq!(triangles.len(), 4);
            let area: f64 = triangles
                .iter()
                .map(|&[a, b, c]| {
                    let ([ax, ay], [bx, by], [cx, cy]) = (l[a], l[b], l[c]);
                    0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).abs()
                })
                .sum();
            assert!((area - 6.0).abs() < 1e-12, "{area}");
            assert!(contains(&l, [0.5, 3.5]) && contains(&l, [2.5, 0.5]));
            assert!(!contains(&l, [2.0, 2.0]) && !contains(&l, [-0.1, 0.5]));
            l.reverse();
        }
        assert!(triangulate(&l[..2]).is_empty() && triangulate(&[]).is_empty());
    }
}
