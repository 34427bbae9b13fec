//! [`Undetermined`]: a motion that the fit leaves open, in the unit and the frame of the target.

use std::fmt;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use srrf_refine::{Assessment, FreeMotion, MotionKind};

use crate::target::PreparedPair;

/// A motion that the fit leaves open: moved along it, the source fits as well. [`fmt::Display`] says it in words.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Undetermined {
    /// A slide along a direction, a turn about an axis, or a screw about one.
    #[schemars(with = "String")]
    pub motion: MotionKind,
    /// Unit vector of the direction or the axis, target frame.
    pub direction: [f64; 3],
    /// A point of the axis, target frame; none for slides.
    pub point: Option<[f64; 3]>,
    /// How far it may go back: at most 0, in the unit of the input for slides, in degrees for turns and screws.
    pub from: f64,
    /// How far it may go forth: at least 0, as `from`.
    pub to: f64,
    /// What a screw advances in a full turn, unit of the input; none for others.
    pub pitch: Option<f64>,
    /// Whether it goes on for as far as was tried.
    pub unbounded: bool,
}

impl Undetermined {
    /// What `assessment` found between the centred clouds of `pair`.
    pub(crate) fn of(assessment: &Assessment, pair: &PreparedPair) -> Vec<Self> {
        let place = |point: Vector3<f64>| pair.frame.undo_target(&point.into());
        assessment.freedom.open.iter().map(|open| Self::new(open, place)).collect()
    }

    /// Of a motion between centred clouds; `place` gives back the coordinates of the target.
    fn new(open: &FreeMotion, place: impl Fn(Vector3<f64>) -> [f64; 3]) -> Self {
        let FreeMotion { twist, kind, from, to, unbounded, .. } = *open;
        let slide = kind == MotionKind::Slide;
        let speed = if slide { twist.translation.norm() } else { twist.rotation.norm().to_degrees() };
        Self {
            motion: kind,
            direction: twist.direction(kind).into(),
            point: (!slide).then(|| place(twist.axis_point())),
            from: from * speed,
            to: to * speed,
            pitch: (kind == MotionKind::Screw).then(|| twist.pitch() * std::f64::consts::TAU),
            unbounded,
        }
    }
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.direction;
        match self.motion {
            MotionKind::Slide => f.write_str("free to slide along")?,
            MotionKind::Turn => f.write_str("free to turn about the axis")?,
            MotionKind::Screw => f.write_str("free to screw about the axis")?,
        }
        write!(f, " ({x:.3}, {y:.3}, {z:.3})")?;
        if let Some([x, y, z]) = self.point {
            write!(f, " through ({x:.4}, {y:.4}, {z:.4})")?;
        }
        let unit = if self.motion == MotionKind::Slide { "" } else { " degrees" };
        if self.unbounded {
            write!(f, ", as far as was tried ({:.3} to {:.3}{unit})", self.from, self.to)?;
        } else {
            write!(f, ", from {:.3} to {:.3}{unit}", self.from, self.to)?;
        }
        match self.pitch {
            Some(pitch) => write!(f, ", {pitch:.4} along it in a full turn"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use srrf_refine::Twist;

    use super::*;

    fn open(rotation: [f64; 3], translation: [f64; 3], kind: MotionKind) -> Undetermined {
        let twist = Twist {
            rotation: rotation.into(),
            translation: translation.into(),
            centre: Vector3::new(1.0, 0.0, 0.0),
        };
        let open = FreeMotion { twist, kind, from: -1.0, to: 2.0, unbounded: false, certain_share: 0.1 };
        Undetermined::new(&open, |p| (p + Vector3::new(100.0, 0.0, 0.0)).into())
    }

    #[test]
    fn lengths_are_the_inputs_and_angles_degrees() {
        let slide = open([0.0; 3], [0.0, 0.0, 0.5], MotionKind::Slide);
        assert_eq!((slide.from, slide.to, slide.point), (-0.5, 1.0, None));
        assert_eq!(slide.to_string(), "free to slide along (0.000, 0.000, 1.000), from -0.500 to 1.000");
        let turn = open([0.0, 0.5, 0.0], [0.0; 3], MotionKind::Turn);
        assert!((turn.to - 1f64.to_degrees()).abs() < 1e-12 && turn.pitch.is_none());
        assert_eq!(turn.point, Some([101.0, 0.0, 0.0]));
        let screw = open([0.0, 0.0, 1.0], [0.0, 0.0, 0.25], MotionKind::Screw);
        assert!((screw.pitch.unwrap() - 0.25 * std::f64::consts::TAU).abs() < 1e-12);
        assert!(screw.to_string().ends_with("degrees, 1.5708 along it in a full turn"), "{screw}");
    }
}
