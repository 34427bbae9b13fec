//! Pages that show an answer.

use std::path::Path;

use clap::Args;
use srrf::{Outcome, Warning};
use srrf_args::flags::Axis;
use srrf_cloud::{RIGHT_IN_WORDS, Rigid};
use srrf_view::{Number, Page, Pair, Pose, Up};

use super::common::left_out;
use srrf_args::files::Input;
use srrf_args::words::count;

/// How to draw.
#[derive(Debug, Clone, Args)]
pub struct PageArgs {
    /// Unit of the coordinates on the page, such as `m`
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    unit: String,

    #[command(flatten)]
    up: srrf_args::flags::UpAxis,
}

impl PageArgs {
    /// A pair without poses.
    pub fn pair<'a>(&self, source: &'a Input, target: &'a Input) -> Pair<'a> {
        let up = match self.up.up {
            Axis::Z => Up::Z,
            Axis::Y => Up::Y,
        };
        let mut pair =
            Pair::new(title(source, target), &source.cloud, &target.cloud).unit(&*self.unit).up(up);
        for input in [source, target] {
            if let Some(warning) = left_out(input) {
                pair = pair.warning(warning.to_string());
            }
        }
        pair
    }
}

/// `source to target`, by the names of the files.
pub fn title(source: &Input, target: &Input) -> String {
    let short = |input: &Input| {
        let name = Path::new(&input.name).file_name().map(|n| n.to_string_lossy().into_owned());
        name.unwrap_or_else(|| input.name.clone())
    };
    format!("{} to {}", short(source), short(target))
}

/// The page of an answer.
pub fn of_outcome(
    outcome: &Outcome,
    source: &Input,
    target: &Input,
    initial: Option<&Rigid>,
    args: &PageArgs,
) -> String {
    let e = &outcome.evidence;
    let verdict = if outcome.abstain { "abstain" } else { "probably right" };
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let (angle, _) = super::summary::angle_axis(outcome);
    let mut pair = args
        .pair(source, target)
        .pose(Pose::new("result", outcome.target_from_source))
        .number(
            Number::text("Verdict", format!("{verdict} ({})", percent(outcome.probability.get())))
                .help(format!("probability that the pose is {RIGHT_IN_WORDS} of the true one")),
        )
        .number(Number::new("Rotation", angle).unit("°"))
        .number(Number::text("Source points near the target", percent(e.fitness)).help(format!(
            "{} of {} asked, within {:.4}",
            count(e.inliers),
            count(e.source_points),
            e.inlier_threshold
        )))
        .number(
            Number::text("Target points near the source", percent(e.overlap_target))
                .help(format!("of {} asked", count(e.target_points))),
        )
        .number(Number::new("RMSE of the inliers", e.inlier_rmse))
        .number(Number::text("Start", outcome.start.to_string()));
    if let Some(initial) = initial {
        pair = pair.before(Pose::new("first guess", *initial));
    }
    if let Some(r) = &outcome.refinement {
        pair = pair.number(Number::text("Refinement", r.verdict.to_string()));
    }
    if let Some(network) = &outcome.network {
        let inliers = |ratio| {
            Number::new("Inlier ratio", ratio)
                .help("share of the branch's correspondences that agree with its pose")
        };
        pair = pair.pose(Pose::new("network, fused", network.target_from_source));
        for branch in &network.branches {
            let name = format!("network, {}", branch.kind);
            pair = pair.pose(Pose::new(name, branch.target_from_source).number(inliers(branch.inlier_ratio)));
        }
        if let Some(skeletons) = &network.skeletons {
            pair = pair.skeletons(skeletons.source.clone(), skeletons.target.clone());
        }
        pair = pair.matches(network.matches.iter().copied());
    }
    // Those about points left out are there already.
    for warning in outcome.warnings.iter().filter(|w| !matches!(w, Warning::LeftOut { .. })) {
        pair = pair.warning(warning.to_string());
    }
    Page::new(title(source, target)).pair(pair).to_html()
}
