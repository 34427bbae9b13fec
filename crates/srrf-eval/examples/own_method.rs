//! A method of your own, scored beside the program's: one type, one line.
//!
//! ```text
//! cargo run -p srrf-eval --example own_method
//! ```

use std::io::{self, Write};

use srrf_cloud::{Register, RegisterError, Registration, Rigid, Solid};
use srrf_corrupt::{CorruptionKind, Severity};
use srrf_eval::{
    DefaultRows, EvalError, MethodContext, MethodSet, Protocol, ReadyMethod, Run, Summary, SynthesizedPairs,
    data, report,
};

/// Lays the centroid of the source onto that of the target.
struct Centroids;

impl Register for Centroids {
    fn name(&self) -> &str {
        "centroids"
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        let translation = target.centroid() - source.centroid();
        Ok(Registration::from_pose(Rigid { translation, ..Rigid::identity() }))
    }
}

/// Scores it beside ICP and what perfect correspondences would give.
pub fn score() -> Result<Summary, EvalError> {
    let pairs = SynthesizedPairs::new(
        data::procedural(5)?,
        Protocol {
            corruptions: vec![CorruptionKind::Cutout, CorruptionKind::Gaussian],
            severities: vec![Severity::ALL[2]],
            shapes: 5,
            ..Protocol::default()
        },
    )?;
    let known = ["icp", "oracle"].map(str::to_owned);
    let methods = MethodSet::new(&known, DefaultRows::Plain, &MethodContext::default())?
        .with(ReadyMethod::new(Centroids));
    let outcome = Run::new(&pairs, &methods).execute(&mut |_, _| {})?;
    Summary::of(&outcome)
}

#[allow(dead_code, reason = "the test calls `score`")]
fn main() -> Result<(), EvalError> {
    // A closed pipe is no failure.
    let _ = writeln!(io::stdout(), "{}", report::screen(&score()?));
    Ok(())
}
