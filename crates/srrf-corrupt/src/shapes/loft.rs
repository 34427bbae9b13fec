//! [`Loft`]: a body through oval or boxy cross-sections, such as a hull, a car body or a torso.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use srrf_cloud::Triangles;

/// Corners of a cross-section.
const SIDES: usize = 24;

/// A cross-section across the x axis: the superellipse `|y/a|^p + |z/b|^p = 1` about a centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    /// Position along x; stations ascend.
    pub x: f64,
    /// Centre of the section in y and z.
    pub centre: [f64; 2],
    /// Half width (y) and half height (z), above 0.
    pub half: [f64; 2],
    /// 2 is an ellipse; larger is boxier; 1 is a rhombus.
    pub power: f64,
}

impl Station {
    fn ring(&self) -> [Vector3<f64>; SIDES] {
        std::array::from_fn(|i| {
            let (sin, cos) = (TAU * i as f64 / SIDES as f64).sin_cos();
            let bend = |v: f64| v.signum() * v.abs().powf(2.0 / self.power);
            Vector3::new(
                self.x,
                self.centre[0] + self.half[0] * bend(cos),
                self.centre[1] + self.half[1] * bend(sin),
            )
        })
    }

    fn between(&self, next: &Self, along: f64) -> Self {
        let mix = |a: f64, b: f64| a + along * (b - a);
        Self {
            x: mix(self.x, next.x),
            centre: [mix(self.centre[0], next.centre[0]), mix(self.centre[1], next.centre[1])],
            half: [mix(self.half[0], next.half[0]), mix(self.half[1], next.half[1])],
            power: mix(self.power, next.power),
        }
    }
}

/// The skin through a row of stations, closed by flat ends.
#[derive(Debug, Clone)]
pub(crate) struct Loft {
    stations: Vec<Station>,
    pub surface: Triangles,
}

impl Loft {
    pub fn new(stations: &[Station]) -> Self {
        let mut surface = Triangles::default();
        let rings: Vec<_> = stations.iter().map(Station::ring).collect();
        for pair in rings.windows(2) {
            for i in 0..SIDES {
                let j = (i + 1) % SIDES;
                surface.push_quad([pair[0][i], pair[0][j], pair[1][j], pair[1][i]]);
            }
        }
        for (station, ring) in stations.iter().zip(&rings) {
            if station.x == stations[0].x || station.x == stations[stations.len() - 1].x {
                let centre = Vector3::new(station.x, station.centre[0], station.centre[1]);
                for i in 0..SIDES {
                    surface.push(centre, ring[i], ring[(i + 1) % SIDES]);
                }
            }
        }
        Self { stations: stations.to_vec(), surface }
    }

    /// Whether `p` lies strictly inside.
    pub fn contains(&self, p: &Vector3<f64>) -> bool {
        self.stations.windows(2).any(|pair| {
            let along = (p.x - pair[0].x) / (pair[1].x - pair[0].x);
            if !(along > 0.0 && along <= 1.0) || p.x >= self.stations[self.stations.len() - 1].x {
                return false;
            }
            let section = pair[0].between(&pair[1], along);
            let term =
                |c: usize| ((p[c + 1] - section.centre[c]) / section.half[c]).abs().powf(section.power);
            term(0) + term(1) < 0.97
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_oval_bar() {
        let at = |x: f64| Station { x, centre: [1.0, 0.0], half: [0.5, 0.5], power: 2.0 };
        let bar = Loft::new(&[at(0.0), at(1.0), at(4.0)]);
        let exact = 4.0 * TAU * 0.5 + 2.0 * TAU / 2.0 * 0.25;
        assert!((bar.surface.area() / exact - 1.0).abs() < 0.02, "{}", bar.surface.area());
        assert!(bar.contains(&Vector3::new(3.9, 1.3, 0.3)) && bar.contains(&Vector3::new(1.0, 1.0, 0.0)));
        assert!(!bar.contains(&Vector3::new(3.9, 1.4, 0.4)) && !bar.contains(&Vector3::new(4.1, 1.0, 0.0)));
    }
}
