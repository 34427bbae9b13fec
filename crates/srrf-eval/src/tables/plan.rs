//! The experiments of a report: which pairs, and which rows.

use srrf_corrupt::{Corrupt, CorruptionKind, Mixture, PairConfig, Sampling, Severity};

use super::options::TablesOptions;
use crate::method_set::MethodSet;
use crate::protocol::{MIDDLE, Protocol};
use crate::rows::TableRow;

/// Rows of the ablations that compare protocols.
const ABLATION_ROWS: [TableRow; 8] = [
    TableRow::ICP,
    TableRow::FPFH_RANSAC,
    TableRow::Oracle,
    TableRow::SRRF_DENSE,
    TableRow::SRRF_SKELETON,
    TableRow::SRRF,
    TableRow::SRRF_REFINE,
    TableRow::SRRF_REGISTER,
];

/// Share of each cloud that the crop of partial overlap keeps, as in RPMNet's tables.
pub(crate) const PARTIAL: f64 = 0.7;

/// Experiments whose tables compare them with all severities on the same shapes.
pub(crate) const COMPARED: [&str; 3] = ["one-sided", "independent", "beyond"];

/// Mixtures that are scored: two corruptions of different families at once, and one of each family in
/// half of the cloud.
pub(crate) const MIXTURES: [Mixture; 10] = {
    use CorruptionKind::{Background, Cutout, DensityDec, DistortionRbf, Gaussian, Impulse, Shear};
    [
        Mixture::Both(Cutout, Gaussian),
        Mixture::Both(DensityDec, Background),
        Mixture::Both(Cutout, Background),
        Mixture::Both(DistortionRbf, Gaussian),
        Mixture::Both(Shear, Cutout),
        Mixture::Local(Gaussian),
        Mixture::Local(Background),
        Mixture::Local(Impulse),
        Mixture::Local(DensityDec),
        Mixture::Local(Cutout),
    ]
};

/// Pairs and rows of one experiment.
pub(crate) struct Experiment {
    /// Its part of the report.
    pub key: &'static str,
    /// What is shown while it runs.
    pub title: &'static str,
    /// Its pairs.
    pub protocol: Protocol,
    /// Its rows.
    pub rows: Vec<TableRow>,
}

/// The protocol of the main tables.
pub(crate) fn main_protocol(options: &TablesOptions, shapes: usize) -> Protocol {
    Protocol { shapes, spread: options.spread, ..same_shapes_protocol(options, shapes) }
}

/// The protocol of what compares severities or experiments: the same shapes in all of them, a fifth of
/// those of the main tables where these are spread over the severities.
pub(crate) fn same_shapes_protocol(options: &TablesOptions, shapes: usize) -> Protocol {
    Protocol {
        clean: true,
        corruptions: CorruptionKind::ALL.to_vec(),
        mixtures: Vec::new(),
        severities: Severity::ALL.to_vec(),
        shapes: if options.spread { (shapes / Severity::ALL.len()).max(1) } else { shapes },
        seed: options.seed,
        pair: PairConfig { points: options.points, ..PairConfig::default() },
        crop: None,
        dcp_poses: false,
        spread: false,
    }
}

/// The main experiment and the ablations of protocols that are wanted.
pub(crate) fn experiments(options: &TablesOptions, shapes: usize, methods: &MethodSet) -> Vec<Experiment> {
    let same = same_shapes_protocol(options, shapes);
    let middle = Protocol { severities: vec![MIDDLE], ..same.clone() };
    // Every point is copied at severity 5 already.
    let extendable = CorruptionKind::ALL.into_iter().filter(|k| *k != CorruptionKind::Upsampling);
    let rows = || methods.only(&ABLATION_ROWS);
    let without_oracle = rows().into_iter().filter(|row| *row != TableRow::Oracle).collect();
    let all = [
        Experiment {
            key: "main",
            title: "all corruptions",
            protocol: main_protocol(options, shapes),
            rows: methods.rows.clone(),
        },
        Experiment {
            key: "severity",
            title: "all severities",
            protocol: same.clone(),
            rows: methods.rows.clone(),
        },
        Experiment {
            key: "partial",
            title: "partial overlap",
            protocol: Protocol {
                corruptions: Vec::new(),
                severities: Vec::new(),
                crop: Some(PARTIAL),
                ..main_protocol(options, shapes)
            },
            rows: methods.rows.clone(),
        },
        Experiment {
            key: "one-sided",
            title: "one cloud corrupted",
            protocol: Protocol {
                clean: false,
                pair: PairConfig { corrupt: Corrupt::Target, ..same.pair },
                ..middle.clone()
            },
            rows: rows(),
        },
        Experiment {
            key: "independent",
            title: "independent sampling",
            protocol: Protocol {
                pair: PairConfig { sampling: Sampling::Independent, ..same.pair },
                ..middle.clone()
            },
            rows: without_oracle,
        },
        Experiment {
            key: "beyond",
            title: "severities 6 and 7",
            protocol: Protocol {
                clean: false,
                corruptions: extendable.collect(),
                severities: Severity::BEYOND.to_vec(),
                ..same
            },
            rows: rows(),
        },
        Experiment {
            key: "mixtures",
            title: "mixtures of corruptions",
            protocol: Protocol {
                clean: false,
                corruptions: Vec::new(),
                mixtures: MIXTURES.to_vec(),
                ..middle
            },
            rows: rows(),
        },
    ];
    // Without `--spread` the main tables show the same shapes at all severities.
    let twice = |e: &Experiment| e.key == "severity" && !options.spread && options.wants("main");
    all.into_iter().filter(|e| options.wants(e.key) && !e.rows.is_empty() && !twice(e)).collect()
}
