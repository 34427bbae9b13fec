//! [`ScaleDoubt`]: two clouds that seem to be in different units of length.

use std::fmt;

use rayon::prelude::*;
use srrf_cloud::{PointCloud, point_spacing};

/// Sizes of the source and the target that are at most this far from each other need no other unit.
const LEAST: f64 = 2.0;
/// A cloud whose radius is less than so many spacings of the other cannot be laid on it as it is: it is no more than a few of its points.
const SPECK: f64 = 2.0;
/// Sizes and spacings that both differ by this much say enough.
const PLAIN: f64 = 300.0;
/// A known factor is named where the sizes are off it by no more than this.
const NEAR: f64 = 2.2;
/// Points that are looked at.
const LOOKED_AT: usize = 20_000;

/// Clouds of up to so many points are measured as a whole.
const WHOLE: usize = 100_000;
/// Places of larger clouds that are measured, and most points around each.
const PLACES: usize = 24;
const SURROUNDINGS: usize = 5_000;

/// The size of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudSize {
    /// Root mean square distance of its points from their mean; unit of the cloud.
    pub radius: f64,
    /// As [`srrf_cloud::point_spacing`]; of a large cloud, around some of its points.
    pub spacing: f64,
}

impl CloudSize {
    /// Measures a cloud.
    pub fn of(cloud: &PointCloud) -> Self {
        let step = cloud.len().div_ceil(LOOKED_AT);
        let some: Vec<[f64; 3]> = cloud.points().iter().step_by(step).copied().collect();
        let centre: [f64; 3] = std::array::from_fn(|c| some.iter().map(|p| p[c] / some.len() as f64).sum());
        let squared = |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>();
        let radius = (some.iter().map(|p| squared(p) / some.len() as f64).sum::<f64>()).sqrt();
        Self { radius, spacing: spacing(cloud.points(), radius) }
    }
}

/// The spacing of a cloud; of a large one that of the surroundings of some of its points.
fn spacing(points: &[[f64; 3]], radius: f64) -> f64 {
    // Finite points, at least one: there is an answer.
    let measured = |points: &[[f64; 3]]| point_spacing(points).unwrap_or(0.0);
    if points.len() <= WHOLE {
        return measured(points);
    }
    let around = |place: &[f64; 3]| {
        let mut reach = radius / 4.0;
        loop {
            let near = |p: &&[f64; 3]| (0..3).all(|c| (p[c] - place[c]).abs() <= reach);
            let box_of: Vec<[f64; 3]> = points.iter().filter(near).take(SURROUNDINGS + 1).copied().collect();
            if box_of.len() <= SURROUNDINGS || reach < radius * 1e-6 {
                return measured(&box_of);
            }
            reach /= 2.0;
        }
    };
    let places: Vec<&[f64; 3]> = points.iter().step_by(points.len() / PLACES).collect();
    let mut found: Vec<f64> = places.into_par_iter().map(around).filter(|s| *s > 0.0).collect();
    found.sort_unstable_by(f64::total_cmp);
    found.get(found.len() / 2).copied().unwrap_or(0.0)
}

/// A factor between two common units: how many of the smaller one make the larger one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    factor: f64,
    /// The smaller and the larger unit, the likeliest first.
    units: &'static [(&'static str, &'static str)],
}

const KNOWN: &[Known] = &[
    Known { factor: 2.54, units: &[("cm", "in")] },
    Known { factor: 1.0 / 0.3048, units: &[("ft", "m")] },
    Known { factor: 10.0, units: &[("mm", "cm")] },
    Known { factor: 12.0, units: &[("in", "ft")] },
    Known { factor: 25.4, units: &[("mm", "in")] },
    Known { factor: 30.48, units: &[("cm", "ft")] },
    Known { factor: 1.0 / 0.0254, units: &[("in", "m")] },
    Known { factor: 100.0, units: &[("cm", "m")] },
    Known { factor: 304.8, units: &[("mm", "ft")] },
    Known { factor: 1000.0, units: &[("mm", "m"), ("um", "mm"), ("m", "km")] },
    Known { factor: 1e6, units: &[("um", "m"), ("mm", "km")] },
];

/// The factors between common units that are near `ratio`, the nearest first.
pub(super) fn common_factors(ratio: f64) -> Vec<f64> {
    let away = |factor: &f64| (factor / ratio).ln().abs();
    let all = KNOWN.iter().flat_map(|known| [known.factor, 1.0 / known.factor]);
    let mut near: Vec<f64> = all.filter(|factor| away(factor) < NEAR.ln()).collect();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)));
    near
}

/// Two clouds that seem to be in different units. [`fmt::Display`] says what speaks for it, and the switches that mend it.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleDoubt {
    /// Sizes of the source and of the target.
    pub sizes: [CloudSize; 2],
    /// Factors between common units by which the source may have to be multiplied, the nearest first.
    pub factors: Vec<f64>,
    /// Whether the clouds cannot be registered as they are.
    pub certain: bool,
}

impl ScaleDoubt {
    /// Compares the sizes of a source and a target. Clouds of one unit may well differ in size, since they overlap only in part, or in
    /// spacing, since scanners differ: there is no doubt unless both differ in the same direction.
    pub fn between(source: CloudSize, target: CloudSize) -> Option<Self> {
        let (size, spacing) = (target.radius / source.radius, target.spacing / source.spacing);
        let usable = [size, spacing].iter().all(|q| q.is_finite() && *q > 0.0);
        let (up, down) = (size.min(spacing), (1.0 / size).min(1.0 / spacing));
        let least = up.max(down);
        if !usable || least < LEAST {
            return None;
        }
        let larger = up > down;
        let (small, large) = if larger { (source, target) } else { (target, source) };
        let factors = common_factors(size);
        let certain = small.radius < SPECK * large.spacing || least > PLAIN;
        Some(Self { sizes: [source, target], factors, certain })
    }

    /// The smaller of the two factors, of size and of spacing.
    pub(crate) fn least(&self) -> f64 {
        let [source, target] = self.sizes;
        let (size, spacing) = (target.radius / source.radius, target.spacing / source.spacing);
        size.min(spacing).max((1.0 / size).min(1.0 / spacing))
    }

    /// The same doubt, with the factor that was tried and found right first.
    pub(crate) fn found(&self, factor: f64) -> Self {
        let mut found = self.clone();
        found.factors.retain(|f| *f != factor);
        found.factors.insert(0, factor);
        found
    }

    /// The units that are the likeliest for source and target, where their sizes differ by a known factor.
    pub fn units(&self) -> Option<[&'static str; 2]> {
        let factor = *self.factors.first()?;
        let larger = factor > 1.0;
        let same = |known: &&Known| (known.factor.ln() - factor.ln().abs()).abs() < 1e-9;
        let (small, large) = *KNOWN.iter().find(same)?.units.first()?;
        // The cloud in the larger unit has the smaller numbers.
        Some(if larger { [large, small] } else { [small, large] })
    }
}

impl fmt::Display for ScaleDoubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [source, target] = self.sizes;
        let ratio = target.radius / source.radius;
        let (which, other, times, spacings) = if ratio > 1.0 {
            ("target", "source", ratio, target.spacing / source.spacing)
        } else {
            ("source", "target", 1.0 / ratio, source.spacing / target.spacing)
        };
        write!(
            f,
            "the {which} is {} times as large as the {other} (radius {} and {}) and its points are {} times as far apart",
            round(times),
            round(target.radius.max(source.radius)),
            round(target.radius.min(source.radius)),
            round(spacings),
        )?;
        if let (Some([s, t]), Some(factor)) = (self.units(), self.factors.first()) {
            let factor = if *factor > 1.0 { *factor } else { 1.0 / factor };
            write!(
                f,
                ", which is near {}, the factor between {s} and {t}: say --source-unit {s} --target-unit {t}, or the units that \
                 they are in",
                round(factor)
            )?;
        } else {
            write!(f, ": say their units with --source-unit and --target-unit")?;
        }
        write!(f, "; --scale auto estimates the factor, --scale 1 takes them as they are")
    }
}

/// 4 significant digits at most, with commas.
fn round(value: f64) -> String {
    if !(1e-4..1e9).contains(&value) {
        return format!("{value:.1e}");
    }
    let decimals = (2 - value.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    match text.split_once('.') {
        None if text.len() > 3 => {
            let (front, back) = text.split_at(text.len() - 3);
            if front.len() > 3 {
                let (first, second) = front.split_at(front.len() - 3);
                format!("{first},{second},{back}")
            } else {
                format!("{front},{back}")
            }
        }
        _ => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(radius: f64, spacing: f64) -> CloudSize {
        CloudSize { radius, spacing }
    }

    #[test]
    fn millimetres_against_metres_are_named() {
        let doubt = ScaleDoubt::between(size(0.133, 0.001), size(135.0, 1.1)).unwrap();
        assert!(doubt.certain);
        assert_eq!((doubt.factors[0], doubt.units()), (1000.0, Some(["m", "mm"])));
        let words = doubt.to_string();
        for part in [
            "the target is 1,015 times as large",
            "near 1,000",
            "--source-unit m --target-unit mm",
            "--scale auto",
        ] {
            assert!(words.contains(part), "{words}");
        }
        let back = ScaleDoubt::between(size(135.0, 1.1), size(0.133, 0.001)).unwrap();
        assert!((back.factors[0] - 0.001).abs() < 1e-15 && back.units() == Some(["mm", "m"]));
    }

    #[test]
    fn each_known_factor_is_the_nearest_to_itself() {
        for known in KNOWN {
            let f = known.factor;
            let doubt = ScaleDoubt::between(size(1.0, 0.01), size(f, 0.01 * f)).unwrap();
            assert_eq!(doubt.factors[0], f);
            assert_eq!(doubt.units(), Some([known.units[0].1, known.units[0].0]));
        }
        let odd = ScaleDoubt::between(size(1.0, 0.01), size(3e4, 200.0)).unwrap();
        assert!(odd.factors.is_empty() && odd.certain);
        assert!(odd.to_string().contains("30,000 times as large"), "{odd}");
    }

    #[test]
    fn no_wolf_where_there_is_none() {
        for (source, target) in [
            (size(1.0, 0.01), size(1.5, 0.05)),   // two scanners
            (size(1.0, 0.01), size(30.0, 0.012)), // a part in its scene, one scanner
            (size(1.0, 0.01), size(12.0, 0.015)), // the same, farther away
            (size(50.0, 0.01), size(10.0, 0.2)),  // a large fine scan, a small coarse one
            (size(1.0, 0.0), size(9.0, 0.2)),     // no spacing
            (size(1.0, f64::NAN), size(9.0, 0.2)),
        ] {
            assert_eq!(ScaleDoubt::between(source, target), None, "{source:?} {target:?}");
        }
        // A fine scan of a small part, a coarse one of its hall: worth a try, but not certain.
        let hall = ScaleDoubt::between(size(0.5, 0.001), size(9.0, 0.02)).unwrap();
        assert!(!hall.certain && hall.factors.contains(&25.4), "{hall:?}");
    }

    #[test]
    fn sizes_are_measured() {
        let points = (0..400).map(|i| [5e5 + f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
        let size = CloudSize::of(&PointCloud::new(points).unwrap());
        assert!(
            (size.radius - (2.0 * 33.25f64).sqrt()).abs() < 1e-6 && (size.spacing - 1.0).abs() < 1e-9,
            "{size:?}"
        );
    }

    #[test]
    fn the_spacing_of_a_large_cloud_is_that_of_its_points() {
        let points = (0..160_000).map(|i| [f64::from(i % 400), f64::from(i / 400), 3.0]).collect();
        let size = CloudSize::of(&PointCloud::new(points).unwrap());
        assert!((size.spacing - 1.0).abs() < 1e-9, "{size:?}");
    }
}
