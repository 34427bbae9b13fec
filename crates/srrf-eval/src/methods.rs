//! The registry of methods: a new method is one entry in [`METHODS`].

use std::collections::BTreeMap;
use std::path::PathBuf;

use srrf_baselines::{
    DcpConfig, EquiGsprConfig, LearnedConfig, LearnedRegister, PanetConfig, PointNetLkConfig, RgmConfig,
};
use srrf_classical::{Fgr, FpfhRansac, Icp, IcpConfig, IcpPlane, IcpRobust, IcpTrimmed, Identity};
use srrf_cloud::Register;
use srrf_model::weights::{self, LoadedModel};
use srrf_model::{BranchKind, NetworkConfig, SrrfRegister, embedded};
use srrf_refine::{RefineConfig, Refined};

use crate::EvalError;
use crate::transforms::Transforms;

/// Name of the row that fits a pose to the true correspondences: the floor for any estimator that
/// does least squares on matches.
pub const ORACLE: &str = "oracle";

/// What the entries of the registry may need to set up a method.
#[derive(Debug, Clone, Default)]
pub struct MethodContext {
    /// `--weights`, by method: a file of trained weights, or the name of a model in the program; the
    /// method's default where there is none.
    pub weights: BTreeMap<String, PathBuf>,
    /// `--device`: where tensors live, such as `flex`.
    pub device: String,
}

impl MethodContext {
    /// The context in which srrf has these weights, or its default, and every other method its default.
    pub fn of_srrf(weights: Option<PathBuf>, device: &str) -> Self {
        let weights = weights.map(|path| ("srrf".to_owned(), path)).into_iter().collect();
        Self { weights, device: device.to_owned() }
    }
}

/// A method ready to run.
pub struct Method {
    /// The method.
    pub register: Box<dyn Register>,
    /// Where its weights come from; `None` for methods that learn nothing.
    pub weights: Option<String>,
    /// Settings that are not the method's defaults, in words; empty for the defaults. With name and
    /// weights they name its answers in a [`Cache`](crate::Cache).
    pub settings: String,
    /// Rows of another method that this one answers on its way, each with the branch that holds it: where
    /// they are all that is wanted of the other, it need not run. As in its entry.
    pub holds: &'static [(&'static str, &'static str)],
}

impl Method {
    /// The branch that holds a row of another method.
    pub fn branch_of(&self, row: &str) -> Option<&'static str> {
        self.holds.iter().find(|(held, _)| *held == row).map(|(_, branch)| *branch)
    }
}

/// An entry of the registry.
pub struct MethodEntry {
    /// Name of the method, as its `Register::name`.
    pub name: &'static str,
    /// Names of the rows that it fills, in the order of the tables: a row for each branch
    /// (`<name>-<branch>`), then the method itself.
    pub rows: &'static [&'static str],
    /// Whether it runs when `--methods` is not given.
    pub by_default: bool,
    /// As [`Method::holds`].
    pub holds: &'static [(&'static str, &'static str)],
    /// Sets the method up; errors are in words.
    pub build: fn(&MethodContext) -> Result<Method, String>,
}

/// All methods, in the order of the tables. [`ORACLE`] is not among them: it is no `Register`, since
/// it needs to know the correspondences.
pub const METHODS: &[MethodEntry] = &[
    MethodEntry { by_default: true, ..optional("identity", &["identity"], |_| Ok(plain(Identity))) },
    MethodEntry { by_default: true, ..optional("icp", &["icp"], |_| Ok(plain(Icp::default()))) },
    optional("icp-centred", &["icp-centred"], |_| {
        Ok(plain(Icp::new(IcpConfig { centred: true, ..IcpConfig::default() })))
    }),
    optional("icp-plane", &["icp-plane"], |_| Ok(plain(IcpPlane::default()))),
    optional("icp-trimmed", &["icp-trimmed"], |_| Ok(plain(IcpTrimmed::default()))),
    optional("icp-robust", &["icp-robust"], |_| Ok(plain(IcpRobust::default()))),
    optional("fpfh-ransac", &["fpfh-ransac"], |_| Ok(plain(FpfhRansac::default()))),
    optional("fgr", &["fgr"], |_| Ok(plain(Fgr::default()))),
    optional("pointnetlk", &["pointnetlk"], learned::<PointNetLkConfig>),
    optional("dcp", &["dcp"], learned::<DcpConfig>),
    optional("rgm", &["rgm"], learned::<RgmConfig>),
    optional("panet", &["panet"], learned::<PanetConfig>),
    optional("equi-gspr", &["equi-gspr"], learned::<EquiGsprConfig>),
    MethodEntry {
        by_default: true,
        ..optional("srrf", &["srrf-dense", "srrf-skeleton", "srrf"], |context| {
            let (register, weights) = srrf(context)?;
            Ok(Method { weights: Some(weights), ..plain(register) })
        })
    },
    optional("srrf-dense-alone", &["srrf-dense-alone"], |context| alone(context, BranchKind::Dense)),
    optional("srrf-skeleton-alone", &["srrf-skeleton-alone"], |context| alone(context, BranchKind::Skeleton)),
    MethodEntry {
        holds: UNREFINED,
        ..optional("srrf+refine", &["srrf+refine"], |context| {
            let (register, weights) = srrf(context)?;
            let method = plain(Refined::new(register, RefineConfig::default()));
            Ok(Method { weights: Some(weights), holds: UNREFINED, ..method })
        })
    },
];

/// Rows of `srrf` that `srrf+refine` answers.
const UNREFINED: &[(&str, &str)] =
    &[("srrf-dense", "dense"), ("srrf-skeleton", "skeleton"), ("srrf", "unrefined")];

/// An entry that runs only where `--methods` names it.
const fn optional(
    name: &'static str,
    rows: &'static [&'static str],
    build: fn(&MethodContext) -> Result<Method, String>,
) -> MethodEntry {
    MethodEntry { name, rows, by_default: false, holds: &[], build }
}

/// A method that learns nothing, with its defaults.
pub(crate) fn plain(register: impl Register + 'static) -> Method {
    Method { register: Box::new(register), weights: None, settings: String::new(), holds: &[] }
}

/// A learned baseline, with the weights of `--weights NAME=PATH` or those in the program.
fn learned<C: LearnedConfig + 'static>(context: &MethodContext) -> Result<Method, String> {
    let device = srrf_model::device(&context.device).map_err(|e| e.to_string())?;
    let name = C::NAME;
    let (loaded, origin) = match (context.weights.get(name), srrf_baselines::embedded(name)) {
        (Some(path), _) => (weights::read::<C>(path, &device), path.display().to_string()),
        (None, Some(bytes)) => (weights::parse(bytes, name, &device), "in the program".to_owned()),
        (None, None) => {
            return Err(format!(
                "no weights of it are in the program; train some by `cargo run -p srrf-train -- --config \
                 configs/baselines/{name}.toml --data PATH`, then give `--weights {name}=runs/{name}/best.safetensors`"
            ));
        }
    };
    let loaded = loaded.map_err(|e| e.to_string())?;
    let weights = describe(&loaded, &origin);
    Ok(Method { weights: Some(weights), ..plain(LearnedRegister::new(loaded, device)) })
}

/// Which weights they are, for reports.
fn describe<C: NetworkConfig>(loaded: &LoadedModel<C>, origin: &str) -> String {
    let data = loaded.metadata.get("data").map_or("unknown data", String::as_str);
    format!("{} ({origin}, sha256 {}), trained on {data}", loaded.name, &loaded.sha256[..16])
}

/// The network, with the weights of `--weights` or those in the program.
fn srrf(context: &MethodContext) -> Result<(SrrfRegister, String), String> {
    let (loaded, weights) = network(context)?;
    let device = srrf_model::device(&context.device).map_err(|e| e.to_string())?;
    Ok((SrrfRegister::new(loaded, device), weights))
}

/// One branch of it in all passes.
fn alone(context: &MethodContext, branch: BranchKind) -> Result<Method, String> {
    let (register, weights) = srrf(context)?;
    Ok(Method { weights: Some(weights), ..plain(register.alone(branch)) })
}

/// The network of `--weights`, or the one in the program, and where it comes from, in words.
pub(crate) fn network(context: &MethodContext) -> Result<(LoadedModel, String), String> {
    let device = srrf_model::device(&context.device).map_err(|e| e.to_string())?;
    let (loaded, origin) = match context.weights.get("srrf") {
        Some(path) => {
            let name = path.to_string_lossy();
            let inside = embedded::names().any(|known| known == name);
            let origin = if inside { "in the program".to_owned() } else { name.to_string() };
            (embedded::open(&name, &device), origin)
        }
        None => (embedded::load_default(&device), "in the program".to_owned()),
    };
    let loaded = loaded.map_err(|e| e.to_string())?;
    let weights = describe(&loaded, &origin);
    Ok((loaded, weights))
}

/// The rows of a run and the methods that fill them.
pub struct Selection {
    /// Entries to set up.
    pub entries: Vec<&'static MethodEntry>,
    /// Rows of the tables, in order.
    pub rows: Vec<String>,
}

/// All row names, in the order of the tables.
pub fn all_rows() -> Vec<&'static str> {
    let mut rows: Vec<&str> = METHODS.iter().flat_map(|m| m.rows).copied().collect();
    // The oracle stands after the classical methods, before the learned ones.
    let place = rows.iter().position(|r| r.starts_with("srrf")).unwrap_or(rows.len());
    rows.insert(place, ORACLE);
    rows
}

/// Chooses rows by name (`--methods`); all default rows where `names` is empty.
///
/// # Errors
/// [`EvalError::Method`] for a name that is no row.
pub fn select(names: &[String]) -> Result<Selection, EvalError> {
    let known = all_rows();
    if let Some(name) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(EvalError::Method { name: name.clone(), known: known.join(", ") });
    }
    let wanted = |row: &str, by_default: bool| {
        if names.is_empty() { by_default } else { names.iter().any(|n| n == row) }
    };
    let by_default = |row: &str| METHODS.iter().find(|m| m.rows.contains(&row)).is_none_or(|m| m.by_default);
    let rows: Vec<String> =
        known.iter().filter(|row| wanted(row, by_default(row))).map(|row| (*row).to_owned()).collect();
    let entries = METHODS.iter().filter(|m| m.rows.iter().any(|r| rows.iter().any(|row| row == r))).collect();
    Ok(Selection { entries, rows })
}

impl Selection {
    /// Adds a row for each file of transforms.
    ///
    /// # Errors
    /// [`EvalError::Usage`] where the name of a file is that of a row already.
    pub fn add_transforms(&mut self, transforms: &[Transforms]) -> Result<(), EvalError> {
        for file in transforms {
            if all_rows().contains(&file.name.as_str()) || self.rows.contains(&file.name) {
                return Err(EvalError::Usage(format!(
                    "--transforms: the row `{}` exists already; the row is named after the file, so rename the \
                     file",
                    file.name
                )));
            }
            self.rows.push(file.name.clone());
        }
        Ok(())
    }

    /// Leaves out the oracle, for pairs without correspondences.
    ///
    /// # Errors
    /// [`EvalError::Usage`] where `names` (`--methods`) asks for it.
    pub fn drop_oracle(&mut self, names: &[String]) -> Result<(), EvalError> {
        if names.iter().any(|n| n == ORACLE) {
            return Err(EvalError::Usage(
                "--methods oracle: these pairs keep no correspondences; use --sampling shared, or pairs \
                 exported by this program"
                    .into(),
            ));
        }
        self.rows.retain(|row| row != ORACLE);
        Ok(())
    }

    /// Sets up the methods, each with the rows that it fills.
    ///
    /// # Errors
    /// [`EvalError::Setup`] where one cannot be set up, and where no row is left.
    pub fn set_up(
        &self,
        context: &MethodContext,
    ) -> Result<Vec<(&'static [&'static str], Method)>, EvalError> {
        if self.rows.is_empty() {
            return Err(EvalError::Usage("no method is left to score".into()));
        }
        let set_up = |entry: &&'static MethodEntry| {
            (entry.build)(context)
                .map(|method| (entry.rows, method))
                .map_err(|problem| EvalError::Setup { name: entry.name.to_owned(), problem })
        };
        let held: Vec<&str> = self.entries.iter().flat_map(|e| e.holds).map(|(row, _)| *row).collect();
        let runs = |entry: &&&MethodEntry| !entry.rows.iter().all(|row| held.contains(row));
        self.entries.iter().filter(runs).map(set_up).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_agree_with_the_methods() {
        let context = MethodContext::of_srrf(None, "flex");
        for entry in METHODS {
            let method = match (entry.build)(&context) {
                Ok(method) => method,
                Err(why) => {
                    let training = format!("--config configs/baselines/{}.toml", entry.name);
                    assert!(why.contains(&training), "{why}");
                    continue;
                }
            };
            assert_eq!(method.register.name(), entry.name);
            assert_eq!(entry.rows.last(), Some(&entry.name));
        }
    }

    #[test]
    fn a_method_that_answers_anothers_rows_runs_in_its_place() {
        let context = MethodContext::of_srrf(None, "flex");
        let running = |list: &[&str]| -> Vec<String> {
            let names: Vec<String> = list.iter().map(|n| (*n).to_owned()).collect();
            let methods = select(&names).unwrap().set_up(&context).unwrap();
            methods.iter().map(|(_, method)| method.register.name().to_owned()).collect()
        };
        assert_eq!(running(&["srrf-dense", "srrf", "srrf+refine"]), ["srrf+refine"]);
        assert_eq!(running(&["icp", "srrf-dense"]), ["icp", "srrf"]);
        for entry in METHODS {
            let holds = (entry.build)(&context).map(|method| method.holds);
            assert!(holds.is_err() || holds == Ok(entry.holds), "{}", entry.name);
        }
    }

    #[test]
    fn rows_are_chosen_by_name_and_kept_in_order() {
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let chosen = select(&names(&["oracle", "identity"])).unwrap();
        assert_eq!(chosen.rows, ["identity", "oracle"]);
        assert_eq!(chosen.entries.len(), 1);
        let default = select(&[]).unwrap();
        assert_eq!(default.rows[..3], ["identity", "icp", "oracle"]);
        assert!(!default.rows.iter().any(|r| r == "icp-centred"));
        let error = select(&names(&["icp", "magic"])).err().unwrap().to_string();
        assert!(error.contains("`magic`") && error.contains("identity, icp"), "{error}");
    }
}
