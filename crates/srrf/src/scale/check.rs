//! Tries whether two clouds are in different units, before any long work.

use srrf_cloud::PointCloud;

use super::doubt::ScaleDoubt;
use crate::error::Error;
use crate::judge::is_sure;
use crate::registrar::Registrar;
use crate::request::Request;
use crate::target::{PreparedPair, Target};

/// Factors that are tried.
const TRIED: usize = 3;
/// Where sizes and spacings differ by this much, a user is told of a known factor, although it was not found to fit: if the answer is
/// doubtful, and if it is not.
const TOLD: [f64; 2] = [3.0, 8.0];

/// What was learned of two clouds whose sizes raise a doubt.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tried {
    pub doubt: ScaleDoubt,
    /// Whether they fit as well with another factor as they are.
    pub ambiguous: bool,
}

impl Tried {
    /// Whether a user must know of it beside an answer.
    pub fn is_told(&self, doubtful: bool) -> bool {
        let [beside_doubt, beside_right] = TOLD;
        let far = self.doubt.least() >= if doubtful { beside_doubt } else { beside_right };
        self.ambiguous || (!self.doubt.factors.is_empty() && far)
    }
}

impl Registrar {
    /// The doubt about the scale of a pair, if its sizes raise one.
    ///
    /// # Errors
    /// [`Error::Scale`] where the clouds cannot be registered as they are, or fit surely with a factor between common units, and not
    /// as they are.
    pub(crate) fn doubt_scale(
        &self,
        request: &Request<'_>,
        pair: &PreparedPair,
    ) -> Result<Option<Tried>, Error> {
        let sizes = [pair.source.size, pair.target_side().size];
        let Some(doubt) = ScaleDoubt::between(sizes[0], sizes[1]) else { return Ok(None) };
        if doubt.certain {
            return Err(Error::Scale(doubt));
        }
        for factor in doubt.factors.iter().copied().take(TRIED) {
            let Ok(scaled) = request.source.scaled(factor) else { continue };
            if !self.is_sure(request, &scaled, &pair.target) {
                continue;
            }
            let doubt = doubt.found(factor);
            if self.is_sure(request, request.source, &pair.target) {
                return Ok(Some(Tried { doubt, ambiguous: true }));
            }
            return Err(Error::Scale(doubt));
        }
        Ok(Some(Tried { doubt, ambiguous: false }))
    }

    /// Whether the first round finds a pose that is surely right.
    fn is_sure(&self, request: &Request<'_>, source: &PointCloud, target: &Target) -> bool {
        let request = Request { source, observed: Default::default(), ..*request };
        self.first_round(&Request { target: target.into(), ..request })
            .is_ok_and(|found| is_sure(found.probability))
    }
}
