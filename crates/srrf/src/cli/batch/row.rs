//! [`BatchRow`]: what a batch says of one pair.

use serde_json::{Map, Value, json};
use srrf::AnswerVersion;

use super::pair::ListedPair;

/// The result of one pair: an object with the keys of the JSON reference, and `id`, `initial`, `options`, `columns` (those of
/// the list that are carried); or with `error` in place of the pose.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchRow(pub Map<String, Value>);

impl BatchRow {
    /// Of an answer, or of why there is none.
    pub fn new(pair: &ListedPair, options: &Value, answer: Result<Value, String>) -> Self {
        let mut row = match answer {
            Ok(Value::Object(answer)) => answer,
            Ok(other) => Map::from_iter([("error".to_owned(), json!(format!("not an answer: {other}")))]),
            Err(error) => Map::from_iter([("error".to_owned(), json!(error))]),
        };
        row.entry("schema").or_insert_with(|| json!(AnswerVersion::V1));
        row.insert("id".into(), json!(pair.id));
        row.insert("source".into(), json!(pair.source));
        row.insert("target".into(), json!(pair.target));
        row.insert("initial".into(), json!(pair.initial));
        row.insert("columns".into(), Value::Object(pair.columns.clone()));
        row.insert("options".into(), options.clone());
        Self(row)
    }

    /// Of a line of results.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        match serde_json::from_str(text) {
            Ok(Value::Object(row)) if row.get("id").is_some_and(Value::is_string) => Ok(Self(row)),
            _ => Err("not a line of results".into()),
        }
    }

    /// What the pair is known by.
    pub fn id(&self) -> &str {
        self.0.get("id").and_then(Value::as_str).unwrap_or_default()
    }

    /// Why there is no pose.
    pub fn error(&self) -> Option<&str> {
        self.0.get("error").and_then(Value::as_str)
    }

    /// A number of the answer, by the keys on the way to it.
    pub fn number(&self, way: &[&str]) -> Option<f64> {
        let (first, rest) = way.split_first()?;
        let found = rest.iter().try_fold(self.0.get(*first)?, |value, key| value.get(key))?;
        found.as_f64()
    }

    /// A text of the answer.
    pub fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).and_then(Value::as_str)
    }

    /// Whether the answer is to abstain; `None` without an answer.
    pub fn abstain(&self) -> Option<bool> {
        self.0.get("abstain").and_then(Value::as_bool)
    }

    /// A column of the list.
    pub fn column(&self, name: &str) -> Option<&Value> {
        self.0.get("columns")?.get(name)
    }

    /// The names of the list's columns.
    pub fn columns(&self) -> impl Iterator<Item = &String> {
        self.0.get("columns").and_then(Value::as_object).into_iter().flat_map(Map::keys)
    }

    /// The pose, row by row.
    pub fn pose(&self) -> Option<[f64; 16]> {
        let rows = self.0.get("target_from_source")?;
        let mut pose = [0.0; 16];
        for (i, number) in pose.iter_mut().enumerate() {
            *number = rows.get(i / 4)?.get(i % 4)?.as_f64()?;
        }
        Some(pose)
    }

    /// Wall time of all stages.
    pub fn seconds(&self) -> Option<f64> {
        Some(self.0.get("seconds")?.as_object()?.values().filter_map(Value::as_f64).sum())
    }

    /// Whether this is the same pair of the same list with the same options; otherwise what differs.
    ///
    /// # Errors
    /// The difference, in words.
    pub fn belongs_to(&self, pair: &ListedPair, options: &Value) -> Result<(), String> {
        let named = |key: &str| self.0.get(key).and_then(Value::as_str);
        let same = named("source") == Some(&pair.source)
            && named("target") == Some(&pair.target)
            && named("initial") == pair.initial.as_deref();
        if !same {
            return Err(format!("the pair {:?} has other files in the list", pair.id));
        }
        match self.0.get("options") {
            Some(made) if made == options => Ok(()),
            made => Err(format!("made with other options ({})", made.unwrap_or(&Value::Null))),
        }
    }

    /// Whether two rows say the same, but for the times.
    pub fn agrees_with(&self, other: &Self) -> bool {
        let untimed = |row: &Self| {
            let mut row = row.0.clone();
            row.remove("seconds");
            row
        };
        untimed(self) == untimed(other)
    }

    /// One line of JSON, without its end.
    pub fn to_line(&self) -> String {
        json!(self.0).to_string()
    }
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;

    /// A pair of the list without extras.
    pub fn listed(source: &str, target: &str) -> ListedPair {
        ListedPair {
            id: format!("{source} -> {target}"),
            source: source.into(),
            target: target.into(),
            initial: None,
            columns: Map::from_iter([("site".to_owned(), json!("ü, 1"))]),
        }
    }

    /// An answer whose pose shifts by `x`.
    pub fn answered(source: &str, x: f64, probability: f64) -> BatchRow {
        let pose =
            [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.1 + 0.2], [0.0, 0.0, 1.0, -0.0], [0.0, 0.0, 0.0, 1.0]];
        let answer = json!({
            "target_from_source": pose,
            "probability": probability,
            "abstain": probability < 0.5,
            "evidence": { "fitness": 0.75, "inlier_rmse": 0.01, "overlap_target": 0.5 },
            "points": { "source": 10, "target": 12 },
            "start": "icp",
            "seconds": { "icp": 0.25, "refine": 0.5 },
            "warnings": ["one, two"],
        });
        BatchRow::new(&listed(source, "t"), &json!({ "seed": 1 }), Ok(answer))
    }

    /// A failure.
    pub fn failed(source: &str) -> BatchRow {
        BatchRow::new(&listed(source, "t"), &json!({ "seed": 1 }), Err("no \"pose\"".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::testing::{answered, failed, listed};
    use super::*;

    #[test]
    fn figures_are_found_by_name() {
        let row = answered("a", 2.5, 0.9);
        assert_eq!((row.id(), row.error(), row.abstain()), ("a -> t", None, Some(false)));
        assert_eq!(row.pose().unwrap()[3], 2.5);
        assert_eq!((row.seconds(), row.number(&["evidence", "fitness"])), (Some(0.75), Some(0.75)));
        assert_eq!(BatchRow::parse(&row.to_line()).unwrap(), row);
        let none = failed("a");
        assert_eq!((none.error(), none.abstain(), none.pose()), (Some("no \"pose\""), None, None));
        assert!(BatchRow::parse("{}").is_err() && BatchRow::parse("hello").is_err());
    }

    #[test]
    fn rows_know_their_pair() {
        let row = answered("a", 2.5, 0.9);
        assert_eq!(row.belongs_to(&listed("a", "t"), &json!({ "seed": 1 })), Ok(()));
        let other = row.belongs_to(&listed("a", "t"), &json!({ "seed": 2 })).unwrap_err();
        assert!(other.contains("other options"), "{other}");
        let files = ListedPair { source: "b".into(), ..listed("a", "t") };
        assert!(row.belongs_to(&files, &json!({ "seed": 1 })).unwrap_err().contains("other files"));
        let mut later = row.clone();
        later.0.insert("seconds".into(), json!({ "icp": 9.0 }));
        assert!(row.agrees_with(&later) && !row.agrees_with(&answered("a", 2.0, 0.9)));
    }
}
