//! Attributes of several scans, one after the other.

use nalgebra::Vector3;
use srrf_cloud::Rigid;
use srrf_cloud::io::{Attribute, AttributeValues};

/// Names of the parts of a normal.
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// The attributes that all scans so far have.
#[derive(Debug, Default)]
pub struct Gathered {
    /// One value a point, of all scans so far.
    pub kept: Vec<Attribute>,
    /// Names of those that some have.
    pub left_out: Vec<String>,
    begun: bool,
}

impl Gathered {
    /// Adds the values at these places, normals turned.
    pub fn add(&mut self, all: Vec<Attribute>, places: &[usize], map_from_scan: &Rigid) {
        let mut next: Vec<Attribute> =
            all.into_iter().map(|a| Attribute { values: at(&a.values, places), name: a.name }).collect();
        turn_normals(&mut next, map_from_scan);
        if !self.begun {
            (self.begun, self.kept) = (true, next);
            return;
        }
        let mut before = std::mem::take(&mut self.kept);
        for attribute in next {
            match before.iter().position(|b| b.name == attribute.name) {
                Some(place) => {
                    let Attribute { name, values } = before.swap_remove(place);
                    match joined(values, attribute.values) {
                        Some(values) => self.kept.push(Attribute { name, values }),
                        None => self.leave(name),
                    }
                }
                None => self.leave(attribute.name),
            }
        }
        before.into_iter().for_each(|a| self.leave(a.name));
        // In one order whatever the scans.
        self.kept.sort_by(|a, b| a.name.cmp(&b.name));
    }

    fn leave(&mut self, name: String) {
        if !self.left_out.contains(&name) {
            self.left_out.push(name);
        }
    }
}

macro_rules! each_kind {
    ($values:expr, $v:ident => $made:expr) => {
        match $values {
            AttributeValues::I8($v) => AttributeValues::I8($made),
            AttributeValues::U8($v) => AttributeValues::U8($made),
            AttributeValues::I16($v) => AttributeValues::I16($made),
            AttributeValues::U16($v) => AttributeValues::U16($made),
            AttributeValues::I32($v) => AttributeValues::I32($made),
            AttributeValues::U32($v) => AttributeValues::U32($made),
            AttributeValues::I64($v) => AttributeValues::I64($made),
            AttributeValues::U64($v) => AttributeValues::U64($made),
            AttributeValues::F32($v) => AttributeValues::F32($made),
            AttributeValues::F64($v) => AttributeValues::F64($made),
        }
    };
}

fn at(values: &AttributeValues, places: &[usize]) -> AttributeValues {
    each_kind!(values, v => places.iter().filter_map(|i| v.get(*i).copied()).collect())
}

/// Two lists of one type; of two types as `f64`, where that is exact.
fn joined(a: AttributeValues, b: AttributeValues) -> Option<AttributeValues> {
    macro_rules! one_kind {
        ($($kind:ident),*) => {
            match (a, b) {
                $((AttributeValues::$kind(mut a), AttributeValues::$kind(b)) => {
                    a.extend(b);
                    Some(AttributeValues::$kind(a))
                })*
                (AttributeValues::I64(_) | AttributeValues::U64(_), _) | (_, AttributeValues::I64(_) | AttributeValues::U64(_)) => None,
                (a, b) => {
                    let all = |values: &AttributeValues| (0..values.len()).filter_map(|i| values.get(i)).collect::<Vec<f64>>();
                    Some(AttributeValues::F64([all(&a), all(&b)].concat()))
                }
            }
        };
    }
    one_kind!(I8, U8, I16, U16, I32, U32, I64, U64, F32, F64)
}

fn turn_normals(all: &mut [Attribute], motion: &Rigid) {
    let places = NORMAL.map(|name| all.iter().position(|a| a.name == name));
    let [Some(x), Some(y), Some(z)] = places else { return };
    let single = matches!(all[x].values, AttributeValues::F32(_));
    let part = |i: usize, at: usize| all[at].values.get(i).unwrap_or(f64::NAN);
    let turned: Vec<Vector3<f64>> = (0..all[x].values.len())
        .map(|i| motion.rotation * Vector3::new(part(i, x), part(i, y), part(i, z)))
        .collect();
    for (axis, at) in [x, y, z].into_iter().enumerate() {
        all[at].values = if single {
            AttributeValues::F32(turned.iter().map(|n| n[axis] as f32).collect())
        } else {
            AttributeValues::F64(turned.iter().map(|n| n[axis]).collect())
        };
    }
}

#[cfg(test)]
mod tests {
    use srrf_cloud::EulerXyz;

    use super::*;

    fn attribute(name: &str, values: AttributeValues) -> Attribute {
        Attribute { name: name.into(), values }
    }

    #[test]
    fn what_all_scans_have_is_kept_and_the_rest_is_named() {
        let mut gathered = Gathered::default();
        let red = |v: &[u8]| attribute("red", AttributeValues::U8(v.to_vec()));
        let first = vec![red(&[1, 2, 3]), attribute("time", AttributeValues::F64(vec![0.5; 3]))];
        gathered.add(first, &[2, 0], &Rigid::identity());
        gathered.add(
            vec![attribute("ring", AttributeValues::U16(vec![9])), red(&[7])],
            &[0],
            &Rigid::identity(),
        );
        assert_eq!(gathered.kept, [red(&[3, 1, 7])]);
        assert_eq!(gathered.left_out, ["ring", "time"]);
    }

    #[test]
    fn two_types_become_doubles_and_normals_are_turned() {
        let mut gathered = Gathered::default();
        let normal = |values: [f32; 3]| {
            [0, 1, 2].map(|i| attribute(NORMAL[i], AttributeValues::F32(vec![values[i]]))).to_vec()
        };
        let mut first = normal([1.0, 0.0, 0.0]);
        first.push(attribute("intensity", AttributeValues::U16(vec![500])));
        let mut second = normal([0.0, 0.0, 1.0]);
        second.push(attribute("intensity", AttributeValues::F32(vec![0.25])));
        let turn = Rigid { rotation: EulerXyz::from_deg([0.0, 0.0, 90.0]).to_matrix(), ..Rigid::identity() };
        gathered.add(first, &[0], &turn);
        gathered.add(second, &[0], &Rigid::identity());
        let value = |name: &str, i: usize| {
            gathered.kept.iter().find(|a| a.name == name).and_then(|a| a.values.get(i)).unwrap()
        };
        assert_eq!((value("intensity", 0), value("intensity", 1)), (500.0, 0.25));
        assert!(value("nx", 0).abs() < 1e-7 && (value("ny", 0) - 1.0).abs() < 1e-7);
        assert_eq!((value("nz", 1), value("ny", 1)), (1.0, 0.0));
    }
}
