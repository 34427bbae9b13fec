//! The methods of the benchmark, each with what its answers promise.

use std::sync::OnceLock;

use srrf_cloud::Register;
use srrf_eval::{MethodContext, registry};

/// The motions of the clouds that an answer follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// Any motion of either cloud: no start is needed, or one is found.
    Any,
    /// Any shift of either cloud: clouds are centred, but turns are learned only up to 45 degrees.
    Shifts,
    /// Any motion of both clouds alike: the search starts where the source lies.
    Together,
    /// None: the answer is always the identity.
    Nothing,
}

/// Whether swapping the clouds inverts the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Swaps {
    Inverted,
    /// Not so, for this reason.
    Not(&'static str),
}

/// What a method promises.
#[derive(Debug, Clone, Copy)]
pub struct Promise {
    pub follows: Follows,
    pub swaps: Swaps,
    /// Whether clouds on a line are refused.
    pub refuses_lines: bool,
    /// How far the pose may move when the points come in another order.
    pub moved_by_order: f64,
}

/// A method of the registry.
pub struct Case {
    pub name: &'static str,
    pub method: Box<dyn Register>,
    pub promise: Promise,
}

const ONE_WAY: Swaps = Swaps::Not("matches go from the source to the target, and nothing refines them");

/// What the method of this name promises.
///
/// # Panics
/// For a method that is not in this table: add a line for it.
fn promise(name: &str) -> Promise {
    let (follows, swaps) = match name {
        "identity" => (Follows::Nothing, Swaps::Inverted),
        "icp" | "icp-plane" | "icp-trimmed" | "icp-robust" => (Follows::Together, Swaps::Inverted),
        "icp-centred" => (Follows::Shifts, Swaps::Inverted),
        "fpfh-ransac" | "fgr" | "srrf-register" => (Follows::Any, Swaps::Inverted),
        "srrf+refine" | "srrf-register-45" => (Follows::Shifts, Swaps::Inverted),
        "srrf" | "srrf-dense-alone" | "srrf-skeleton-alone" => (Follows::Shifts, ONE_WAY),
        "pointnetlk" | "dcp" | "rgm" | "panet" | "equi-gspr" => (Follows::Shifts, ONE_WAY),
        other => panic!("say in matrix/methods.rs what `{other}` promises"),
    };
    // Sums in another order differ in the last digit of single precision. In equi-gspr they also choose which matches are kept: the
    // most similar ones. Seen: 0.0006 with normals by an iteration, 0.002 with those in closed form; 2e-7 or less in all others.
    let moved_by_order = if name == "equi-gspr" { 4e-3 } else { 1e-5 };
    Promise { follows, swaps, refuses_lines: name != "identity", moved_by_order }
}

/// All methods whose weights are in the program, set up once.
pub fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let context = MethodContext::of_srrf(None, "flex");
        let case = |entry: &'static srrf_eval::MethodEntry| {
            let method = entry.set_up(&context).unwrap().register;
            Case { name: entry.name, method, promise: promise(entry.name) }
        };
        registry().iter().map(case).collect()
    })
}
