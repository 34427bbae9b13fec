//! The registry of methods: a new method is one entry in [`CLASSICAL`] or [`SRRF`], a new learned baseline one line in
//! `srrf-baselines`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::OnceLock;

use srrf::RotationRange;
use srrf_baselines::{BASELINES, BaselineVisitor, LearnedConfig, LearnedRegister};
use srrf_classical::{Fgr, FpfhRansac, Icp, IcpConfig, IcpPlane, IcpRobust, IcpTrimmed, Identity};
use srrf_cloud::Register;
use srrf_model::weights::{self, LoadedModel, WeightsError};
use srrf_model::{DeviceError, NetworkBranch, NetworkConfig, SrrfRegister, embedded};
use srrf_refine::{RefineConfig, Refined};

use crate::rows::TableRow;

/// Fingerprint of the code of the methods, for the answers that a [`Cache`](crate::Cache) keeps.
const METHODS_CODE: &str = env!("SRRF_METHODS_CODE");
/// Fingerprint of that code and of the product's.
pub(crate) const PRODUCT_CODE: &str = env!("SRRF_PRODUCT_CODE");

/// What the entries of the registry may need to set up a method.
#[derive(Debug, Clone)]
pub struct MethodContext {
    /// `--weights`, by method: a file of trained weights, or the name of a model in the program; the
    /// method's default where there is none.
    pub weights: BTreeMap<String, PathBuf>,
    /// `--device`: where tensors live, such as `flex`.
    pub device: String,
}

impl Default for MethodContext {
    /// Every method's default weights, on the CPU.
    fn default() -> Self {
        Self::of_srrf(None, "flex")
    }
}

impl MethodContext {
    /// The context in which srrf has these weights, or its default, and every other method its default.
    pub fn of_srrf(weights: Option<PathBuf>, device: &str) -> Self {
        let weights = weights.map(|path| ("srrf".to_owned(), path)).into_iter().collect();
        Self { weights, device: device.to_owned() }
    }

    /// The weights of srrf.
    fn srrf(&self) -> Option<&PathBuf> {
        self.weights.get("srrf")
    }
}

/// Why a method cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The device cannot be used.
    #[error("{0}")]
    Device(
        #[from]
        #[source]
        DeviceError,
    ),
    /// The weights cannot be used.
    #[error("{0}")]
    Weights(
        #[from]
        #[source]
        WeightsError,
    ),
    /// Nobody has trained it yet.
    #[error(
        "no weights of it are in the program; train some by `cargo run -p srrf-train -- --config \
         configs/baselines/{name}.toml --data PATH`, then give `--weights {name}=runs/{name}/best.safetensors`"
    )]
    Untrained {
        /// Its name.
        name: &'static str,
    },
    /// The product cannot be set up.
    #[error("{0}")]
    Product(
        #[from]
        #[source]
        srrf::Error,
    ),
    /// The network answers no skeletons, or the cloud makes no batch, or its numbers cannot be had from the device.
    #[error("{0}")]
    Network(&'static str),
}

/// A method ready to run.
pub struct ReadyMethod {
    /// The method.
    pub register: Box<dyn Register>,
    /// Its branches that have a row each, before the method's own.
    pub branches: &'static [&'static str],
    /// Rows of another method that this one answers on its way, each with the branch that holds it: where
    /// they are all that is wanted of the other, it need not run.
    pub holds: &'static [(TableRow, &'static str)],
    /// Where its weights come from; `None` for methods that learn nothing.
    pub weights: Option<String>,
    /// Settings that are not the method's defaults, in words; empty for the defaults. With name and
    /// weights they name its answers in a [`Cache`](crate::Cache).
    pub settings: String,
    /// Its name where the program knows it, for `--profile`.
    pub(crate) stage: &'static str,
    /// Fingerprint of the code that its answers depend on.
    pub(crate) code: &'static str,
}

impl ReadyMethod {
    /// A method without weights and with its default settings.
    pub fn new(register: impl Register + 'static) -> Self {
        Self {
            register: Box::new(register),
            branches: &[],
            holds: &[],
            weights: None,
            settings: String::new(),
            stage: "another method",
            code: METHODS_CODE,
        }
    }

    /// The rows that it fills: its branches, then itself.
    pub fn rows(&self) -> Vec<TableRow> {
        let name = || self.register.name().to_owned();
        let branches = self.branches.iter().map(|branch| TableRow::Branch(name().into(), (*branch).into()));
        branches.chain([TableRow::Method(name().into())]).collect()
    }

    fn with_weights(self, weights: String) -> Self {
        Self { weights: Some(weights), ..self }
    }
}

/// What kind of method it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodFamily {
    /// Nothing is learned.
    Classical,
    /// A learned method that the paper compares.
    Learned,
    /// The network of the paper, and what is built on it.
    Srrf,
}

/// An entry of the registry.
#[derive(Clone, Copy)]
pub struct MethodEntry {
    /// Name of the method, as its `Register::name`.
    pub name: &'static str,
    /// Its branches that have a row each.
    pub branches: &'static [&'static str],
    /// What kind it is.
    pub family: MethodFamily,
    /// Where it runs when `--methods` is not given.
    pub shown: Shown,
    build: fn(&MethodContext, &'static str) -> Result<ReadyMethod, SetupError>,
}

/// Where a method runs that nobody asked for by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// In the plain run and in `srrf-eval tables`.
    Everywhere,
    /// In `srrf-eval tables`.
    InTables,
    /// Only where `--methods` names it.
    OnRequest,
}

impl MethodEntry {
    /// An entry of the registry without branches.
    const fn new(
        name: &'static str,
        family: MethodFamily,
        shown: Shown,
        build: fn(&MethodContext, &'static str) -> Result<ReadyMethod, SetupError>,
    ) -> Self {
        Self { name, branches: &[], family, shown, build }
    }

    /// Sets the method up.
    ///
    /// # Errors
    /// [`SetupError`]
    pub fn set_up(&self, context: &MethodContext) -> Result<ReadyMethod, SetupError> {
        let method = (self.build)(context, self.name)?;
        Ok(ReadyMethod { branches: self.branches, stage: self.name, ..method })
    }

    /// The rows that it fills: its branches, then itself.
    pub fn rows(&self) -> Vec<TableRow> {
        let branches = self.branches.iter().map(|branch| TableRow::branch(self.name, branch));
        branches.chain([TableRow::method(self.name)]).collect()
    }
}

use MethodFamily::{Classical, Learned, Srrf};
use Shown::{Everywhere, InTables, OnRequest};

/// Methods that learn nothing, in the order of the tables.
const CLASSICAL: &[MethodEntry] = &[
    MethodEntry::new("identity", Classical, Everywhere, |_, _| Ok(ReadyMethod::new(Identity))),
    MethodEntry::new("icp", Classical, Everywhere, |_, _| Ok(ReadyMethod::new(Icp::default()))),
    MethodEntry::new("icp-centred", Classical, OnRequest, |_, _| {
        Ok(ReadyMethod::new(Icp::new(IcpConfig { centred: true, ..IcpConfig::default() })))
    }),
    MethodEntry::new("icp-plane", Classical, OnRequest, |_, _| Ok(ReadyMethod::new(IcpPlane::default()))),
    MethodEntry::new("icp-trimmed", Classical, OnRequest, |_, _| Ok(ReadyMethod::new(IcpTrimmed::default()))),
    MethodEntry::new("icp-robust", Classical, OnRequest, |_, _| Ok(ReadyMethod::new(IcpRobust::default()))),
    MethodEntry::new("fpfh-ransac", Classical, InTables, |_, _| Ok(ReadyMethod::new(FpfhRansac::default()))),
    MethodEntry::new("fgr", Classical, OnRequest, |_, _| Ok(ReadyMethod::new(Fgr::default()))),
];

/// The network of the paper, and what is built on it, in the order of the tables.
const SRRF: &[MethodEntry] = &[
    MethodEntry {
        branches: &["dense", "skeleton"],
        ..MethodEntry::new("srrf", Srrf, Everywhere, |context, _| {
            let (register, weights) = srrf(context)?;
            Ok(ReadyMethod::new(register).with_weights(weights))
        })
    },
    MethodEntry::new("srrf-dense-alone", Srrf, OnRequest, |context, _| alone(context, NetworkBranch::Dense)),
    MethodEntry::new("srrf-skeleton-alone", Srrf, OnRequest, |context, _| {
        alone(context, NetworkBranch::Skeleton)
    }),
    MethodEntry::new("srrf+refine", Srrf, InTables, |context, _| {
        let (register, weights) = srrf(context)?;
        let refined = ReadyMethod::new(Refined::new(register, RefineConfig::default()));
        Ok(ReadyMethod { holds: UNREFINED, ..refined }.with_weights(weights))
    }),
    MethodEntry::new("srrf-register", Srrf, Everywhere, |context, _| product(context, RotationRange::Any)),
    MethodEntry::new("srrf-register-45", Srrf, Everywhere, |context, _| {
        product(context, RotationRange::Within45)
    }),
];

/// Rows of `srrf` that `srrf+refine` answers.
const UNREFINED: &[(TableRow, &str)] =
    &[(TableRow::SRRF_DENSE, "dense"), (TableRow::SRRF_SKELETON, "skeleton"), (TableRow::SRRF, "unrefined")];

/// All methods, in the order of the tables. [`TableRow::Oracle`] is not among them: it is no `Register`, since it needs to
/// know the correspondences.
pub fn registry() -> &'static [MethodEntry] {
    static ALL: OnceLock<Vec<MethodEntry>> = OnceLock::new();
    ALL.get_or_init(|| {
        let learned = BASELINES.iter().map(|baseline| {
            MethodEntry::new(baseline.name, Learned, InTables, |context, name| {
                let missing = SetupError::Untrained { name };
                srrf_baselines::visit(name, SetUp(context)).unwrap_or(Err(missing))
            })
        });
        CLASSICAL.iter().copied().chain(learned).chain(SRRF.iter().copied()).collect()
    })
}

/// All rows, in the order of the tables: the oracle stands after the classical and learned methods, before ours.
pub fn all_rows() -> Vec<TableRow> {
    let of = |ours: bool| {
        registry().iter().filter(move |entry| (entry.family == Srrf) == ours).flat_map(MethodEntry::rows)
    };
    of(false).chain([TableRow::Oracle]).chain(of(true)).collect()
}

/// The entry whose method fills a row; `None` for the oracle, files and methods that are not in the registry.
pub(crate) fn entry_of(row: &TableRow) -> Option<&'static MethodEntry> {
    let (TableRow::Method(name) | TableRow::Branch(name, _)) = row else { return None };
    registry().iter().find(|entry| entry.name == name)
}

/// Whether a row is the network's, or of what is built on it.
pub(crate) fn is_ours(row: &TableRow) -> bool {
    entry_of(row).is_some_and(|entry| entry.family == Srrf)
}

/// Sets a learned baseline up, with the weights of `--weights NAME=PATH` or those in the program.
struct SetUp<'a>(&'a MethodContext);

impl BaselineVisitor for SetUp<'_> {
    type Output = Result<ReadyMethod, SetupError>;

    fn visit<C: LearnedConfig + 'static>(self) -> Self::Output {
        let (context, name) = (self.0, C::NAME);
        let device = srrf_model::device(&context.device)?;
        let (loaded, origin) = match (context.weights.get(name), srrf_baselines::embedded(name)) {
            (Some(path), _) => (weights::read::<C>(path, &device)?, path.display().to_string()),
            (None, Some(bytes)) => (weights::parse(bytes, name, &device)?, IN_THE_PROGRAM.to_owned()),
            (None, None) => return Err(SetupError::Untrained { name }),
        };
        let weights = describe(&loaded, &origin);
        Ok(ReadyMethod::new(LearnedRegister::new(loaded, device)).with_weights(weights))
    }
}

/// Where embedded weights come from, in words.
const IN_THE_PROGRAM: &str = "in the program";

/// Which weights they are, for reports.
fn describe<C: NetworkConfig>(loaded: &LoadedModel<C>, origin: &str) -> String {
    let data = loaded.metadata.get("data").map_or("unknown data", String::as_str);
    format!("{} ({origin}, sha256 {}), trained on {data}", loaded.name, &loaded.sha256[..16])
}

/// The network, with the weights of `--weights` or those in the program.
fn srrf(context: &MethodContext) -> Result<(SrrfRegister, String), SetupError> {
    let (loaded, weights) = network(context)?;
    Ok((SrrfRegister::new(loaded, srrf_model::device(&context.device)?), weights))
}

/// One branch of it in all passes.
fn alone(context: &MethodContext, branch: NetworkBranch) -> Result<ReadyMethod, SetupError> {
    let (register, weights) = srrf(context)?;
    Ok(ReadyMethod::new(register.alone(branch)).with_weights(weights))
}

/// What `srrf register` runs, with its default options but for the range of the rotation.
fn product(context: &MethodContext, rotation: RotationRange) -> Result<ReadyMethod, SetupError> {
    let (_, weights) = network(context)?;
    let options = srrf::Options {
        rotation,
        weights: context.srrf().map(|path| path.to_string_lossy().into_owned()),
        device: context.device.clone(),
        ..srrf::Options::default()
    };
    let settings = options.to_string();
    let method = ReadyMethod::new(srrf::Registrar::new(options)?).with_weights(weights);
    Ok(ReadyMethod { settings, code: PRODUCT_CODE, ..method })
}

/// The network of `--weights`, or the one in the program, and where it comes from, in words.
pub(crate) fn network(context: &MethodContext) -> Result<(LoadedModel, String), SetupError> {
    let device = srrf_model::device(&context.device)?;
    let (loaded, origin) = match context.srrf() {
        Some(path) => {
            let name = path.to_string_lossy();
            let inside = embedded::contains(&name);
            let origin = if inside { IN_THE_PROGRAM.to_owned() } else { name.to_string() };
            (embedded::open(&name, &device)?, origin)
        }
        None => (embedded::load_default(&device)?, IN_THE_PROGRAM.to_owned()),
    };
    let weights = describe(&loaded, &origin);
    Ok((loaded, weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_agree_with_the_methods() {
        let context = MethodContext::of_srrf(None, "flex");
        for entry in registry() {
            let method = entry.set_up(&context).unwrap();
            assert_eq!(method.register.name(), entry.name);
            assert_eq!(method.rows(), entry.rows());
            assert_eq!(entry_of(&TableRow::method(entry.name)).unwrap().name, entry.name);
        }
    }

    #[test]
    fn rows_have_one_name_each_and_the_oracle_its_place() {
        let rows = all_rows();
        let names: std::collections::BTreeSet<String> = rows.iter().map(TableRow::to_string).collect();
        assert_eq!(names.len(), rows.len());
        let oracle = rows.iter().position(|row| *row == TableRow::Oracle).unwrap();
        assert!(rows[..oracle].iter().all(|row| !is_ours(row)) && rows[oracle + 1..].iter().all(is_ours));
        let known = [
            TableRow::IDENTITY,
            TableRow::ICP,
            TableRow::FPFH_RANSAC,
            TableRow::DCP,
            TableRow::RGM,
            TableRow::SRRF_REFINE,
        ];
        for known in known.into_iter().chain([TableRow::SRRF_REGISTER, TableRow::SRRF_REGISTER_45]) {
            assert!(rows.contains(&known), "{known}");
        }
        assert!(TableRow::NETWORK.iter().all(|row| rows.contains(row)));
    }

    #[test]
    fn bad_weights_and_devices_keep_their_cause() {
        let bad =
            MethodContext { weights: [("dcp".to_owned(), "none".into())].into(), device: "flex".into() };
        let entry = entry_of(&TableRow::DCP).unwrap();
        assert!(matches!(entry.set_up(&bad), Err(SetupError::Weights(_))));
        let nowhere = MethodContext::of_srrf(None, "abacus");
        assert!(matches!(entry.set_up(&nowhere), Err(SetupError::Device(_))));
    }
}
