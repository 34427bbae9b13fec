//! [`synthetic`]: matches of which a known share is right.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_cloud::{EulerXyz, Rigid};

use crate::{Correspondences, CorrespondencesError};

/// `count` matches in a box of side 2, of which about `ratio` are right but for noise of deviation `noise`; and the true pose
/// `target_from_source`. To try an estimator on.
///
/// # Errors
/// Those of [`Correspondences::new`].
pub fn synthetic(
    count: usize,
    ratio: f64,
    noise: f64,
    seed: u64,
) -> Result<(Correspondences, Rigid), CorrespondencesError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let degrees: [f64; 3] = std::array::from_fn(|_| rng.random_range(-180.0..180.0));
    let translation: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    let truth = Rigid { rotation: EulerXyz::from_deg(degrees).to_matrix(), translation: translation.into() };
    let right = (ratio * count as f64).round() as usize;
    let (mut source, mut target) = (Vec::new(), Vec::new());
    for i in 0..count {
        let mut point = || -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-1.0..1.0)) };
        let (x, chance) = (point(), point());
        let y = truth.apply(&if i < right { x } else { chance });
        source.push(x);
        target.push(y.map(|c| c + noise * (0..12).map(|_| rng.random::<f64>() - 0.5).sum::<f64>()));
    }
    // Right ones anywhere.
    let place = |i: usize| (i * 7919) % count.max(1);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|i| (place(*i), *i));
    let take = |points: &[[f64; 3]]| order.iter().map(|i| points[*i]).collect();
    Ok((Correspondences::new(take(&source), take(&target))?, truth))
}
