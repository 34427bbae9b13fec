//! The list of corruptions for the terminal.

use std::fmt::Write;

use srrf_corrupt::{CorruptionKind, parameters as p};

/// One line for each corruption: its name, what it does, and what grows with the severity.
pub fn list() -> String {
    let mut text =
        format!("{:20} {:52} severities 1 to 5\n", "corruption", "what it does to 1,024 points of radius 1");
    for kind in CorruptionKind::ALL {
        let (what, strength) = describe(kind);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{kind:20} {what:52} {strength}");
    }
    text
}

fn describe(kind: CorruptionKind) -> (&'static str, String) {
    let row = |name: &str, values: &[f64; 5]| format!("{name} {}", values.map(|v| v.to_string()).join(" "));
    let counts = |name: &str, values: &[usize; 5]| row(name, &values.map(|v| v as f64));
    let share = |divisors: &[usize; 5]| counts("points", &divisors.map(|d| p::REFERENCE_POINTS / d));
    match kind {
        CorruptionKind::DensityInc => {
            ("clusters of 100 points gain 100 more", counts("clusters", &p::DENSITY_CLUSTERS))
        }
        CorruptionKind::DensityDec => {
            ("clusters of 100 points lose 75", counts("clusters", &p::DENSITY_CLUSTERS))
        }
        CorruptionKind::Cutout => {
            ("clusters of 30 points are removed", counts("clusters", &p::CUTOUT_CLUSTERS))
        }
        CorruptionKind::Uniform => {
            ("uniform noise on every coordinate", row("half width", &p::UNIFORM_HALF_WIDTH))
        }
        CorruptionKind::Gaussian => {
            ("Gaussian noise on every coordinate, clipped to 1", row("sigma", &p::GAUSSIAN_SIGMA))
        }
        CorruptionKind::Background => ("points are added in the cube around", share(&p::BACKGROUND_DIVISOR)),
        CorruptionKind::Impulse => {
            ("points are displaced by 0.05 on every coordinate", share(&p::IMPULSE_DIVISOR))
        }
        CorruptionKind::Upsampling => {
            ("points are added within 0.08 of others", share(&p::UPSAMPLING_DIVISOR))
        }
        CorruptionKind::Shear => ("a shear of x and z", row("coefficient", &p::SHEAR_COEFFICIENT)),
        CorruptionKind::Distortion => {
            ("free-form deformation by 5 x 5 x 5 control points", row("amplitude", &p::DISTORTION_AMPLITUDE))
        }
        CorruptionKind::DistortionRbf => {
            ("warp by 125 multiquadric basis functions", row("shift", &p::RBF_SHIFT))
        }
        CorruptionKind::DistortionRbfInv => {
            ("warp by 125 inverse multiquadric basis functions", row("shift", &p::RBF_SHIFT))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corruption_has_its_line() {
        let text = list();
        assert_eq!(text.lines().count(), 13);
        for (line, kind) in text.lines().skip(1).zip(CorruptionKind::ALL) {
            assert!(line.starts_with(kind.name()), "{line}");
        }
        assert!(text.contains("points 22 25 29 34 51"), "{text}");
    }
}
