//! An answer in words and figures, for the terminal.

use std::fmt::Write;

use nalgebra::Vector3;
use srrf::{DrawnSurface, Outcome};
use srrf_cloud::RIGHT_IN_WORDS;

use srrf_args::files::Input;
use srrf_args::words::{count, length, points, vector};

/// The answer. `seconds` is the whole time.
pub fn text(outcome: &Outcome, source: &Input, target: &Input, seconds: f64) -> String {
    let mut out = String::new();
    let mut line = |label: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{label:12} {value}");
    };
    line("source", &cloud(source, &outcome.surfaces[0]));
    line("target", &cloud(target, &outcome.surfaces[1]));

    let pose = &outcome.target_from_source;
    let (angle, axis) = angle_axis(outcome);
    let about = axis.map_or_else(String::new, |a| format!(" about {}", vector(a, 1.0, 4)));
    line("rotation", &format!("{angle:.3}°{about}"));
    let centre: Vector3<f64> = source.cloud.centroid();
    let shift: [f64; 3] = (Vector3::from(pose.apply(&centre.into())) - centre).into();
    let scale = outcome.evidence.spacing;
    let translation: [f64; 3] = pose.translation.into();
    if let Some(words) = super::scale::text(outcome) {
        line("scale", &words);
    }
    line("translation", &vector(translation, scale, 3));
    line("", &format!("the source's centre moves by {}", vector(shift, scale, 3)));

    let verdict = if outcome.abstain { "abstain: do not rely on it" } else { "probably right" };
    line(
        "verdict",
        &format!("{verdict}; {:.0} % that it is right ({RIGHT_IN_WORDS})", 100.0 * outcome.probability.get()),
    );
    if outcome.poses.len() > 1 {
        line("poses", &format!("{} fit as well; all are in --json", outcome.poses.len()));
    }
    for (number, motion) in outcome.undetermined.iter().enumerate() {
        line(if number == 0 { "undetermined" } else { "" }, &motion.to_string());
    }
    evidence(outcome, &mut line);
    line("time", &times(outcome, seconds));
    for warning in &outcome.warnings {
        line("warning", &warning.to_string());
    }
    out.truncate(out.trim_end().len());
    out
}

fn evidence(outcome: &Outcome, line: &mut impl FnMut(&str, &str)) {
    let e = &outcome.evidence;
    line(
        "evidence",
        &format!(
            "{} of {} asked source points ({:.0} %) lie within {} of the target, RMSE {}",
            count(e.inliers),
            count(e.source_points),
            100.0 * e.fitness,
            length(e.inlier_threshold, 3),
            length(e.inlier_rmse, 3),
        ),
    );
    line(
        "",
        &format!(
            "{:.0} % of {} asked target points have a source point as near",
            100.0 * e.overlap_target,
            count(e.target_points)
        ),
    );
    let ([x, y, z], shift) = (outcome.spread.rotation_deg(), outcome.spread.translation());
    if shift.iter().all(|s| s.is_finite()) {
        line(
            "",
            &format!(
                "spread by noise: {:.3}° and {} (standard deviation)",
                x.max(y).max(z),
                length(shift.iter().copied().fold(0.0, f64::max), 3)
            ),
        );
    }
    line("", &format!("start: {}", outcome.start));
    match &outcome.refinement {
        None => line("", "no refinement: this is the coarse pose"),
        Some(r) => {
            let stopped = if r.converged { "converged after" } else { "stopped after" };
            line("", &format!("refinement: {}; {stopped} {} iterations", r.verdict, r.iterations));
        }
    }
}

fn cloud(input: &Input, surface: &Option<DrawnSurface>) -> String {
    if let Some(drawn) = surface {
        return format!("{}: {}", input.name, super::surface::text(drawn));
    }
    let dropped = match input.dropped {
        0 => String::new(),
        n => format!(", {} more with NaN or infinity left out", count(n)),
    };
    format!("{}: {}{dropped}", input.name, points(input.cloud.len()))
}

fn times(outcome: &Outcome, seconds: f64) -> String {
    let stages: Vec<String> = outcome.times.iter().map(|t| format!("{} {:.3}", t.stage, t.seconds)).collect();
    format!("{seconds:.3} s: {}", stages.join("; "))
}

/// Angle of the rotation in degrees, and its axis where there is one.
pub fn angle_axis(outcome: &Outcome) -> (f64, Option<[f64; 3]>) {
    let [w, x, y, z] = outcome.quaternion_wxyz();
    let imaginary = Vector3::new(x, y, z);
    let sine = imaginary.norm();
    let angle = 2.0 * sine.atan2(w).to_degrees();
    (angle, (sine > 1e-9).then(|| (imaginary / sine).into()))
}
