//! [`Cast`]: the methods of a report, and those that are left out, with the reasons.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use srrf_model::embedded;

use crate::EvalError;
use crate::methods::{METHODS, Method, MethodContext, ORACLE, all_rows};

/// Rows of a report when `--methods` is not given: a floor, the paper's methods, the classical method
/// that is hardest to beat, and ours.
const DEFAULT: [&str; 13] = [
    "identity",
    "icp",
    "fpfh-ransac",
    "pointnetlk",
    "dcp",
    "rgm",
    "panet",
    "equi-gspr",
    ORACLE,
    "srrf-dense",
    "srrf-skeleton",
    "srrf",
    "srrf+refine",
];

/// Methods that are ready, and what is left out.
pub(crate) struct Cast {
    /// Methods with the rows that they may fill.
    pub methods: Vec<(&'static [&'static str], Method)>,
    /// Rows, in the order of the tables.
    pub rows: Vec<String>,
    /// Rows that are left out, and why.
    pub left_out: Vec<(String, String)>,
    /// For each method that learns, its weights.
    pub weights: BTreeMap<String, String>,
}

impl Cast {
    /// Sets up what `names` ask for, or the default rows. Rows of methods that cannot be set up are
    /// left out, unless `names` ask for them.
    ///
    /// # Errors
    /// [`EvalError::Method`] and [`EvalError::Setup`] for names that cannot be had.
    pub fn new(names: &[String], context: &MethodContext) -> Result<Self, EvalError> {
        let known = all_rows();
        if let Some(name) = names.iter().find(|n| !known.contains(&n.as_str())) {
            return Err(EvalError::Method { name: name.clone(), known: known.join(", ") });
        }
        let wanted: Vec<&str> =
            if names.is_empty() { DEFAULT.to_vec() } else { names.iter().map(String::as_str).collect() };
        let mut cast =
            Self { methods: Vec::new(), rows: Vec::new(), left_out: Vec::new(), weights: BTreeMap::new() };
        let missing = wanted.iter().filter(|name| !known.contains(name));
        cast.left_out.extend(missing.map(|n| ((*n).to_owned(), "this program does not have it".to_owned())));
        for entry in METHODS.iter().filter(|e| e.rows.iter().any(|row| wanted.contains(row))) {
            match (entry.build)(context) {
                Ok(method) => {
                    cast.weights.extend(method.weights.clone().map(|w| (entry.name.to_owned(), w)));
                    cast.methods.push((entry.rows, method));
                }
                Err(problem) if !names.is_empty() => {
                    return Err(EvalError::Setup { name: entry.name.into(), problem });
                }
                Err(problem) => cast.left_out.push((entry.name.to_owned(), problem)),
            }
        }
        let filled = |row: &str| row == ORACLE || cast.methods.iter().any(|(rows, _)| rows.contains(&row));
        cast.rows = known
            .iter()
            .filter(|row| wanted.contains(row) && filled(row))
            .map(|row| (*row).to_owned())
            .collect();
        Ok(cast)
    }

    /// The rows among `names`, in the order of the tables.
    pub fn only(&self, names: &[&str]) -> Vec<String> {
        self.rows.iter().filter(|row| names.contains(&row.as_str())).cloned().collect()
    }

    /// The method that fills a row.
    pub fn method(&self, row: &str) -> Option<&Method> {
        self.methods.iter().find(|(rows, _)| rows.contains(&row)).map(|(_, method)| method)
    }
}

/// The weights that an option gives, or a model of the program of this name, if there is one.
pub(crate) fn model_or(option: Option<&Path>, name: &str) -> Option<PathBuf> {
    let built_in = || embedded::contains(name).then(|| PathBuf::from(name));
    option.map(Path::to_owned).or_else(built_in)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_are_refused_and_unknown_defaults_left_out() {
        let context = MethodContext::of_srrf(None, "flex");
        let cast = Cast::new(&["oracle".into(), "icp".into()], &context).unwrap();
        assert_eq!((cast.rows.as_slice(), cast.methods.len()), (&["icp".into(), "oracle".into()][..], 1));
        assert!(cast.method("icp").is_some() && cast.method("srrf").is_none());
        assert_eq!(cast.only(&["oracle", "srrf"]), ["oracle"]);
        assert!(Cast::new(&["magic".into()], &context).is_err());
        let all = Cast::new(&[], &context).unwrap();
        for name in DEFAULT {
            let there = all.rows.iter().any(|r| r == name);
            assert_ne!(there, all.left_out.iter().any(|(n, _)| n == name), "{name}");
        }
        assert!(all.weights["srrf"].starts_with("srrf "));
    }
}
