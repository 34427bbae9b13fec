//! The quantities that tables and figures show.

use crate::metrics::Scores;

/// How to read a value from [`Scores`], and how to print it.
pub(crate) struct Quantity {
    /// Its name in results.json, and in the names of figures.
    pub key: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// The value, if there is one.
    pub value: fn(&Scores) -> Option<f64>,
    /// The printed number is the value times this.
    pub scale: f64,
    /// Digits after the point.
    pub digits: usize,
    /// Whether more is better.
    pub more_is_better: bool,
    /// Whether it is on the screen, and has a figure.
    pub principal: bool,
}

/// All quantities, in the order of the report.
pub(crate) const QUANTITIES: [Quantity; 9] = [
    Quantity {
        key: "rmse_r",
        title: "Rotation RMSE, degrees",
        value: |s| Some(s.rmse_r),
        scale: 1.0,
        digits: 2,
        more_is_better: false,
        principal: true,
    },
    Quantity {
        key: "rmse_t",
        title: "Translation RMSE",
        value: |s| Some(s.rmse_t),
        scale: 1.0,
        digits: 4,
        more_is_better: false,
        principal: true,
    },
    Quantity {
        key: "recall",
        title: "Recall, percent (rotation under 5 degrees and translation under 0.1)",
        value: |s| Some(s.recall),
        scale: 100.0,
        digits: 1,
        more_is_better: true,
        principal: true,
    },
    Quantity {
        key: "mae_r",
        title: "Rotation MAE, degrees",
        value: |s| Some(s.mae_r),
        scale: 1.0,
        digits: 2,
        more_is_better: false,
        principal: false,
    },
    Quantity {
        key: "mae_t",
        title: "Translation MAE",
        value: |s| Some(s.mae_t),
        scale: 1.0,
        digits: 4,
        more_is_better: false,
        principal: false,
    },
    Quantity {
        key: "median_rot_deg",
        title: "Median isotropic rotation error, degrees",
        value: |s| Some(s.median_rot_deg),
        scale: 1.0,
        digits: 2,
        more_is_better: false,
        principal: true,
    },
    Quantity {
        key: "median_trans",
        title: "Median translation error",
        value: |s| Some(s.median_trans),
        scale: 1.0,
        digits: 4,
        more_is_better: false,
        principal: false,
    },
    Quantity {
        key: "chamfer",
        title: "Modified Chamfer distance x 10^4",
        value: |s| s.chamfer,
        scale: 1e4,
        digits: 2,
        more_is_better: false,
        principal: false,
    },
    Quantity {
        key: "right",
        title: "Right, percent (5 degrees, and a tenth of the target's radius where the source lands)",
        value: |s| s.right,
        scale: 100.0,
        digits: 1,
        more_is_better: true,
        principal: false,
    },
];

impl Quantity {
    /// The number that is shown, if there is one: the value times the scale.
    pub fn shown(&self, scores: &Scores) -> Option<f64> {
        (self.value)(scores).map(|value| value * self.scale)
    }
}
