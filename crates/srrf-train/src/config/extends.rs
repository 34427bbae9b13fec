//! Configurations that say only what they change: `extends = "base.toml"`.
//!
//! The path is relative to the file that names it. Tables merge key by key; every other value, arrays as well, replaces
//! what it finds.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::ConfigError;

/// The key by which a file names what it changes.
const KEY: &str = "extends";

/// The files of a configuration, and what they say together.
#[derive(Debug, Clone)]
pub struct Layers {
    /// Each file with its own keys, the one that others change first.
    files: Vec<(PathBuf, Table)>,
    /// The text of the file, where there is only one.
    alone: Option<String>,
}

impl Layers {
    /// Reads a file and those that it extends.
    ///
    /// # Errors
    /// [`ConfigError`] where one cannot be read, is no TOML, or extends itself by way of others.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        Self::follow(path, &mut Vec::new())
    }

    /// The files of `table`, which stands in the file at `path`.
    pub(crate) fn of_table(path: &Path, table: Table) -> Result<Self, ConfigError> {
        Self::below(path, table, None, &mut vec![path.to_path_buf()])
    }

    fn follow(path: &Path, seen: &mut Vec<PathBuf>) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.into(), source })?;
        let table: Table = toml::from_str(&text)
            .map_err(|source| ConfigError::Parse { path: path.into(), source: Box::new(source) })?;
        // The same file under two names is the same file.
        let known = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        if seen.contains(&known) {
            return Err(ConfigError::Circle { path: path.into() });
        }
        seen.push(known);
        Self::below(path, table, Some(text), seen)
    }

    fn below(
        path: &Path,
        mut table: Table,
        text: Option<String>,
        seen: &mut Vec<PathBuf>,
    ) -> Result<Self, ConfigError> {
        let value = |why: &str| ConfigError::Value { path: path.into(), key: KEY.into(), why: why.into() };
        let Some(base) = table.remove(KEY) else {
            return Ok(Self { files: vec![(path.into(), table)], alone: text });
        };
        let base = base.as_str().ok_or_else(|| value("must be the name of a file"))?;
        let file = path.parent().unwrap_or(Path::new("")).join(base);
        let mut layers = Self::follow(&file, seen).map_err(|source| match source {
            ConfigError::Read { .. } => {
                ConfigError::Base { path: path.into(), base: base.into(), source: Box::new(source) }
            }
            other => other,
        })?;
        layers.files.push((path.into(), table));
        layers.alone = None;
        Ok(layers)
    }

    /// The same with the keys of `table`, which stands in the file at `path`, on top.
    pub(crate) fn with(mut self, path: &Path, table: Table) -> Self {
        self.files.push((path.into(), table));
        self.alone = None;
        self
    }

    /// The outermost file.
    pub fn path(&self) -> &Path {
        self.files.last().map_or(Path::new(""), |(path, _)| path)
    }

    /// All files.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(path, _)| path.as_path())
    }

    /// The text of the one file that this is, for messages with line and column.
    pub(crate) fn alone(&self) -> Option<&str> {
        self.alone.as_deref()
    }

    /// What the files say together.
    pub fn merged(&self) -> Table {
        let mut all = Table::new();
        self.files.iter().for_each(|(_, table)| merge(&mut all, table));
        all
    }

    /// The file that has the last word on `key`, such as `stages[0].epochs`; the outermost if none names it.
    pub(crate) fn file_of(&self, key: &str) -> &Path {
        let names: Vec<&str> = key.split('.').map(|name| name.split('[').next().unwrap_or(name)).collect();
        let depth = |table: &Table| {
            let mut at = table.get(names[0]);
            let mut depth = 0;
            while let Some(value) = at {
                depth += 1;
                at = names.get(depth).and_then(|name| value.as_table()?.get(*name));
            }
            depth
        };
        // The deepest match, and of equals the outermost.
        let found = self.files.iter().max_by_key(|(_, table)| depth(table));
        found.map_or(Path::new(""), |(path, _)| path)
    }
}

fn merge(below: &mut Table, above: &Table) {
    for (key, value) in above {
        match (below.get_mut(key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            _ => {
                below.insert(key.clone(), value.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("sub")).unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn tables_merge_by_key_and_arrays_replace() {
        let folder = folder(&[
            ("base.toml", "seed = 1\nlist = [1, 2, 3]\n[draw]\nclean = 0.1\nturned = 0.2\n"),
            ("middle.toml", "extends = \"base.toml\"\nlist = [7]\n[draw]\nclean = 0.5\n"),
            ("sub/top.toml", "extends = \"../middle.toml\"\nseed = 4\n[draw]\nnew = \"x\"\n"),
        ]);
        let layers = Layers::read(&folder.path().join("sub/top.toml")).unwrap();
        let wanted: Table =
            toml::from_str("seed = 4\nlist = [7]\n[draw]\nclean = 0.5\nturned = 0.2\nnew = \"x\"\n").unwrap();
        assert_eq!(layers.merged(), wanted);
        let file = |key: &str| layers.file_of(key).file_name().unwrap().to_str().unwrap().to_string();
        assert_eq!(
            ["draw.turned", "draw.clean", "draw.new", "list[0]", "nowhere"].map(file),
            ["base.toml", "middle.toml", "top.toml", "middle.toml", "top.toml"]
        );
    }

    #[test]
    fn circles_and_missing_files_are_named() {
        let folder = folder(&[
            ("a.toml", "extends = \"b.toml\"\n"),
            ("b.toml", "extends = \"sub/../a.toml\"\n"),
            ("c.toml", "extends = \"nothing.toml\"\n"),
            ("d.toml", "extends = 5\n"),
            ("e.toml", "extends = \"f.toml\"\n"),
            ("f.toml", "seed = \n"),
        ]);
        let said = |name: &str| {
            let error = Layers::read(&folder.path().join(name)).unwrap_err();
            let source = std::error::Error::source(&error).map(ToString::to_string);
            format!("{error} {}", source.unwrap_or_default())
        };
        assert!(said("a.toml").contains("extends itself"), "{}", said("a.toml"));
        let missing = said("c.toml");
        assert!(missing.contains("c.toml") && missing.contains("nothing.toml"), "{missing}");
        assert!(said("d.toml").contains("`extends`") && said("d.toml").contains("name of a file"));
        assert!(said("e.toml").contains("f.toml"));
    }
}
