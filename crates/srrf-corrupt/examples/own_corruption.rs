//! A corruption of one's own: a type outside this crate that implements `Corruption`, used in registration pairs.
//!
//! ```sh
//! cargo run -p srrf-corrupt --example own_corruption
//! ```

use rand::{RngExt, rngs::ChaCha8Rng};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_corrupt::{
    CorruptError, Corrupted, Corruption, PairConfig, PairSynthesizer, PoseDraw, Severity, Stream,
    check_points, oracle_pose,
};

/// A scanner that loses points the farther they lie from it: it looks along the x axis from the positive end.
struct Fading;

impl Corruption for Fading {
    fn name(&self) -> &'static str {
        "fading"
    }

    fn apply(
        &self,
        points: &[[f64; 3]],
        severity: Severity,
        rng: &mut ChaCha8Rng,
    ) -> Result<Corrupted, CorruptError> {
        check_points(points, self.name(), 16)?;
        // Share of the points that is lost at the far side of the unit sphere.
        let lost = severity.of(&[0.2, 0.35, 0.5, 0.65, 0.8]);
        let stays = |p: &[f64; 3], draw: f64| draw >= lost * (1.0 - p[0]) / 2.0;
        let kept: Vec<u32> =
            (0u32..).zip(points).filter(|(_, p)| stays(p, rng.random())).map(|(i, _)| i).collect();
        Ok(Corrupted::subset(points, &kept))
    }
}

/// Makes a pair at each severity and checks it against perfect correspondences.
#[allow(clippy::print_stdout, reason = "an example that prints its result")]
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shapes = ProceduralShapes::new(7, 3, None)?;
    let synthesizer = PairSynthesizer::new(PairConfig { points: 512, ..PairConfig::default() })?;
    for severity in Severity::ALL {
        let stream = Stream { seed: 1, item: 0 };
        let pair = synthesizer.pair_with(&shapes, 0, Some((&Fading, severity)), PoseDraw::Seeded, stream)?;
        let mut seen: Vec<_> = pair.source_origin.iter().flatten().collect();
        seen.sort_unstable();
        seen.dedup();
        // What is left is exact, so that perfect correspondences give the exact pose.
        let pose = oracle_pose(&pair).ok_or("nothing in common")?;
        let turn = pose.angle_to_deg(&pair.target_from_source);
        println!(
            "fading {severity}: {} of 512 points are seen, the oracle is {turn:.1e} degrees off",
            seen.len()
        );
        if turn > 1e-5 || seen.len() >= 512 {
            return Err("the pair is not as it should be".into());
        }
    }
    Ok(())
}
