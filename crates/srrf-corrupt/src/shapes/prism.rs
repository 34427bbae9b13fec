//! [`Prism`]: an extruded polygon, straight or tapered. Boxes are prisms.

use nalgebra::Vector3;

use super::polygon;
use srrf_cloud::Triangles;

/// A polygon in the xy plane, extruded along z from 0 to `height`. At the top it is scaled about
/// the origin by `top_scale` and shifted by `top_shift`.
#[derive(Debug, Clone)]
pub(crate) struct Prism {
    polygon: Vec<[f64; 2]>,
    height: f64,
    top_scale: [f64; 2],
    top_shift: [f64; 2],
    pub surface: Triangles,
}

impl Prism {
    pub fn new(polygon: &[[f64; 2]], height: f64, top_scale: [f64; 2], top_shift: [f64; 2]) -> Self {
        let bottom: Vec<_> = polygon.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
        let top: Vec<_> = polygon
            .iter()
            .map(|p| {
                let at = |c: usize| p[c] * top_scale[c] + top_shift[c];
                Vector3::new(at(0), at(1), height)
            })
            .collect();
        let mut surface = Triangles::default();
        for [a, b, c] in polygon::triangulate(polygon) {
            surface.push(bottom[a], bottom[b], bottom[c]);
            surface.push(top[a], top[b], top[c]);
        }
        for i in 0..polygon.len() {
            let j = (i + 1) % polygon.len();
            surface.push_quad([bottom[i], bottom[j], top[j], top[i]]);
        }
        Self { polygon: polygon.to_vec(), height, top_scale, top_shift, surface }
    }

    /// Whether `p` lies strictly inside.
    pub fn contains(&self, p: &Vector3<f64>) -> bool {
        let up = p.z / self.height;
        if !(up > 0.0 && up < 1.0) {
            return false;
        }
        let flat = |c: usize| (p[c] - up * self.top_shift[c]) / (1.0 + up * (self.top_scale[c] - 1.0));
        polygon::contains(&self.polygon, [flat(0), flat(1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_and_inside_of_a_box_and_a_wedge() {
        let square = [[-1.0, -1.5], [1.0, -1.5], [1.0, 1.5], [-1.0, 1.5]];
        let straight = Prism::new(&square, 5.0, [1.0, 1.0], [0.0, 0.0]);
        assert!((straight.surface.area() - 2.0 * (6.0 + 10.0 + 15.0)).abs() < 1e-9);
        assert!(straight.contains(&Vector3::new(0.9, -1.4, 4.9)));
        assert!(!straight.contains(&Vector3::new(0.0, 0.0, 5.1)));

        let pyramid = Prism::new(&square, 5.0, [0.0, 0.0], [3.0, 0.0]);
        assert!(pyramid.contains(&Vector3::new(2.95, 0.0, 4.9)));
        assert!(!pyramid.contains(&Vector3::new(0.0, 0.0, 4.9)));
    }
}
