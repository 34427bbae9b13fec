//! What the picture shows, in words.

use crate::encoded::{EncodedCloud, EncodedPair, EncodedPose};
use crate::number::{count, significant, with_unit};

/// A text alternative of the view.
pub(crate) fn describe(pair: &EncodedPair) -> String {
    let length = |value: f64| with_unit(&significant(value), &pair.unit);
    let mut text = format!(
        "Two point clouds: the source with {}, in orange, and the target with {}, in blue.",
        points(&pair.source),
        points(&pair.target)
    );
    let within = |value: f64| match pair.distance_limit {
        Some(limit) if value >= limit => format!("more than {}", length(limit)),
        _ => length(value),
    };
    let fit = |pose: &EncodedPose| {
        pose.summary.map(|s| {
            format!(
                "half of the source's points lie within {} of a target point, nine in ten within {}",
                within(s.median),
                within(s.p90)
            )
        })
    };
    if let Some(fit) = fit(&pair.before) {
        text += &format!(" Before registration ({}), {fit}.", pair.before.name);
    }
    for pose in &pair.poses {
        text += &format!(
            " The pose “{}” turns the source by {} degrees and moves its centre by {}",
            pose.name,
            significant(pose.turn_deg),
            length(pose.shift)
        );
        match fit(pose) {
            Some(fit) => text += &format!("; then {fit}."),
            None => text += ".",
        }
    }
    text
}

fn points(cloud: &EncodedCloud) -> String {
    if cloud.shown < cloud.count {
        format!("{} points ({} of {} shown)", count(cloud.count), count(cloud.shown), count(cloud.count))
    } else {
        format!("{} points", count(cloud.count))
    }
}
