//! One registration branch: SFE, PFI, soft matching and the SVD head. The dense branch runs it on
//! the clouds, the skeleton branch on the skeletons.

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::confidence::Confidence;
use crate::inference::Matches;
use crate::integration::PosedMatches;
use crate::matching::{MatchingConfig, SoftMatching};
use crate::ops::{CopyError, HostClouds, RowNumbers, rows_at, token_rows};
use crate::pfi::{Pfi, PfiConfig};
use crate::prior::PositionPrior;
use crate::procrustes::{procrustes, weighted_procrustes};
use crate::sfe::{Neighbourhood, Sfe, SfeConfig};
use crate::timing::timed;

/// Sizes of one branch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BranchConfig {
    /// Points of each cloud that carry features; 0 for all, as in the paper. Attention costs the
    /// square of it. The others still serve as neighbours in the first LFI.
    #[schemars(range(min = 0, max = 65536))]
    pub tokens: usize,
    /// Whether source points count in the SVD head by a learned confidence; the paper: no.
    #[serde(default)]
    pub confidence: bool,
    /// The soft matching.
    #[serde(default, skip_serializing_if = "MatchingConfig::is_default")]
    pub matching: MatchingConfig,
    /// The structural feature extractor.
    pub sfe: SfeConfig,
    /// The feature interaction.
    pub pfi: PfiConfig,
}

impl BranchConfig {
    /// A new branch.
    pub fn init(&self, device: &Device) -> RegistrationBranch {
        RegistrationBranch {
            sfe: self.sfe.init(device),
            pfi: self.pfi.init(self.sfe.output_width(), device),
            matching: self.matching.init(device),
            confidence: self.confidence.then(|| Confidence::new(self.sfe.output_width(), device)),
            tokens: self.tokens,
        }
    }

    /// The layout of `clouds`, sources and then targets.
    pub fn layout(&self, clouds: &HostClouds, phase: f32) -> BranchLayout {
        BranchLayout::new(clouds, self.tokens, self.sfe.neighbours, phase)
    }
}

/// SFE -> PFI -> soft matching -> SVD. Weights are shared between source and target.
#[derive(Module, Debug)]
pub struct RegistrationBranch {
    sfe: Sfe,
    pfi: Pfi,
    matching: SoftMatching,
    confidence: Option<Confidence>,
    tokens: usize,
}

/// The layout of a branch.
#[derive(Debug, Clone)]
pub struct BranchLayout {
    /// Rows of the points that carry tokens; none where every point does.
    tokens: Option<RowNumbers>,
    /// Tokens a cloud.
    per_cloud: usize,
    /// Neighbours of the tokens.
    neighbours: Neighbourhood,
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

/// What a branch found.
#[derive(Debug, Clone)]
pub struct BranchOutput {
    /// `[batch, 3, 3]`.
    pub rotation: Tensor<3>,
    /// `[batch, 3]`.
    pub translation: Tensor<2>,
    /// The source points that were matched: `[batch, n, 3]`.
    pub source_points: Tensor<3>,
    /// The target points they were matched with: `[batch, n, 3]`.
    pub target_points: Tensor<3>,
    /// Soft matches of the source points: `[batch, n, 3]`.
    pub matches: Tensor<3>,
    /// Probability of each target point for each source point: `[batch, n, n]`.
    pub probabilities: Tensor<3>,
    /// Probability of each source point to have a match at all, where the matching has slack: `[batch, n, 1]`.
    pub matched: Option<Tensor<3>>,
}

impl BranchOutput {
    /// The view that the integration takes.
    pub fn pose(&self) -> PosedMatches<'_> {
        PosedMatches {
            rotation: &self.rotation,
            translation: &self.translation,
            points: &self.source_points,
            matches: &self.matches,
        }
    }
}

impl RegistrationBranch {
    /// Replaces the number of tokens (0 for all points): more of them cost time and gain accuracy,
    /// also when the branch was trained with fewer.
    pub fn with_tokens(mut self, tokens: usize) -> Self {
        self.tokens = tokens;
        self
    }

    /// Where source points go; training takes the mean.
    pub fn with_matches(mut self, matches: Matches) -> Self {
        self.matching = self.matching.with_matches(matches);
        self
    }

    /// `phase` in [0, 1) chooses which points become tokens.
    ///
    /// # Shapes
    /// - `source`, `target`: `[batch, points, 3]`, of equal numbers of points
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward(
        &self,
        source: Tensor<3>,
        target: Tensor<3>,
        phase: f32,
    ) -> Result<BranchOutput, CopyError> {
        let clouds = Tensor::cat(vec![source, target], 0);
        let layout = self.layout(&HostClouds::read(&clouds)?, phase);
        self.forward_with(clouds, &layout, None)
    }

    /// The layout of `clouds`, sources and then targets.
    pub fn layout(&self, clouds: &HostClouds, phase: f32) -> BranchLayout {
        BranchLayout::new(clouds, self.tokens, self.sfe.neighbours(), phase)
    }

    /// As [`RegistrationBranch::forward`], of clouds whose layout is known, and with a prior on where matches lie.
    ///
    /// # Shapes
    /// - `clouds`: `[2 batch, points, 3]`, sources and then targets
    ///
    /// # Errors
    /// [`CopyError`] where the device does not give its numbers.
    pub fn forward_with(
        &self,
        clouds: Tensor<3>,
        layout: &BranchLayout,
        prior: Option<&PositionPrior>,
    ) -> Result<BranchOutput, CopyError> {
        let [both, points, _] = clouds.dims();
        let (batch, n) = (both / 2, layout.per_cloud);
        let tokens = match &layout.tokens {
            Some(chosen) => {
                let chosen = chosen.on(&clouds.device());
                rows_at(clouds.clone().reshape([both * points, 3]), chosen).reshape([both, n, 3])
            }
            None => clouds.clone(),
        };
        let device = tokens.device();
        let features = timed("sfe", &device, || self.sfe.forward_with(clouds, n, &layout.neighbours)); // F
        let features = timed("pfi", &device, || self.pfi.forward(features, tokens.clone())); // Phi
        let half = |x: &Tensor<3>, which: usize| x.clone().narrow(0, which * batch, batch);
        let (source_points, target_points) = (half(&tokens, 0), half(&tokens, 1));
        let phi = |which: usize| half(&features, which);
        let matches = timed("matching", &device, || {
            let log_prior = prior.map(|p| p.log_density(source_points.clone(), target_points.clone()));
            self.matching.forward(phi(0), phi(1), target_points.clone(), log_prior)
        });
        let (rotation, translation) =
            timed("svd", &device, || match self.weights(phi(0), matches.matched.clone()) {
                Some(weights) => weighted_procrustes(source_points.clone(), matches.points.clone(), weights),
                None => procrustes(source_points.clone(), matches.points.clone()),
            })?;
        Ok(BranchOutput {
            rotation,
            translation,
            source_points,
            target_points,
            matches: matches.points,
            probabilities: matches.probabilities,
            matched: matches.matched,
        })
    }

    /// How much each source point counts: by its confidence and by its probability to have a match; sums to 1. None
    /// where all count alike.
    fn weights(&self, features: Tensor<3>, matched: Option<Tensor<3>>) -> Option<Tensor<3>> {
        let confidence = self.confidence.as_ref().map(|c| c.forward(features));
        let Some(matched) = matched else { return confidence };
        let weights = match confidence {
            Some(confidence) => confidence * matched,
            None => matched,
        };
        Some(weights.clone() / (weights.sum_dim(1) + 1e-12))
    }
}
