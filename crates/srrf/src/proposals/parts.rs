//! Point pairs: where a source may be in a target, whatever is around it.

use std::sync::Arc;

use srrf_classical::{PpfConfig, PpfModel};
use srrf_cloud::RegisterError;

use super::range::in_range;
use super::{Proposal, Proposals, Proposed, Round};
use crate::network::LazyNetwork;
use crate::options::{Method, Options, RotationRange};
use crate::stage::Stage;
use crate::start::Start;
use crate::target::PreparedPair;

/// The poses that pairs of points of the source vote for in the target.
#[derive(Debug)]
struct PointPairs {
    rotation: RotationRange,
}

pub(super) fn point_pairs(options: &Options, _: Option<&Arc<LazyNetwork>>) -> Option<Box<dyn Proposals>> {
    (options.method == Method::Auto).then(|| Box::new(PointPairs { rotation: options.rotation }) as _)
}

impl Proposals for PointPairs {
    fn round(&self) -> Round {
        Round::PointPairs
    }

    /// Small clouds, and what they cost there, are not measured.
    fn is_for(&self, pair: &PreparedPair) -> bool {
        !pair.is_small()
    }

    fn stage(&self) -> Option<Stage> {
        Some(Stage::PointPairs)
    }

    /// What they do not find, the other starts have to do without.
    fn propose(&self, pair: &PreparedPair) -> Proposed {
        Proposed::starts(self.search(pair).unwrap_or_default())
    }
}

impl PointPairs {
    fn search(&self, pair: &PreparedPair) -> Result<Vec<Proposal>, RegisterError> {
        let model = PpfModel::new(pair.source.centred.cloud(), PpfConfig::default())
            .map_err(RegisterError::Source)?;
        let poses = model
            .poses(pair.target_side().centred.cloud())?
            .into_iter()
            .map(|p| p.target_from_source)
            .collect();
        let poses = in_range(self.rotation, poses, &pair.initial)?;
        Ok(poses.into_iter().map(|pose| Proposal { start: Start::PointPairs, pose }).collect())
    }
}
