//! How often the product trusts a pose between point sets that have nothing in common.
//!
//! `cargo run -p srrf-calibrate --bin unrelated -- [PAIRS] [SEED]` registers PAIRS pairs (default 300): as many points on each
//! side, few against many, and some points of a cloud that is sampled elsewhere; 3 to 1,000 points. Beside them copies of small
//! irregular sets, turned, which should be trusted. Prints a table.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program that prints")]

use std::collections::BTreeMap;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use srrf::{Options, Registrar, Request};
use srrf_calibrate::point_sets::PointSet;
use srrf_cloud::{EulerXyz, PointCloud, Rigid, is_right};

const SIZES: [usize; 9] = [3, 5, 10, 18, 32, 64, 100, 300, 1000];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let pairs: u64 = arguments.next().map_or(300, |n| n.parse().unwrap());
    let seed: u64 = arguments.next().map_or(1, |n| n.parse().unwrap());
    let registrar = Registrar::new(Options::default()).unwrap();
    let found: Vec<(String, usize, f64, bool)> = (0..pairs)
        .into_par_iter()
        .filter_map(|item| {
            let (name, size, source, target, truth) = pair(seed * 1_000_000 + item)?;
            let found = registrar.register(&Request::new(&source, &target)).ok()?;
            let right = truth.is_some_and(|t| is_right(&found.target_from_source, &t, &source, &target));
            if std::env::var_os("VERBOSE").is_some() && (found.abstain == truth.is_some()) {
                println!(
                    "{name} {size} p {:.2} right {right} {:?} {:?}",
                    found.probability, found.features, found.start
                );
            }
            Some((name, size, found.probability.get(), right))
        })
        .collect();
    let mut rows: BTreeMap<(&str, usize), [f64; 4]> = BTreeMap::new();
    for (name, size, probability, right) in &found {
        for size in [*size, usize::MAX] {
            let row = rows.entry((name, size)).or_default();
            row[0] += 1.0;
            row[1] += f64::from(u8::from(*probability >= 0.5));
            row[2] += probability;
            row[3] += f64::from(u8::from(*right));
        }
    }
    println!("| pairs | points | number | trusted | mean probability | right |\n|---|---|---|---|---|---|");
    for ((name, size), [n, trusted, probability, right]) in rows {
        let size = if size == usize::MAX { "all".to_owned() } else { size.to_string() };
        println!("| {name} | {size} | {n} | {trusted} | {:.3} | {right} |", probability / n);
    }
}

type Case = (String, usize, PointCloud, PointCloud, Option<Rigid>);

fn pair(stream: u64) -> Option<Case> {
    let mut rng = ChaCha8Rng::seed_from_u64(stream);
    let kind = PointSet::ALL[rng.random_range(0..PointSet::ALL.len())];
    let other =
        if rng.random_bool(0.5) { kind } else { PointSet::ALL[rng.random_range(0..PointSet::ALL.len())] };
    let size = SIZES[rng.random_range(0..SIZES.len())];
    let few = size.min(300);
    let scaled = |cloud: PointCloud, by: f64| -> PointCloud {
        PointCloud::new(cloud.points().iter().map(|p| p.map(|c| c * by)).collect()).unwrap()
    };
    let (a, b) = (stream * 2, stream * 2 + 1);
    let by = rng.random_range(-0.7..0.7_f64).exp();
    Some(match rng.random_range(0..6) {
        0 | 1 => ("as many".into(), size, kind.sample(size, a)?, other.sample(size, b)?, None),
        2 => {
            ("as many, scaled".into(), size, kind.sample(size, a)?, scaled(other.sample(size, b)?, by), None)
        }
        3 => ("few onto 2,000".into(), few, kind.sample(few, a)?, scaled(other.sample(2000, b)?, by), None),
        4 => {
            // Every so many-th point of the same cloud, turned: a pose there is, yet hard to find.
            let target = kind.sample(2000, a)?;
            let motion = EulerXyz::from_deg(std::array::from_fn(|_| rng.random_range(-180.0..180.0)));
            let truth = Rigid { rotation: motion.to_matrix(), ..Rigid::identity() };
            let some = target.points().iter().step_by(2000 / few).copied().collect();
            let source = PointCloud::new(some).unwrap().transformed(&truth.inverse());
            ("some of 2,000".into(), few, source, target, Some(truth))
        }
        _ => {
            let source = kind.sample(size, a)?;
            let motion = EulerXyz::from_deg(std::array::from_fn(|_| rng.random_range(-180.0..180.0)));
            let truth = Rigid { rotation: motion.to_matrix(), ..Rigid::identity() };
            let mut points = source.transformed(&truth).into_points();
            points.reverse();
            ("copies".into(), size, source, PointCloud::new(points).unwrap(), Some(truth))
        }
    })
}
