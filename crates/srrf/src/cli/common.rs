//! What several verbs share: exit codes, and what an answer or an error is called in files and messages.

use serde_json::Value;
use srrf::{Answer, Outcome, PointCounts, RunKeys, Warning};
use srrf_args::Failure;
use srrf_args::files::Input;

/// The exit codes, for help texts.
pub const EXIT_CODES: &str = "Exit codes:
  0    done; with `register`: a pose was found and is probably right
  1    failure: no pose was found, or an output could not be written
  2    bad usage or input
  3    `register` found a pose and wrote it, but abstains: it may well be wrong
  130  interrupted; no half-written file remains";

/// The figures of an answer, and of what it was made from.
pub fn answer(outcome: &Outcome, source: &str, target: &str, dropped: [usize; 2]) -> Answer {
    let mut answer = Answer::new(outcome);
    answer.run = RunKeys {
        source: Some(source.to_owned()),
        target: Some(target.to_owned()),
        dropped_points: Some(PointCounts { source: dropped[0], target: dropped[1] }),
        version: Some(env!("CARGO_PKG_VERSION").to_owned()),
        ..RunKeys::default()
    };
    answer
}

/// As `answer`, as JSON.
pub fn to_json(outcome: &Outcome, source: &str, target: &str, dropped: [usize; 2]) -> Value {
    // Numbers, texts and lists of them always are JSON.
    serde_json::to_value(answer(outcome, source, target, dropped)).unwrap_or_default()
}

/// The failure behind options that the library cannot use.
pub fn unusable(error: srrf::Error) -> Failure {
    let message = match &error {
        srrf::Error::Weights(e) => format!("--weights {e}"),
        other => other.to_string(),
    };
    Failure::usage(message).because(error)
}

/// The failure behind an error of the library, which knows no files.
pub fn failed(error: srrf::Error, source: &str, target: &str) -> Failure {
    match error {
        srrf::Error::Source(e) => Failure::cloud(source, &e),
        srrf::Error::Target(e) => Failure::cloud(target, &e),
        srrf::Error::Weights(_) | srrf::Error::Device(_) | srrf::Error::Calibration(_) => unusable(error),
        srrf::Error::Scale(doubt) => Failure::usage(format!(
            "{source:?} and {target:?} seem to be in different units of length: {doubt}{}{}",
            stated_unit(source),
            stated_unit(target)
        )),
        srrf::Error::Copy(e) => Failure::other(e),
        srrf::Error::Stopped => Failure::other(error),
        srrf::Error::NoPose(_) | srrf::Error::NoSkeleton | srrf::Error::Refine(_) => Failure::failed(format!(
            "{source:?} and {target:?}: {error}; look at both with `srrf inspect`, or give a first guess with --initial"
        ))
        .because(error),
    }
}

/// What the format of a file says of its unit of length, for a message.
fn stated_unit(name: &str) -> String {
    let extension =
        std::path::Path::new(name).extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.split('#').next() {
        Some("e57" | "glb" | "gltf") => format!("; files such as {name:?} are in metres by their format"),
        _ => String::new(),
    }
}

/// The warnings about a file: points that were left out, and what is to be known of its reading.
pub fn warnings_of(input: &Input) -> Vec<Warning> {
    let cloud = || input.name.clone();
    let left_out = (input.dropped > 0).then(|| Warning::LeftOut { cloud: cloud(), points: input.dropped });
    let notes = input.notes.iter().map(|note| Warning::Reading { cloud: cloud(), note: note.clone() });
    left_out.into_iter().chain(notes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_that_state_their_unit() {
        assert!(stated_unit("a/b.E57#2").contains("in metres by their format"));
        assert_eq!(stated_unit("part.stl"), "");
    }
}
