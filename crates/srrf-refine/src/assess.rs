//! [`Assessment`]: what a pose rests on, beside its fit.

use serde::Serialize;
use srrf_cloud::Rigid;

use crate::RefineConfig;
use crate::affine::{AffineFit, affine_fit};
use crate::chance::{Chance, chance};
use crate::freedom::{FreeMotion, Freedom, freedom};
use crate::matching::{both_sides, median_distance, support};
use crate::prepared::RefineCloud;
use crate::probe::Probe;
use crate::scatter::{Scatter, spread};

/// What a pose rests on: whether chance would give as much, and which motions it leaves open.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assessment {
    /// Agreement beside that of chance.
    pub chance: Chance,
    /// What the fit determines; motions are in the target frame of the inputs.
    pub freedom: Freedom,
    /// What an affine map fits better: of small clouds whose points do not coincide, as two samplings, noise and shears leave them.
    pub affine: Option<AffineFit>,
    /// How far the pose would scatter with other noise.
    pub spread: Scatter,
}

/// Assesses a pose between the inputs.
pub(crate) fn assess(
    source: &RefineCloud,
    target: &RefineCloud,
    pose: &Rigid,
    config: &RefineConfig,
) -> Assessment {
    let local = source.frame_to(target).pose(pose);
    let probe = Probe::new(source, target);
    let mut freedom = freedom(&probe, &local);
    for FreeMotion { twist, .. } in &mut freedom.open {
        *twist = twist.shifted(&target.centre);
    }
    Assessment {
        chance: chance(&probe, &local, target.radius),
        freedom,
        affine: affine(source, target, &local),
        spread: spread(source, target, &local, config),
    }
}

/// Matches that are nearer than this, in point spacings, are points that coincide: no affine map is looked for.
const COINCIDE: f64 = 0.15;

fn affine(source: &RefineCloud, target: &RefineCloud, pose: &Rigid) -> Option<AffineFit> {
    // Large clouds take long, and neighbours in them sample one smooth surface.
    if source.has_coarse() || target.has_coarse() {
        return None;
    }
    let (s, t) = (source.coarse(), target.coarse());
    let spacing = s.spacing.max(t.spacing);
    let apart = median_distance(s, t, pose) > COINCIDE * spacing;
    apart.then(|| affine_fit(s, t, pose, support(&both_sides(s, t, pose), spacing)))
}
