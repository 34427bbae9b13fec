//! The ablation of the integration: inlier test, its threshold, and no weighing at all.

use srrf_cloud::{Register, RegisterError, Registration, Solid};
use srrf_corrupt::CorruptionKind;
use srrf_model::{BranchRatios, IntegrationRule, SrrfRegister};

use crate::EvalError;
use crate::methods::{MethodContext, ReadyMethod, SetupError, network};

/// The corruptions that are scored: two of density, two of noise, one of shape.
pub(crate) const CORRUPTIONS: [CorruptionKind; 5] = [
    CorruptionKind::DensityDec,
    CorruptionKind::Cutout,
    CorruptionKind::Gaussian,
    CorruptionKind::Background,
    CorruptionKind::DistortionRbf,
];

/// A variant: its row, the rule, its two thresholds (dense, skeleton), the sharpness.
type Variant = (&'static str, fn(BranchRatios) -> IntegrationRule, [f64; 2], f64);

const VARIANTS: [Variant; 6] = [
    ("nearest 0.03", IntegrationRule::Nearest, [0.03; 2], 1.0),
    ("nearest 0.05", IntegrationRule::Nearest, [0.05; 2], 1.0),
    ("nearest 0.1", IntegrationRule::Nearest, [0.1; 2], 1.0),
    ("nearest 0.2", IntegrationRule::Nearest, [0.2; 2], 1.0),
    ("soft match 0.05, 0.1", IntegrationRule::SoftMatch, [0.05, 0.1], 1.0),
    ("lambda 0.5", IntegrationRule::Nearest, [0.05; 2], 0.0),
];

/// What the names of the variants say, for the note of the table.
pub(crate) const NOTE: &str = "\
Weights of the two branches by the share of inliers, from one set of trained weights. `nearest t`: a point of \
the source counts when the branch's pose brings it closer than t to the target; `soft match`: the paper's words, \
a correspondence counts when its residual is below the threshold of its branch; `lambda 0.5`: no weighing. \
Thresholds are in network units.";

/// The network under the name of a variant.
struct Named {
    inner: SrrfRegister,
    name: &'static str,
}

impl Register for Named {
    fn name(&self) -> &str {
        self.name
    }

    fn register_solid(&self, source: Solid<'_>, target: Solid<'_>) -> Result<Registration, RegisterError> {
        self.inner.register_solid(source, target)
    }
}

/// All variants, a row each.
///
/// # Errors
/// [`EvalError::Setup`] where the weights cannot be had.
pub(crate) fn methods(context: &MethodContext) -> Result<Vec<ReadyMethod>, EvalError> {
    let set_up = |&(name, rule, [dense, skeleton], sharpness): &Variant| {
        let (mut loaded, weights) = network(context)?;
        let rule = rule(BranchRatios {
            dense_threshold: dense,
            skeleton_threshold: skeleton,
            sharpness,
            skeleton_weight: 1.0,
        });
        let settings = rule.to_string();
        loaded.config.integration = rule;
        let inner = SrrfRegister::new(loaded, srrf_model::device(&context.device)?);
        Ok(ReadyMethod { weights: Some(weights), settings, ..ReadyMethod::new(Named { inner, name }) })
    };
    let named = |source: SetupError| EvalError::Setup { name: "srrf", source: Box::new(source) };
    VARIANTS.iter().map(|variant| set_up(variant).map_err(named)).collect()
}
