//! Soft matching: a probability over the target points for each source point.

use burn::module::{Module, Param};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::inference::Matches;

/// Scores beyond this are cut before the exponential.
const MOST: f64 = 30.0;
/// Sharpness of normalised scores at the start of a training; trained networks have 1.3 to 1.9.
const SHARPNESS: f64 = 2.0;
/// Score of having no match at the start of a training, about where it ends.
const SLACK: f64 = 4.0;

/// How scores become probabilities. The default is the paper: a softmax of each row.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatchingConfig {
    /// Whether the scores of a pair are brought to mean 0 and standard deviation 1 before the learned
    /// sharpness, as RGM and PCA-GM do, so that the length of the features does not matter.
    #[serde(default)]
    pub normalise: bool,
    /// Sinkhorn iterations with slack before the softmax; 0 for none. They let target points take part in one
    /// match alone, and source points in none: RPMNet and RGM, 5 and 20.
    #[serde(default)]
    #[schemars(range(max = 1000))]
    pub sinkhorn: usize,
}

impl MatchingConfig {
    /// Whether this is the default, which weights files leave out.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// A new matching.
    pub fn init(&self, device: &Device) -> SoftMatching {
        let start = if self.normalise { SHARPNESS.ln() } else { 0.0 };
        let constant = |value: f64| Param::from_tensor(Tensor::full([1], value, device));
        SoftMatching {
            log_sharpness: constant(start),
            slack: (self.sinkhorn > 0).then(|| constant(SLACK)),
            normalise: self.normalise,
            sinkhorn: self.sinkhorn,
            best: false,
        }
    }
}

/// Soft matching with a learned temperature.
#[derive(Module, Debug)]
pub struct SoftMatching {
    /// Logarithm of the inverse temperature. Shape `[1]`.
    log_sharpness: Param<Tensor<1>>,
    /// Score of having no match. Shape `[1]`.
    slack: Option<Param<Tensor<1>>>,
    normalise: bool,
    sinkhorn: usize,
    best: bool,
}

/// Soft matches of the source points.
#[derive(Debug, Clone)]
pub struct SoftMatches {
    /// `yhat`, the expected target point of each source point, or the most probable one: `[batch, n, 3]`.
    pub points: Tensor<3>,
    /// `m(x_i, Y)`, the probability of each target point, given that there is a match: `[batch, n, m]`.
    pub probabilities: Tensor<3>,
    /// Probability of each source point to have a match at all, where slack was there to take it:
    /// `[batch, n, 1]`.
    pub matched: Option<Tensor<3>>,
}

impl SoftMatching {
    /// The paper's matching, at temperature 1.
    pub fn new(device: &Device) -> Self {
        MatchingConfig::default().init(device)
    }

    /// Where source points go; training takes the mean.
    pub fn with_matches(self, matches: Matches) -> Self {
        Self { best: matches == Matches::Best, ..self }
    }

    /// `m(x_i, Y) = softmax(Phi_Y Phi_x^T / (T sqrt(d)))` and `yhat_i = Y^T m(x_i, Y)`.
    ///
    /// The paper prints no `sqrt(d)`; DCP's code, which its formula follows, divides by it, and
    /// without it the softmax saturates.
    ///
    /// # Shapes
    /// - `source_features`: `[batch, n, width]`, `target_features`: `[batch, m, width]`,
    ///   `target_points`: `[batch, m, 3]`
    /// - `log_prior`: `[batch, n, m]`, what is known of the matches beforehand, up to a constant
    pub fn forward(
        &self,
        source_features: Tensor<3>,
        target_features: Tensor<3>,
        target_points: Tensor<3>,
        log_prior: Option<Tensor<3>>,
    ) -> SoftMatches {
        let scores = self.scores(source_features, target_features);
        let scores = match log_prior {
            Some(log_prior) => scores + log_prior,
            None => scores,
        };
        let (probabilities, matched) = self.probabilities(scores);
        let points = match self.best {
            true => most_probable(&probabilities, target_points),
            false => probabilities.clone().matmul(target_points),
        };
        SoftMatches { points, probabilities, matched }
    }

    /// `m(x_i, Y)` and, with slack, the probability to have a match.
    fn probabilities(&self, scores: Tensor<3>) -> (Tensor<3>, Option<Tensor<3>>) {
        let Some(slack) = &self.slack else { return (softmax(scores, 2), None) };
        // Target points first, so that source points come last: each sums to 1 with its slack.
        let transposed = (scores - slack.val().unsqueeze::<3>()).transpose();
        let Scaled { kernel, rows: columns, .. } = sinkhorn(transposed, self.sinkhorn);
        let mass = (kernel * columns).transpose(); // K v
        let total = mass.clone().sum_dim(2);
        let probabilities = mass / (total.clone() + 1e-12);
        let matched = total.clone() / (total + 1.0); // 1 - u
        (probabilities, Some(matched))
    }

    /// `[batch, n, m]`.
    fn scores(&self, source_features: Tensor<3>, target_features: Tensor<3>) -> Tensor<3> {
        let [_, _, width] = source_features.dims();
        let sharpness = self.log_sharpness.val().exp().unsqueeze::<3>();
        if !self.normalise {
            let scaled = source_features * (sharpness / (width as f64).sqrt());
            return scaled.matmul(target_features.transpose());
        }
        standardised(source_features.matmul(target_features.transpose()) / width as f64, 1e-6) * sharpness
    }
}

/// The most probable target point of each source point: `[batch, n, 3]`.
fn most_probable(probabilities: &Tensor<3>, target_points: Tensor<3>) -> Tensor<3> {
    let best = probabilities.clone().argmax(2); // [batch, n, 1]
    target_points.gather(1, best.repeat_dim(2, 3))
}

/// `m = softmax(scores)` over the target points, and `yhat = m Y`.
///
/// # Shapes
/// - `scores`: `[batch, n, m]`, `target_points`: `[batch, m, 3]`
pub fn soft_matches(scores: Tensor<3>, target_points: Tensor<3>) -> SoftMatches {
    let probabilities = softmax(scores, 2);
    SoftMatches { points: probabilities.clone().matmul(target_points), probabilities, matched: None }
}

/// The scores of each pair brought to mean 0 and standard deviation 1; `epsilon` is added to the variance.
///
/// # Shapes
/// - `scores` and output: `[batch, n, m]`
pub fn standardised(scores: Tensor<3>, epsilon: f64) -> Tensor<3> {
    let centred = scores.clone() - scores.mean_dim(2).mean_dim(1);
    let variance = centred.clone().square().mean_dim(2).mean_dim(1);
    centred / (variance + epsilon).sqrt()
}

/// A matrix brought to row and column sums of at most 1: `u_i K_ij v_j`.
#[derive(Debug, Clone)]
pub struct Scaled {
    /// `K = exp(scores)`: `[batch, n, m]`.
    pub kernel: Tensor<3>,
    /// `u`: `[batch, n, 1]`.
    pub rows: Tensor<3>,
    /// `v`: `[batch, m, 1]`.
    pub columns: Tensor<3>,
}

impl Scaled {
    /// The matrix itself, without slack: `[batch, n, m]`.
    pub fn matrix(self) -> Tensor<3> {
        self.kernel * self.rows * self.columns.transpose()
    }
}

/// Sinkhorn with a slack row and column of score 0, which take what has no match: the others are brought to
/// sum 1 in turn, slack included, rows first and columns last.
///
/// The matrix is `u_i K_ij v_j` all the time, the factors of slack are 1, so two vectors are iterated, which costs
/// a product of matrix and vector each, where the form with logarithms costs a pass of `exp` and `log` over
/// the matrix. The values are the same.
///
/// # Shapes
/// - `scores`: `[batch, n, m]`, cut to +-30, so that their exponentials fit `f32`
pub fn sinkhorn(scores: Tensor<3>, iterations: usize) -> Scaled {
    let [batch, n, m] = scores.dims();
    let kernel = scores.clamp(-MOST, MOST).exp();
    let transposed = kernel.clone().transpose();
    let ones =
        |count: usize| Tensor::ones([batch, count, 1], (&kernel.device().without_autodiff(), kernel.dtype()));
    let (mut rows, mut columns) = (ones(n), ones(m));
    for _ in 0..iterations {
        rows = (kernel.clone().matmul(columns.clone()) + 1.0).recip();
        columns = (transposed.clone().matmul(rows.clone()) + 1.0).recip();
    }
    Scaled { kernel, rows, columns }
}
