//! Lists of runs: a TOML file whose `[[runs]]` each say what they change. `list.toml#name` is one of them.
//!
//! What stands above the list holds for every run. A run, or the whole list, names by `extends` what it changes, relative to
//! the file of the list.

use std::path::Path;

use toml::{Table, Value};

use super::error::ConfigError;
use super::extends::Layers;

/// A run of a list.
#[derive(Debug, Clone)]
pub struct SweepRun {
    /// Its name in the list: `run`, or the name of the model where that says which one it is.
    pub name: String,
    /// What it is made of.
    pub layers: Layers,
}

/// The configuration at `path`: a file, or a run of a list, `list.toml#name`.
///
/// # Errors
/// [`ConfigError`] where a file cannot be read, is no TOML, or has no such run.
pub fn read_layers(path: &Path) -> Result<Layers, ConfigError> {
    let text = path.to_string_lossy();
    let (list, name) = match text.rsplit_once('#') {
        Some((list, name)) if !path.exists() => (Path::new(list), Some(name)),
        _ => (path, None),
    };
    if name.is_none() {
        let layers = Layers::read(list)?;
        if !layers.merged().contains_key("runs") {
            return Ok(layers);
        }
    }
    let runs = read_sweep(list)?;
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let why = format!("is a list: name one by {}#NAME, of {}", list.display(), names.join(", "));
    let found = runs.iter().find(|run| Some(run.name.as_str()) == name);
    let found = found.map(|run| run.layers.clone());
    found.ok_or_else(|| ConfigError::Value { path: list.into(), key: "runs".into(), why })
}

/// The runs of a list, in order.
///
/// # Errors
/// [`ConfigError`] where a file cannot be read, is no TOML, or has no `[[runs]]`.
pub fn read_sweep(path: &Path) -> Result<Vec<SweepRun>, ConfigError> {
    let wrong = |key: String, why: &str| ConfigError::Value { path: path.into(), key, why: why.into() };
    let text =
        std::fs::read_to_string(path).map_err(|source| ConfigError::Read { path: path.into(), source })?;
    let mut common: Table = toml::from_str(&text)
        .map_err(|source| ConfigError::Parse { path: path.into(), source: Box::new(source) })?;
    let Some(Value::Array(runs)) = common.remove("runs") else {
        return Err(wrong("runs".into(), "must be a list of tables, [[runs]]"));
    };
    let mut found: Vec<SweepRun> = Vec::new();
    for (i, run) in runs.into_iter().enumerate() {
        let Value::Table(mut run) = run else {
            return Err(wrong(format!("runs[{i}]"), "must be a table, [[runs]]"));
        };
        let mut shared = common.clone();
        if let Some(base) = run.remove("extends") {
            shared.insert("extends".into(), base);
        }
        let name = run.remove("run").or_else(|| run.get("name").cloned());
        let name = name.as_ref().and_then(Value::as_str).map(str::to_string);
        let name = name.ok_or_else(|| wrong(format!("runs[{i}].name"), "must be given, as text"))?;
        if found.iter().any(|known| known.name == name) {
            return Err(wrong(
                format!("runs[{i}].name"),
                "is the name of a run before it; give it a `run` too",
            ));
        }
        let layers = Layers::of_table(path, shared)?.with(path, run);
        found.push(SweepRun { name, layers });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_changes_what_all_runs_change() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        write("base.toml", "seed = 1\n[draw]\nclean = 0.1\n");
        write("other.toml", "seed = 2\n[draw]\nclean = 0.2\n");
        let list = "extends = \"base.toml\"\n[draw]\nturned = 0.5\n[[runs]]\nname = \"a\"\n\
                    [[runs]]\nextends = \"other.toml\"\nname = \"b\"\ndraw = { turned = 0.7 }\n";
        let runs = read_sweep(&write("list.toml", list)).unwrap();
        let texts: Vec<(String, Table)> = runs.iter().map(|r| (r.name.clone(), r.layers.merged())).collect();
        let table = |text: &str| toml::from_str::<Table>(text).unwrap();
        assert_eq!(
            texts,
            [
                ("a".into(), table("name = \"a\"\nseed = 1\ndraw = { clean = 0.1, turned = 0.5 }")),
                ("b".into(), table("name = \"b\"\nseed = 2\ndraw = { clean = 0.2, turned = 0.7 }")),
            ]
        );
        let one = |name: &str| read_layers(&folder.path().join(name));
        assert_eq!(one("list.toml#b").unwrap().merged()["seed"].as_integer(), Some(2));
        assert_eq!(one("base.toml").unwrap().merged()["seed"].as_integer(), Some(1));
        for name in ["list.toml", "list.toml#c"] {
            let why = one(name).unwrap_err().to_string();
            assert!(why.contains("list.toml#NAME") && why.contains("a, b"), "{why}");
        }
        let refused = |text: &str| read_sweep(&write("wrong.toml", text)).unwrap_err().to_string();
        assert!(refused("extends = \"base.toml\"\n").contains("[[runs]]"));
        assert!(refused("[[runs]]\nseed = 4\n").contains("runs[0].name"));
        assert!(refused("[[runs]]\nname = \"a\"\n[[runs]]\nname = \"a\"\n").contains("runs[1].name"));
    }
}
