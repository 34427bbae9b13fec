//! The run that the options ask for.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use srrf_args::flags::Threads;
use srrf_args::{Failure, OutputKind, Places};
use srrf_cloud::io::ReadOptions;
use srrf_corrupt::{CorruptionKind, PairConfig, RotationRange, Severity};

use super::EvalOptions;
use super::shared::weights_by_method;
use crate::EvalError;
use crate::protocol::{CLEAN, Protocol};

impl EvalOptions {
    /// How files of arrays are read.
    pub fn reading(&self) -> ReadOptions {
        ReadOptions { max_memory: self.max_memory, ..ReadOptions::default() }
    }

    /// The pairs that the options ask for.
    ///
    /// # Errors
    /// [`EvalError`] names the option that cannot be used.
    pub fn protocol(&self) -> Result<Protocol, EvalError> {
        let named = |name: &String| (name != CLEAN).then(|| name.parse::<CorruptionKind>());
        let mut corruptions: Vec<CorruptionKind> =
            self.corruptions.iter().filter_map(named).collect::<Result<_, _>>()?;
        if self.corruptions.is_empty() && !self.clean_only {
            corruptions = CorruptionKind::ALL.to_vec();
        }
        corruptions.sort_unstable();
        corruptions.dedup();
        let mut severities = self.severities.clone();
        if severities.is_empty() {
            severities = Severity::ALL.to_vec();
        }
        severities.sort_unstable();
        severities.dedup();
        Ok(Protocol {
            clean: self.corruptions.is_empty() || self.corruptions.iter().any(|c| c == CLEAN),
            corruptions,
            mixtures: Vec::new(),
            severities,
            shapes: self.shapes,
            seed: self.seed,
            pair: self.pair_config()?,
            crop: self.crop,
            dcp_poses: self.rotation == "dcp",
            spread: self.spread,
        })
    }

    /// What the run reads and writes.
    ///
    /// # Errors
    /// [`Failure::usage`] for a file of pairs that cannot be written, or would be one that is read.
    pub fn check_places(&self) -> Result<(), Failure> {
        let mut places = Places::new().reads("--pairs", self.pairs.as_deref());
        for path in &self.transforms {
            places = places.reads("--transforms", &**path);
        }
        for (method, path) in self.weights_by_method().iter().filter(|(_, path)| path.is_file()) {
            places = places.reads(format!("the weights of {method}"), &**path);
        }
        places = places.writes("--export-pairs", self.export_pairs.as_deref(), OutputKind::NPZ)?;
        for name in crate::report::file_names() {
            places = places.writes_into("--output", &self.out, &name);
        }
        places.check()
    }

    fn pair_config(&self) -> Result<PairConfig, EvalError> {
        let default = PairConfig::default();
        let rotation = match self.rotation.as_str() {
            "dcp" => default.rotation,
            "so3" => RotationRange::So3,
            degrees => {
                let max_deg = degrees.parse::<f64>().map_err(|_| {
                    EvalError::Usage(format!(
                        "--rotation {degrees}: give the largest Euler angle in degrees, `so3` or `dcp`"
                    ))
                })?;
                RotationRange::EulerAxes { max_deg }
            }
        };
        let sampling = if self.independent { "independent" } else { &self.sampling };
        Ok(PairConfig {
            corrupt: switch("--corrupt", &self.corrupt)?,
            sampling: switch("--sampling", sampling)?,
            normalize: switch("--normalize", &self.normalize)?,
            rotation,
            translation: self.translation,
            points: self.points,
            keep_correspondence: true,
            variants: self.reading.variants(),
        })
    }

    /// `--weights` by method: `METHOD=PATH`, or a path alone for srrf.
    pub fn weights_by_method(&self) -> BTreeMap<String, PathBuf> {
        weights_by_method(&self.weights)
    }

    /// Number of worker threads.
    pub fn thread_count(&self) -> usize {
        Threads { threads: self.threads }.count()
    }
}

/// A switch of [`PairConfig`] by its name in configs.
fn switch<T: DeserializeOwned>(option: &str, name: &str) -> Result<T, EvalError> {
    serde_json::from_value(name.into()).map_err(|e| EvalError::Usage(format!("{option} {name}: {e}")))
}

#[cfg(test)]
mod tests {
    use srrf_corrupt::{Corrupt, Normalize, Sampling, Variants};

    use clap::{CommandFactory, Parser};

    use super::*;

    fn parse(arguments: &str) -> EvalOptions {
        EvalOptions::try_parse_from(["srrf-eval"].into_iter().chain(arguments.split_whitespace())).unwrap()
    }

    #[test]
    fn the_options_are_consistent() {
        EvalOptions::command().debug_assert();
    }

    #[test]
    fn by_default_everything_is_scored() {
        let protocol = parse("").protocol().unwrap();
        assert!(protocol.clean && !protocol.dcp_poses);
        assert_eq!(protocol.corruptions, CorruptionKind::ALL);
        assert_eq!(protocol.severities, Severity::ALL);
        assert_eq!(protocol.pair, PairConfig::default());
    }

    #[test]
    fn every_switch_reaches_the_protocol() {
        let protocol = parse(
            "--corruptions cutout,gaussian,cutout --severities 5,1 --shapes 9 --seed 4 --points 200 \
             --independent --corrupt target --crop 0.7 --normalize after_pose --rotation so3 --translation 0.25 \
             --reading modelnet40_c",
        )
        .protocol()
        .unwrap();
        assert_eq!(protocol.corruptions, [CorruptionKind::Cutout, CorruptionKind::Gaussian]);
        assert_eq!(protocol.severities, [Severity::ALL[0], Severity::ALL[4]]);
        assert!(!protocol.clean);
        assert_eq!((protocol.shapes, protocol.seed, protocol.pair.points), (9, 4, 200));
        assert_eq!(protocol.pair.sampling, Sampling::Independent);
        assert_eq!(protocol.pair.corrupt, Corrupt::Target);
        assert_eq!(protocol.crop, Some(0.7));
        assert_eq!(protocol.pair.normalize, Normalize::AfterPose);
        assert_eq!(protocol.pair.rotation, RotationRange::So3);
        assert_eq!(protocol.pair.translation, 0.25);
        assert_eq!(protocol.pair.variants, Variants::modelnet40_c());
        assert!(parse("--rotation dcp").protocol().unwrap().dcp_poses);
        let clean = parse("--clean-only").protocol().unwrap();
        assert!(clean.clean && clean.corruptions.is_empty());
        let clean = parse("--corruptions clean").protocol().unwrap();
        assert!(clean.clean && clean.corruptions.is_empty());
    }

    #[test]
    fn weights_belong_to_methods() {
        let found = parse("--weights a=b.safetensors --weights dcp=c=d").weights_by_method();
        assert_eq!(found["srrf"], PathBuf::from("a=b.safetensors"), "no method is called a");
        assert_eq!(found["dcp"], PathBuf::from("c=d"));
        assert!(parse("").weights_by_method().is_empty());
    }

    #[test]
    fn bad_values_are_named() {
        let message = |arguments: &str| parse(arguments).protocol().unwrap_err().to_string();
        assert!(message("--corruptions rain").contains("`rain`"));
        assert!(message("--corruptions rain").contains("or `clean`"));
        assert!(message("--rotation far").contains("--rotation far"));
        let refused = |arguments: &str| {
            let words = ["srrf-eval"].into_iter().chain(arguments.split_whitespace());
            EvalOptions::try_parse_from(words).unwrap_err().to_string()
        };
        for (arguments, parts) in [
            ("--severities 9", ["--severities", "severity 9"]),
            ("--severities 3;5", ["--severities", "apart by commas: 3,5"]),
            ("--corruptions cutout;shear", ["--corruptions", "apart by commas: cutout,shear"]),
            ("--shapes 0", ["--shapes <N>", "from 1 to"]),
            ("--threads 0", ["--threads <N>", "from 1 to 4,096"]),
            ("--points 2", ["--points <N>", "from 3 to"]),
            ("--seed -1", ["--seed <N>", "from 0 to"]),
            ("--translation nan", ["--translation <LENGTH>", "from 0 to"]),
        ] {
            let message = refused(arguments);
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
    }
}
