//! How likely each edge is right, from what its registration says and from the loops that it is in.
//!
//! Edges are right or wrong; a loop whose edges are all right closes, one with a single wrong edge does not, and one with more
//! closes seldom. Belief propagation over edges and loops gives each edge's probability. Source: Zach, Klopschitz and Pollefeys,
//! "Disambiguating visual relations using loop constraints", 2010.

use crate::loops::EdgeLoop;

/// That a loop of right edges does not close, or one with a single wrong edge does.
const SLIP: f64 = 0.01;
/// That a loop with several wrong edges closes: never by chance, yet wrong edges between places that look alike agree.
const ALIKE: f64 = 0.2;
const MOST_ROUNDS: usize = 40;
const DAMPING: f64 = 0.4;
/// No edge is surer than this, nor less sure than its rest.
const SUREST: f64 = 0.999;

/// The probability of each edge. `prior` is that of its registration; a prior of 0 stays 0.
pub fn beliefs(prior: &[f64], loops: &[EdgeLoop]) -> Vec<f64> {
    let factors: Vec<(&EdgeLoop, bool)> =
        loops.iter().filter_map(|l| l.closes().map(|closes| (l, closes))).collect();
    let logit = |p: f64| {
        let p = p.clamp(1.0 - SUREST, SUREST);
        (p / (1.0 - p)).ln()
    };
    let bound = logit(SUREST);
    let start: Vec<f64> = prior.iter().map(|p| logit(*p)).collect();
    // Log odds that each loop sends each of its edges.
    let mut sent: Vec<Vec<f64>> = factors.iter().map(|(l, _)| vec![0.0; l.edges.len()]).collect();
    let totals = |sent: &[Vec<f64>]| {
        let mut sums = start.clone();
        for ((l, _), messages) in factors.iter().zip(sent) {
            l.edges.iter().zip(messages).for_each(|(e, m)| sums[*e] += m);
        }
        sums
    };
    for _ in 0..MOST_ROUNDS {
        let sums = totals(&sent);
        let mut change: f64 = 0.0;
        for ((l, closes), messages) in factors.iter().zip(&mut sent) {
            let incoming: Vec<f64> = l
                .edges
                .iter()
                .zip(messages.iter())
                .map(|(e, m)| {
                    let odds = (sums[*e] - m).clamp(-bound, bound);
                    if prior[*e] > 0.0 { 1.0 / (1.0 + (-odds).exp()) } else { 0.0 }
                })
                .collect();
            for (i, kept) in messages.iter_mut().enumerate() {
                let next = message(&incoming, i, *closes);
                change = change.max((next - *kept).abs());
                *kept += (1.0 - DAMPING) * (next - *kept);
            }
        }
        if change < 1e-6 {
            break;
        }
    }
    let last = totals(&sent);
    last.iter()
        .zip(prior)
        .map(
            |(odds, prior)| if *prior > 0.0 { 1.0 / (1.0 + (-odds.clamp(-bound, bound)).exp()) } else { 0.0 },
        )
        .collect()
}

/// What a loop says about its edge number `i`, in log odds, where the others are right with these probabilities.
fn message(right: &[f64], i: usize, closes: bool) -> f64 {
    let others = || right.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, p)| *p);
    let all: f64 = others().product();
    let one: f64 = (0..right.len())
        .filter(|j| *j != i)
        .map(|j| {
            let rest = right.iter().enumerate().filter(|(k, _)| *k != i && *k != j).map(|(_, p)| *p);
            (1.0 - right[j]) * rest.product::<f64>()
        })
        .sum();
    let more = (1.0 - all - one).max(0.0);
    // Probability that it closes: nothing wrong, one wrong, more.
    let [none, single, several] = [1.0 - SLIP, SLIP, ALIKE];
    let if_right = all * none + one * single + more * several;
    let if_wrong = all * single + (one + more) * several;
    let (a, b) = if closes { (if_right, if_wrong) } else { (1.0 - if_right, 1.0 - if_wrong) };
    (a.max(1e-12) / b.max(1e-12)).ln()
}

#[cfg(test)]
mod tests {
    use srrf_cloud::Rigid;

    use super::*;

    fn a_loop(edges: &[usize], closes: bool) -> EdgeLoop {
        let chi_squared = if closes { 1.0 } else { 1e4 };
        EdgeLoop { edges: edges.to_vec(), error: Rigid::identity(), chi_squared, implied: false }
    }

    #[test]
    fn the_edge_that_all_broken_loops_share_is_the_wrong_one() {
        // Edge 0 is in two loops that do not close; the others are in one that does.
        let loops = [
            a_loop(&[0, 1, 2], false),
            a_loop(&[0, 3, 4], false),
            a_loop(&[1, 3, 5], true),
            a_loop(&[2, 4, 5], true),
        ];
        let found = beliefs(&[0.95; 6], &loops);
        assert!(found[0] < 0.05, "{found:?}");
        assert!(found[1..].iter().all(|p| *p > 0.98), "{found:?}");
    }

    #[test]
    fn one_broken_triangle_leaves_all_three_in_doubt() {
        let found = beliefs(&[0.9; 3], &[a_loop(&[0, 1, 2], false)]);
        assert!(found.iter().all(|p| *p > 0.5 && *p < 0.8 && (p - found[0]).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn a_closed_loop_lifts_a_doubtful_edge_and_no_loop_changes_nothing() {
        let found = beliefs(&[0.3, 0.95, 0.95, 0.3], &[a_loop(&[0, 1, 2], true)]);
        assert!(found[0] > 0.9, "{found:?}");
        assert!((found[3] - 0.3).abs() < 1e-9);
        // Where nothing is measured, nothing is lifted.
        assert_eq!(beliefs(&[0.0, 0.9, 0.9], &[a_loop(&[0, 1, 2], true)])[0], 0.0);
    }

    #[test]
    fn messages_are_those_of_the_sums() {
        // Two others, right with 0.9 and 0.8: all 0.72, one 0.26, more 0.02.
        let got = message(&[0.5, 0.9, 0.8], 0, false);
        let right = 1.0 - (0.72 * 0.99 + 0.26 * 0.01 + 0.02 * 0.2);
        let wrong = 1.0 - (0.72 * 0.01 + 0.28 * 0.2);
        assert!((got - f64::ln(right / wrong)).abs() < 1e-12);
    }
}
