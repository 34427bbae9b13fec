//! How far the pairs of one set of scans may be trusted: by what scanners saw through, and by how often sure pairs turn out wrong.
//!
//! A registration says how likely it is right among scenes in general. Where places look alike it is surely wrong again and again,
//! so that the same figure means less. Source of the correction: Saerens, Latinne and Decaestecker, "Adjusting the outputs of a
//! classifier to new a priori probabilities", 2002.

/// Share of points that scanners see through of what is there, as long as nothing else is known: things move, edges are thick. Scans
/// may show that it is less, never that it is more: where most pairs are wrong, what is usual among them says nothing.
const USUAL: f64 = 0.002;
/// A point in 50,000.
const LEAST: f64 = 2e-5;
/// How many pairs that counts for.
const USUAL_WORTH: f64 = 1.0;
/// How many sure pairs are right before any is asked.
const WORTH: f64 = 2.0;
/// Shares below this are all alike: a point in 2,000.
const FINEST: f64 = 5e-4;
const MOST_ROUNDS: usize = 50;
/// No pair is surer than this by itself.
const SUREST: f64 = 0.999;
/// The odds of all pairs fall by no more than this factor, e to this power.
const MOST_SHIFT: f64 = 6.0;

/// Log odds.
pub fn logit(p: f64) -> f64 {
    let p = p.clamp(1.0 - SUREST, SUREST);
    (p / (1.0 - p)).ln()
}

/// The probability of log odds.
pub fn of_logit(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds).exp())
}

/// What seen-through shares say. Right pairs: exponential about what is usual in these scans. Wrong pairs: any size is as likely
/// as any other (1 / share), since rooms may differ in a cup or in all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    usual: f64,
}

impl Sight {
    /// As long as no pair is known.
    pub fn usual() -> Self {
        Self { usual: USUAL }
    }

    /// What is usual, by expectation and maximisation from the pairs that are rather right. `prior` is that of the registrations.
    pub fn learned(prior: &[f64], share: &[Option<f64>]) -> Self {
        let mut sight = Self { usual: LEAST };
        for _ in 0..MOST_ROUNDS {
            let (mut sum, mut count) = (USUAL_WORTH * USUAL, USUAL_WORTH);
            for (p, share) in prior.iter().zip(share) {
                if let Some(share) = share.filter(|_| *p > 0.0) {
                    let right = of_logit(logit(*p) + sight.log_ratio(share));
                    sum += right * share;
                    count += right;
                }
            }
            let next = (sum / count).clamp(LEAST, USUAL);
            let still = (next - sight.usual).abs() < 1e-3 * sight.usual;
            sight.usual = next;
            if still {
                break;
            }
        }
        sight
    }

    /// How much likelier a share is of right pairs than of wrong ones, as a logarithm.
    pub fn log_ratio(self, share: f64) -> f64 {
        let right = -self.usual.ln() - share / self.usual;
        let wrong = -((1.0 - FINEST.ln()) * share.max(FINEST)).ln();
        right - wrong
    }
}

/// How much the odds of all pairs are to fall, as a logarithm, where `posterior` has become of `prior`: sure pairs alone are asked.
pub fn shift(prior: &[f64], posterior: &[f64]) -> f64 {
    let (mut before, mut after, mut count) = (0.0, 0.0, 0.0);
    for (p, q) in prior.iter().zip(posterior).filter(|(p, _)| **p >= 0.5) {
        before += p;
        after += q;
        count += 1.0;
    }
    if count == 0.0 {
        return 0.0;
    }
    let before = before / count;
    let after = (after + WORTH * before) / (count + WORTH);
    (logit(after) - logit(before)).clamp(-MOST_SHIFT, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_usual_is_learned_from_the_pairs_that_are_rather_right() {
        // Still rooms: right pairs see through nothing, wrong ones through one or two in a hundred.
        let prior = [0.92; 16];
        let still: Vec<Option<f64>> =
            (0..16).map(|i| Some(if i < 6 { 0.0 } else { 0.004 + 0.002 * f64::from(i) })).collect();
        let sight = Sight::learned(&prior, &still);
        assert!(sight.usual < 8e-4, "{sight:?}");
        let right = |share| of_logit(logit(0.92) + sight.log_ratio(share));
        assert!(right(0.0) > 0.98 && right(0.016) < 1e-4, "{} {}", right(0.0), right(0.016));
        // Most pairs are wrong: they do not make it usual.
        let shares: Vec<Option<f64>> = [0.0, 0.0, 0.0, 1e-4]
            .into_iter()
            .chain((0..20).map(|i| 0.006 + 0.002 * f64::from(i)))
            .map(Some)
            .collect();
        let sight = Sight::learned(&[0.92; 24], &shares);
        assert!(sight.log_ratio(0.0) > 1.0 && sight.log_ratio(0.01) < -4.0, "{sight:?}");
        // A street: half a point in a hundred is nothing.
        let street = [Some(0.004), Some(0.006), Some(0.005), Some(0.003), Some(0.008), Some(0.09)];
        let sight = Sight::learned(&[0.95; 6], &street);
        assert!(
            sight.usual > 0.0015 && sight.log_ratio(0.004) > 0.0 && sight.log_ratio(0.09) < -3.0,
            "{sight:?}"
        );
        // Where all pairs see through each other, none is made usual.
        assert!(Sight::learned(&[0.9; 9], &[Some(0.08); 9]).log_ratio(0.08) < -4.0);
    }

    #[test]
    fn the_ratio_is_that_of_the_two_densities() {
        let sight = Sight { usual: 0.002 };
        let right = (-0.006f64 / 0.002).exp() / 0.002;
        let wrong = 1.0 / ((1.0 + (1.0 / FINEST).ln()) * 0.006);
        assert!((sight.log_ratio(0.006) - (right / wrong).ln()).abs() < 1e-12);
    }

    #[test]
    fn sure_pairs_that_turn_out_wrong_lower_all_odds() {
        let prior = [0.9, 0.9, 0.9, 0.9, 0.2];
        assert_eq!(shift(&prior, &prior), 0.0);
        assert_eq!(shift(&prior, &[0.99; 5]), 0.0, "never up");
        // Two of four are wrong: (2 + 2 * 0.9) / 6 are right.
        let expected = logit(3.8 / 6.0) - logit(0.9);
        assert!((shift(&prior, &[1.0, 1.0, 0.0, 0.0, 0.0]) - expected).abs() < 1e-12);
        assert_eq!(shift(&[0.2, 0.0], &[0.0, 0.0]), 0.0);
    }
}
