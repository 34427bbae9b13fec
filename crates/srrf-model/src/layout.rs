//! What the network has to know of the clouds before it computes: which points carry tokens, and whose
//! neighbour is who. It depends on the coordinates alone, so that other threads can find it ahead of the
//! step that uses it, while a GPU is busy with the one before.

use crate::branch::BranchConfig;
use burn::tensor::Device;

use crate::geometry::{HostClouds, RowNumbers, farthest_points, flat_indices, k_nearest, token_rows};
use crate::prior::PositionPrior;
use crate::sem::{LevelConfig, SemConfig};
use crate::srrf::SrrfConfig;

/// The layout of a batch for the whole network; the skeleton branch has its own, once there are
/// skeletons.
#[derive(Debug, Clone)]
pub struct SrrfLayout {
    /// Of the skeleton extraction module, on sources and then targets.
    pub sem: SemLayout,
    /// Of the dense branch, likewise.
    pub dense: BranchLayout,
    /// In [0, 1): where along the curve the tokens of the skeleton branch start, if not all are tokens.
    pub phase: f32,
    /// Where matches are to be expected, once a pass has found a pose; training and first passes have none.
    pub prior: Option<PositionPrior>,
}

/// The layout of a branch.
#[derive(Debug, Clone)]
pub struct BranchLayout {
    /// Rows of the points that carry tokens; none where every point does.
    pub(crate) tokens: Option<RowNumbers>,
    /// Tokens a cloud.
    pub(crate) per_cloud: usize,
    /// Neighbours of the tokens.
    pub(crate) neighbours: Neighbourhood,
}

/// Row numbers of the `k` nearest neighbours of each token, itself included.
#[derive(Debug, Clone)]
pub struct Neighbourhood {
    /// In the whole cloud.
    pub(crate) in_cloud: RowNumbers,
    /// Among the tokens; none where every point is one, and these are those in the cloud.
    pub(crate) in_tokens: Option<RowNumbers>,
}

/// The layout of the skeleton extraction module, a level after the other.
#[derive(Debug, Clone)]
pub struct SemLayout(pub(crate) Vec<LevelLayout>);

/// One set-abstraction level.
#[derive(Debug, Clone)]
pub(crate) struct LevelLayout {
    /// Rows of the points kept by farthest point sampling; none where every point is.
    pub(crate) chosen: Option<Vec<i64>>,
    /// Points kept a cloud.
    pub(crate) samples: usize,
    /// Rows of the neighbours of each of them.
    pub(crate) neighbours: Vec<i64>,
}

impl Neighbourhood {
    /// The `k` nearest neighbours of `tokens` in `cloud` and among themselves.
    pub fn new(tokens: &HostClouds, cloud: &HostClouds, k: usize) -> Self {
        Self { in_tokens: Some(nearest_rows(tokens, tokens, k)), in_cloud: nearest_rows(tokens, cloud, k) }
    }

    /// Where every point of `cloud` is a token.
    pub fn within(cloud: &HostClouds, k: usize) -> Self {
        Self { in_cloud: nearest_rows(cloud, cloud, k), in_tokens: None }
    }

    /// See [`RowNumbers::send`].
    fn send(&mut self, device: &Device) {
        self.in_cloud.send(device);
        if let Some(rows) = &mut self.in_tokens {
            rows.send(device);
        }
    }
}

/// Rows of the `k` points of each of `support` that are nearest to each of `clouds`.
fn nearest_rows(clouds: &HostClouds, support: &HostClouds, k: usize) -> RowNumbers {
    let supports: Vec<_> = support.iter().collect();
    RowNumbers::new(flat_indices(clouds, support.per_cloud(), |i, cloud| k_nearest(cloud, supports[i], k)))
}

impl BranchLayout {
    /// `tokens` of each cloud (0 for all) along a space-filling curve, from `phase` in [0, 1), and their
    /// `neighbours`.
    pub fn new(clouds: &HostClouds, tokens: usize, neighbours: usize, phase: f32) -> Self {
        let chosen = token_rows(clouds, tokens, phase);
        let per_cloud = if chosen.is_some() { tokens } else { clouds.per_cloud() };
        let neighbours = match &chosen {
            Some(chosen) => Neighbourhood::new(&clouds.select(chosen, per_cloud), clouds, neighbours),
            None => Neighbourhood::within(clouds, neighbours),
        };
        Self { tokens: chosen.map(RowNumbers::new), per_cloud, neighbours }
    }

    /// Sends the row numbers to the device that will run the branch, ahead of it; see [`RowNumbers::send`].
    pub fn send(&mut self, device: &Device) {
        if let Some(tokens) = &mut self.tokens {
            tokens.send(device);
        }
        self.neighbours.send(device);
    }
}

impl SemLayout {
    /// Levels of so many points and neighbours each.
    pub fn new(clouds: &HostClouds, levels: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut host = clouds.clone();
        let level = |(points, k): (usize, usize)| {
            let n = host.per_cloud();
            // Farthest point sampling, unless every point is kept.
            let samples = points.min(n);
            let chosen =
                (samples < n).then(|| flat_indices(&host, n, |_, cloud| farthest_points(cloud, samples)));
            let centres = chosen.as_ref().map_or_else(|| host.clone(), |rows| host.select(rows, samples));
            let supports: Vec<_> = host.iter().collect();
            let neighbours = flat_indices(&centres, n, |i, centres| k_nearest(centres, supports[i], k));
            host = centres;
            LevelLayout { chosen, samples, neighbours }
        };
        Self(levels.into_iter().map(level).collect())
    }
}

impl BranchConfig {
    /// The layout of `clouds`, sources and then targets.
    pub fn layout(&self, clouds: &HostClouds, phase: f32) -> BranchLayout {
        BranchLayout::new(clouds, self.tokens, self.sfe.neighbours, phase)
    }
}

impl SemConfig {
    /// The layout of `clouds`.
    pub fn layout(&self, clouds: &HostClouds) -> SemLayout {
        SemLayout::new(
            clouds,
            self.levels.iter().map(|LevelConfig { points, neighbours, .. }| (*points, *neighbours)),
        )
    }
}

impl SrrfConfig {
    /// The layout of `clouds`, sources and then targets.
    pub fn layout(&self, clouds: &HostClouds, phase: f32) -> SrrfLayout {
        let (sem, dense) = (self.sem.layout(clouds), self.dense.layout(clouds, phase));
        SrrfLayout { sem, dense, phase, prior: None }
    }
}
