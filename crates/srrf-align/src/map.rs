//! [`Map`]: all that a user may ask of an alignment.

use nalgebra::{Matrix6, Vector3};
use serde::Serialize;
use srrf_cloud::Rigid;

use crate::consensus::EdgeVerdict;
use crate::options::PairReason;

/// Scans in one frame, or in one frame a component.
#[derive(Debug, Clone)]
pub struct Map {
    /// One a scan, in the order of the input.
    pub scans: Vec<PlacedScan>,
    /// Numbers of the scans that hold together, the largest component first. Nothing is known between two components.
    pub components: Vec<Vec<usize>>,
    /// The pairs that were tried.
    pub edges: Vec<MapEdge>,
    /// Loops (numbers of their edges) of pairs that contradict the map, and agree with each other: places look alike, and the scans of that
    /// component abstain.
    pub rivals: Vec<Vec<usize>>,
    /// Whether sure pairs turned out wrong so often that none joins scans by itself: places look alike, or registrations fail.
    pub look_alike: bool,
    /// The loop of holding edges that closes worst; none without loops.
    pub worst_loop: Option<WorstLoop>,
    /// Root mean square distance of the matched points along the normals, over all scans; unit of the input. None without matches.
    pub residual: Option<f64>,
    /// How pairs were chosen.
    pub choice: PairChoice,
}

/// One scan.
#[derive(Debug, Clone)]
pub struct PlacedScan {
    /// The pose in the map of its component, input coordinates. The lowest scan of a component is where its first guess says, or at
    /// the identity.
    pub map_from_scan: Rigid,
    /// Number of its component.
    pub component: usize,
    /// Probability that its pose in the component is right.
    pub probability: f64,
    /// Whether nothing holds it, or too little.
    pub abstain: bool,
    /// Numbers of the edges that hold it.
    pub held_by: Vec<usize>,
    /// Mean of its points in the map.
    pub centre: Vector3<f64>,
    /// Covariance of a small motion of the scan about `centre` in the axes of the map, against the lowest scan of the component:
    /// rotation (radians) first, then translation in the unit of the input. None where nothing holds the scan.
    pub covariance: Option<Matrix6<f64>>,
    /// Standard deviation of its points by that, root mean square over the scan; unit of the input.
    pub spread: Option<f64>,
    /// Motions that the scans leave open.
    pub undetermined: Vec<OpenMotion>,
    /// Root mean square distance of its matched points along the normals; unit of the input. None without matches.
    pub residual: Option<f64>,
}

/// A motion about the centre of a scan that the points leave open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OpenMotion {
    /// Radians, axes of the map.
    pub turn: [f64; 3],
    /// Unit of the input, axes of the map.
    pub shift: [f64; 3],
    /// How far it moves the points of the scan in one standard deviation; unit of the input.
    pub deviation: f64,
}

/// A pair that was tried.
#[derive(Debug, Clone)]
pub struct MapEdge {
    /// Scan that moves.
    pub source: usize,
    /// Scan that it is laid on.
    pub target: usize,
    /// Why it was tried.
    pub reason: PairReason,
    /// The registration; none where no pose was found.
    pub target_from_source: Option<Rigid>,
    /// Probability by the registration.
    pub probability: f64,
    /// Whether the registration abstains.
    pub abstain: bool,
    /// Probability after the loops.
    pub posterior: f64,
    /// What became of it.
    pub verdict: EdgeVerdict,
    /// Share of the source's points that lie on the target, and of the target's on the source.
    pub overlap: [f64; 2],
    /// Share of one scan's points that the other's scanner saw through; none where no place of a scanner is known.
    pub seen_through: Option<f64>,
    /// Angle in degrees between the registration and the map; none between components.
    pub off_deg: Option<f64>,
    /// How far that moves the points of the source, root mean square; unit of the input.
    pub off: Option<f64>,
}

/// A loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstLoop {
    /// Numbers of its edges, in order.
    pub edges: Vec<usize>,
    /// Angle of what going around comes to, in degrees.
    pub angle_deg: f64,
    /// How far that moves the points of the scan where it begins, root mean square; unit of the input.
    pub displacement: f64,
}

/// How pairs were chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairChoice {
    /// All pairs that there are.
    pub possible: usize,
    /// Pairs whose descriptors were compared.
    pub compared: usize,
    /// Pairs that were registered, or taken from the store.
    pub tried: usize,
    /// Round by round: why, and how many.
    pub rounds: Vec<(PairReason, usize)>,
    /// Wall time of registering them, in seconds.
    pub pair_seconds: f64,
}
