//! The reference of all keys of a configuration, as Markdown, from the types: names, defaults and ranges by their JSON schema,
//! sentences by their doc comments.

use std::fmt::Write;

use schemars::{JsonSchema, schema_for};
use serde_json::Value as Json;
use srrf_baselines::{BASELINES, BaselineVisitor, LearnedConfig, visit};
use srrf_model::SrrfConfig;
use srrf_model::ranges::{range_of, resolved};

use super::train_config::TrainConfig;
use crate::nets::baseline::Baseline;
use crate::seam::Trained;

const HEAD: &str = "# Keys of a training configuration

<!-- Written by `srrf-train keys`. Do not edit: change the types, and write it again. -->

A configuration is a TOML file for `srrf-train --config FILE`. `extends = \"base.toml\"` at its top takes the keys of another file, named
relative to this one: tables merge key by key, every other value, lists as well, replaces what was there. A key that is not
listed here is an error, and so is a number out of its range. `--config LIST.toml#NAME` takes one of the `[[runs]]` of a list
(`lab/sweeps/`): what stands above them holds for each, and each says what it changes. `[]` stands for each entry of a list. Every run writes the resolved
configuration into its folder, as `config.toml`.
";

/// The keys of one kind of configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Keys {
    /// The `method`.
    pub method: &'static str,
    rows: Vec<KeyRow>,
}

/// One key.
#[derive(Debug, Clone, PartialEq)]
struct KeyRow {
    key: String,
    kind: String,
    default: String,
    range: String,
    sentence: String,
}

impl Keys {
    /// The keys with which `C` is trained.
    pub fn of<C: Trained>() -> Self {
        let schema = schema_for!(TrainConfig<C>);
        let mut rows = Vec::new();
        collect(schema.as_value(), schema.as_value(), "", &mut rows);
        Self { method: C::METHOD, rows }
    }

    /// The names of the keys, such as `stages[].epochs`.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.rows.iter().map(|row| row.key.as_str())
    }

    fn table(&self, text: &mut String, wanted: impl Fn(&str) -> bool) {
        text.push_str("\n| key | type | default | range | what it is |\n|---|---|---|---|---|\n");
        for row in self.rows.iter().filter(|row| wanted(&row.key)) {
            let KeyRow { key, kind, default, range, sentence } = row;
            let _ = writeln!(text, "| `{key}` | {kind} | {default} | {range} | {sentence} |");
        }
    }
}

/// The reference of all keys, of SRRF and of each learned baseline, as Markdown.
pub fn key_reference() -> String {
    struct OfBaseline;
    impl BaselineVisitor for OfBaseline {
        type Output = Keys;
        fn visit<C: LearnedConfig + JsonSchema + 'static>(self) -> Keys {
            Keys::of::<Baseline<C>>()
        }
    }
    let mut text = HEAD.to_string();
    let srrf = Keys::of::<SrrfConfig>();
    let _ = write!(text, "\n## `method = \"{}\"`, the default\n", srrf.method);
    srrf.table(&mut text, |_| true);
    for keys in BASELINES.iter().filter_map(|entry| visit(entry.name, OfBaseline)) {
        let _ = write!(text, "\n## `method = \"{}\"`\n\n", keys.method);
        text.push_str(
            "As above, with these instead of its `network` and `losses`; a stage trains the whole network.\n",
        );
        keys.table(&mut text, |key| {
            ["network", "losses"].iter().any(|part| key == *part || key.starts_with(&format!("{part}.")))
        });
    }
    text
}

/// The rows of all keys below a schema.
fn collect(root: &Json, schema: &Json, at: &str, rows: &mut Vec<KeyRow>) {
    let schema = resolved(root, schema);
    let required = |key: &str| {
        let listed = schema.get("required").and_then(Json::as_array);
        listed.is_some_and(|keys| keys.iter().any(|known| known == key))
    };
    for (key, property) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
        let key_at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
        let inner = not_null(root, property);
        let is_table = inner.get("properties").is_some();
        let default = match property.get("default") {
            _ if is_table => String::new(),
            Some(Json::Null) => "none".into(),
            Some(value) => format!("`{}`", toml_of(value)),
            None if required(key) => "must be given".into(),
            None => "none".into(),
        };
        rows.push(KeyRow {
            key: key_at.clone(),
            kind: kind_of(root, inner),
            default,
            range: range_text(root, property, inner),
            sentence: sentence_of(root, property, inner),
        });
        below(root, inner, &key_at, rows);
    }
    for part in ["anyOf", "oneOf", "allOf"] {
        for choice in schema.get(part).and_then(Json::as_array).into_iter().flatten() {
            collect(root, choice, at, rows);
        }
    }
}

/// The rows below a key: of a table, of the entries of a list, of a table with free names.
fn below(root: &Json, schema: &Json, at: &str, rows: &mut Vec<KeyRow>) {
    collect(root, schema, at, rows);
    if let Some(items) = schema.get("items") {
        below(root, resolved(root, items), &format!("{at}[]"), rows);
    }
}

/// A schema without its `null`, which stands for a key that is left out.
fn not_null<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let schema = resolved(root, schema);
    let choices = schema.get("anyOf").and_then(Json::as_array);
    let others: Vec<&Json> = choices
        .into_iter()
        .flatten()
        .filter(|choice| choice.get("type") != Some(&Json::from("null")))
        .collect();
    match others.as_slice() {
        [only] => resolved(root, only),
        _ => schema,
    }
}

/// The names of a choice: `"adam"`, or the key of a table.
fn choices(schema: &Json) -> Vec<(String, Option<&str>)> {
    let text = |choice: &Json| choice.get("const").and_then(Json::as_str).map(|name| format!("\"{name}\""));
    let table = |choice: &Json| {
        let name = choice.get("properties")?.as_object()?.keys().next()?;
        Some(format!("{{ {name} = .. }}"))
    };
    let mut found: Vec<(String, Option<&str>)> = Vec::new();
    for name in schema.get("enum").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str) {
        found.push((format!("\"{name}\""), None));
    }
    for choice in schema.get("oneOf").and_then(Json::as_array).into_iter().flatten() {
        let sentence = choice.get("description").and_then(Json::as_str);
        found.extend(choices(choice));
        found.extend(text(choice).or_else(|| table(choice)).map(|name| (name, sentence)));
    }
    found
}

fn kind_of(root: &Json, schema: &Json) -> String {
    let named = choices(schema);
    if !named.is_empty() {
        return named.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    }
    if let Some(several) = schema.get("anyOf").and_then(Json::as_array) {
        let kinds: Vec<String> = several.iter().map(|one| kind_of(root, resolved(root, one))).collect();
        return kinds.join(" or ");
    }
    let kind = schema.get("type");
    let kind = kind.and_then(|kind| match kind {
        Json::Array(kinds) => kinds.iter().find(|kind| *kind != "null").and_then(Json::as_str),
        kind => kind.as_str(),
    });
    match kind {
        Some("integer") => "whole number".into(),
        Some("number") => "number".into(),
        Some("boolean") => "true or false".into(),
        Some("string") => "text".into(),
        Some("object") => "table".into(),
        Some("array") => {
            let items = schema.get("items").map(|items| kind_of(root, resolved(root, items)));
            format!("list of {}", items.unwrap_or_default())
        }
        _ => "any".into(),
    }
}

/// The range of a number, or of the entries of a list.
fn range_text(root: &Json, property: &Json, inner: &Json) -> String {
    let items = inner.get("items").map(|items| resolved(root, items));
    let entries = items.and_then(range_of).map(|range| format!("each {range}"));
    let count = inner.get("minItems").filter(|least| **least != 0).map(|_| "not empty".to_string());
    let of_list = [count, entries].into_iter().flatten().collect::<Vec<_>>().join("; ");
    range_of(property).or_else(|| range_of(inner)).unwrap_or(of_list)
}

/// What the doc comments say of a key, and of each choice.
fn sentence_of(root: &Json, property: &Json, inner: &Json) -> String {
    let own = |schema: &Json| schema.get("description").and_then(Json::as_str).map(str::to_string);
    let mut text = own(property).or_else(|| own(inner)).unwrap_or_default();
    let items = inner.get("items").map_or(inner, |items| resolved(root, items));
    for (name, sentence) in choices(items) {
        if let Some(sentence) = sentence {
            let _ = write!(text, " `{name}`: {sentence}");
        }
    }
    plain_text(&text)
}

/// A doc comment in one line of a table: without the links of rustdoc.
fn plain_text(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some(start) = rest.find("[`") {
        let (before, link) = rest.split_at(start);
        plain.push_str(before);
        let Some(end) = link.find("`]") else { break };
        plain.push_str(&link[1..=end]);
        rest = &link[end + 2..];
        if rest.starts_with('(')
            && let Some(close) = rest.find(')')
        {
            rest = &rest[close + 1..];
        }
    }
    plain.push_str(rest);
    plain.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// A default as it stands in a TOML file.
fn toml_of(value: &Json) -> String {
    match toml::Value::try_from(value) {
        Ok(toml::Value::Table(table)) => {
            let entries = table.iter().map(|(key, value)| format!("{key} = {value}"));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
        Ok(value) => value.to_string(),
        Err(_) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rustdoc_becomes_a_line_of_a_table() {
        let text = "The `w` above ([`crate::Fusion`](crate::Fusion)), or [`X`].\n\nA | B.";
        assert_eq!(plain_text(text), "The `w` above (`crate::Fusion`), or `X`. A \\| B.");
    }

    #[test]
    fn a_row_says_type_default_range_and_sentence() {
        let keys = Keys::of::<SrrfConfig>();
        let row = |key: &str| keys.rows.iter().find(|row| row.key == key).unwrap().clone();
        let points = row("pairs.points");
        assert_eq!((points.kind.as_str(), points.default.as_str()), ("whole number", "`1024`"));
        assert!(points.range.contains("3") && points.sentence.contains("DCP"), "{points:?}");
        assert_eq!(row("optimizer.kind").kind, "`\"adam\"`, `\"adamw\"`, `\"sgd\"`");
        assert_eq!(row("stages[].schedule.milestones.factor").range, "more than 0, and at most 1");
        assert_eq!(row("stages[].sem").default, "`\"frozen\"`");
        assert_eq!(row("draw.severities").range, "not empty; each between 1 and 5");
        assert_eq!(row("losses.matching").default, "`0.0`");
        assert_eq!(row("optimizer.momentum").default, "none");
        assert!(row("losses.skeleton.index_match").default == "must be given");
    }
}
