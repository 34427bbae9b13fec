//! Pages that show an answer.

use std::path::Path;

use clap::Args;
use srrf::{Outcome, Warning};
use srrf_cloud::{RIGHT_IN_WORDS, Rigid};
use srrf_view::{Number, Page, Pair, Pose, Tone, Up};

use super::common::warnings_of;
use super::values::ShownValues;
use srrf_args::Failure;
use srrf_args::files::Input;
use srrf_args::words::count;

/// How to draw.
#[derive(Debug, Clone, Args)]
pub struct PageArgs {
    /// Unit of the coordinates on the page, such as `m`
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    unit: String,

    /// The axis that points up in pictures: z, y, x, -z, -y or -x [default: guessed from the target]
    #[arg(long, value_name = "AXIS", value_parser = axis, allow_hyphen_values = true)]
    up: Option<Up>,
}

/// An axis by its name.
fn axis(name: &str) -> Result<Up, String> {
    let lower = name.to_ascii_lowercase();
    let found = Up::ALL.into_iter().find(|up| up.name() == lower.trim_start_matches('+'));
    found.ok_or_else(|| "an axis is one of z, y, x, -z, -y and -x".into())
}

impl PageArgs {
    /// A pair without poses; `values` are what source and target have for each point.
    pub fn pair<'a>(&self, source: &'a Input, target: &'a Input, values: &'a [ShownValues; 2]) -> Pair<'a> {
        let mut pair = Pair::new(title(source, target), &source.cloud, &target.cloud)
            .unit(&*self.unit)
            .values(values[0].shown(), values[1].shown());
        // The frame of a depth camera: y down, z forward. glTF says that y is up.
        let camera = target.grid.is_some() && target.cloud.points().iter().all(|p| p[2] > 0.0);
        let known = if camera {
            Some(Up::MinusY)
        } else {
            matches!(target.file.format(), "gltf" | "glb").then_some(Up::Y)
        };
        if let Some(up) = self.up.or(known) {
            pair = pair.up(up);
        }
        for input in [source, target] {
            for warning in warnings_of(input) {
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

/// An answer, for a page or a picture.
pub fn of_outcome<'a>(
    outcome: &Outcome,
    source: &'a Input,
    target: &'a Input,
    values: &'a [ShownValues; 2],
    initial: Option<&Rigid>,
    args: &PageArgs,
) -> Pair<'a> {
    let e = &outcome.evidence;
    let verdict = if outcome.abstain { "abstain" } else { "probably right" };
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let (angle, _) = super::summary::angle_axis(outcome);
    let mut pair = args
        .pair(source, target, values)
        .pose(Pose::new("result", outcome.target_from_source))
        .number(
            Number::text("Verdict", format!("{verdict} ({})", percent(outcome.probability.get())))
                .tone(if outcome.abstain { Tone::Bad } else { Tone::Good })
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
    for (which, drawn) in ["Source", "Target"].into_iter().zip(&outcome.surfaces) {
        if let Some(drawn) = drawn {
            pair = pair.number(Number::text(which, super::surface::text(drawn)));
        }
    }
    if let Some(words) = super::scale::text(outcome) {
        pair = pair.number(Number::text("Scale", words));
    }
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
    // Those about the files are there already.
    let of_file = |w: &&Warning| matches!(w, Warning::LeftOut { .. } | Warning::Reading { .. });
    for warning in outcome.warnings.iter().filter(|w| !of_file(w)) {
        pair = pair.warning(warning.to_string());
    }
    pair
}

/// A pair as a page.
pub fn html(pair: Pair<'_>, source: &Input, target: &Input) -> String {
    Page::new(title(source, target)).pair(pair).to_html()
}

/// A pair as a picture.
///
/// # Errors
/// [`Failure`], where the picture cannot be made.
pub fn png(pair: &Pair<'_>) -> Result<Vec<u8>, Failure> {
    srrf_view::to_png(pair).map_err(|e| Failure::failed(format!("cannot make the picture: {e}")).because(e))
}
