//! The one check of every number of a configuration, of a training or in the header of weights: the ranges that stand beside the fields, as `#[schemars(range(..))]`
//! and its kin, against the resolved values. A fraction without a range must still be a finite number.

use schemars::Schema;
use serde_json::Value as Json;
use toml::Value;

/// The first value out of its range, with its key and what it must be.
pub fn out_of_range(schema: &Schema, value: &Value) -> Option<(String, String)> {
    let root = schema.as_value();
    Walk { root }.first_wrong(root, value, "")
}

/// The part of `root` that a schema points to, or the schema itself.
pub fn resolved<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let name = schema.get("$ref").and_then(Json::as_str).and_then(|path| path.strip_prefix('#'));
    name.and_then(|path| root.pointer(path)).unwrap_or(schema)
}

/// The range of a schema in words, such as `0 to 1`; none where there is none.
pub fn range_of(schema: &Json) -> Option<String> {
    let number = |key: &str| schema.get(key).and_then(Json::as_f64);
    let least = number("minimum");
    let most = number("maximum");
    match (least, number("exclusiveMinimum"), most, number("exclusiveMaximum")) {
        (Some(a), None, Some(b), None) => Some(format!("between {} and {}", plain(a), plain(b))),
        (Some(a), None, None, Some(b)) => Some(format!("{} or more, and less than {}", plain(a), plain(b))),
        (None, Some(a), Some(b), None) => Some(format!("more than {}, and at most {}", plain(a), plain(b))),
        (None, Some(a), None, None) => Some(format!("more than {}", plain(a))),
        (Some(a), None, None, None) => Some(format!("{} or more", plain(a))),
        (None, None, Some(b), None) => Some(format!("at most {}", plain(b))),
        _ => None,
    }
}

/// A number without an exponent where it is short.
fn plain(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-4 || value.abs() >= 1e9) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

struct Walk<'a> {
    root: &'a Json,
}

impl Walk<'_> {
    fn first_wrong(&self, schema: &Json, value: &Value, at: &str) -> Option<(String, String)> {
        let target = resolved(self.root, schema);
        if !std::ptr::eq(target, schema)
            && let Some(found) = self.first_wrong(target, value, at)
        {
            return Some(found);
        }
        for key in ["anyOf", "oneOf", "allOf"] {
            for part in schema.get(key).and_then(Json::as_array).into_iter().flatten() {
                if let Some(found) = self.first_wrong(part, value, at) {
                    return Some(found);
                }
            }
        }
        match value {
            Value::Integer(number) => wrong_number(schema, *number as f64, at),
            Value::Float(number) => wrong_number(schema, *number, at),
            Value::Array(items) => {
                let count = |key: &str| schema.get(key).and_then(Json::as_u64);
                if count("minItems").is_some_and(|least| (items.len() as u64) < least) {
                    return Some((at.into(), "must not be empty".into()));
                }
                if let Some(most) = count("maxItems").filter(|most| items.len() as u64 > *most) {
                    return Some((at.into(), format!("must have {most} entries at most")));
                }
                let each = schema.get("items").unwrap_or(&Json::Null);
                let mut numbered = items.iter().enumerate();
                numbered.find_map(|(i, item)| self.first_wrong(each, item, &format!("{at}[{i}]")))
            }
            Value::Table(table) => table.iter().find_map(|(key, value)| {
                let known = schema.get("properties").and_then(|known| known.get(key)).unwrap_or(&Json::Null);
                let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
                self.first_wrong(known, value, &at)
            }),
            _ => None,
        }
    }
}

fn wrong_number(schema: &Json, value: f64, at: &str) -> Option<(String, String)> {
    if !value.is_finite() {
        return Some((at.into(), format!("must be a number, and is {value}")));
    }
    let limit = |key: &str| schema.get(key).and_then(Json::as_f64);
    let within = limit("minimum").is_none_or(|least| value >= least)
        && limit("maximum").is_none_or(|most| value <= most)
        && limit("exclusiveMinimum").is_none_or(|least| value > least)
        && limit("exclusiveMaximum").is_none_or(|most| value < most);
    if within {
        return None;
    }
    let range = range_of(schema).unwrap_or_else(|| "another number".into());
    Some((at.into(), format!("must be {range}, and is {}", plain(value))))
}

#[cfg(test)]
mod tests {
    use schemars::{JsonSchema, schema_for};
    use serde::Serialize;

    use super::*;

    #[derive(Serialize, JsonSchema)]
    struct Inner {
        #[schemars(range(min = 0.0, max = 1.0))]
        share: f64,
        free: f64,
    }

    #[derive(Serialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        Near {
            #[schemars(range(max = 5.0), extend("exclusiveMinimum" = 0.0))]
            radius: f64,
        },
        Far,
    }

    #[derive(Serialize, JsonSchema)]
    struct Outer {
        inner: Inner,
        list: Vec<Inner>,
        #[schemars(length(min = 1, max = 3), inner(range(min = 1, max = 9)))]
        widths: Vec<usize>,
        #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 1.0))]
        momentum: Option<f64>,
        choice: Choice,
    }

    fn good() -> Outer {
        Outer {
            inner: Inner { share: 0.5, free: -1e300 },
            list: vec![Inner { share: 1.0, free: 0.0 }],
            widths: vec![1, 9],
            momentum: Some(0.0),
            choice: Choice::Near { radius: 5.0 },
        }
    }

    fn wrong(change: impl Fn(&mut Outer)) -> Option<(String, String)> {
        let mut value = good();
        change(&mut value);
        out_of_range(&schema_for!(Outer), &Value::try_from(&value).unwrap())
    }

    #[test]
    fn every_kind_of_limit_is_held_and_named_by_key() {
        assert_eq!(wrong(|_| {}), None);
        assert_eq!(wrong(|o| o.momentum = None), None);
        assert_eq!(wrong(|o| o.choice = Choice::Far), None);
        let key = |change: fn(&mut Outer)| wrong(change).unwrap().0;
        assert_eq!(key(|o| o.inner.share = 1.5), "inner.share");
        assert_eq!(key(|o| o.inner.free = f64::NAN), "inner.free");
        assert_eq!(key(|o| o.inner.free = f64::INFINITY), "inner.free");
        assert_eq!(key(|o| o.list[0].share = f64::NAN), "list[0].share");
        assert_eq!(key(|o| o.widths = vec![]), "widths");
        assert_eq!(key(|o| o.widths = vec![1; 4]), "widths");
        assert_eq!(key(|o| o.widths = vec![3, 10]), "widths[1]");
        assert_eq!(key(|o| o.momentum = Some(1.0)), "momentum");
        assert_eq!(key(|o| o.choice = Choice::Near { radius: 0.0 }), "choice.near.radius");
        let why = wrong(|o| o.inner.share = 1.5).unwrap().1;
        assert_eq!(why, "must be between 0 and 1, and is 1.5");
    }
}
