//! The oracle: the best that perfect correspondences allow.

use std::collections::HashMap;

use srrf_cloud::Rigid;

use super::pair::Pair;

/// The least-squares pose over the base points that are in both clouds of `pair`: the floor for
/// any method that fits correspondences, since corruptions such as `shear` move even perfect ones.
///
/// Resampling may repeat a point; repeats are identical, so each base point counts once, with its
/// first occurrence.
///
/// `None` if the pair keeps no correspondence (independent sampling, or switched off), or if fewer
/// than 3 base points are in both clouds.
pub fn oracle_pose(pair: &Pair) -> Option<Rigid> {
    let (source_origin, target_origin) = (pair.source_origin.as_ref()?, pair.target_origin.as_ref()?);
    let mut in_target: HashMap<u32, usize> = HashMap::with_capacity(target_origin.len());
    for (i, origin) in target_origin.iter().enumerate() {
        if let Some(base) = origin {
            in_target.entry(*base).or_insert(i);
        }
    }
    let (mut source, mut target) = (Vec::new(), Vec::new());
    for (p, origin) in pair.source.points().iter().zip(source_origin) {
        // Removing the entry makes later repeats of the same base point find nothing.
        if let Some(i) = origin.and_then(|base| in_target.remove(&base)) {
            source.push(*p);
            target.push(pair.target.points()[i]);
        }
    }
    Rigid::fit(&source, &target, None)
}
