//! Which layout bare numbers have, by what they are.

use super::super::{FormatError, PointLayout};

/// Sizes of coordinates that are not 0.
const USUAL: std::ops::Range<f64> = 1e-7..1e8;
/// Share of the numbers that may lie outside.
const STRANGE: f64 = 0.01;
/// Share of the words of a file of `float32` that are plausible as such.
const WORDS: f64 = 0.97;
/// How improbable (as a natural logarithm) it has to be that a column of any of the file's numbers obeys its rule,
/// for the rule to count as proof.
const PROOF: f64 = 20.0;
/// Fewest rows of a kind that are told from the others.
const FEWEST: usize = 16;
/// Largest intensity and ring.
const INTENSITY: f64 = 65_535.0;
const RING: f64 = 1024.0;

/// The usual layouts of `float32`, and of `float64`.
const SINGLES: [usize; 4] = [3, 4, 5, 6];
const DOUBLES: [usize; 3] = [3, 4, 6];

/// The one layout that fits.
///
/// # Errors
/// [`FormatError::Unclear`] where none or several fit; [`FormatError::Content`] where the size fits none.
pub(super) fn find(bytes: &[u8]) -> Result<PointLayout, FormatError> {
    let candidates = |double: bool, numbers: &[usize]| {
        let layouts = numbers.iter().map(|&numbers| PointLayout { numbers, double });
        layouts.filter(|layout| bytes.len().is_multiple_of(layout.bytes())).collect::<Vec<_>>()
    };
    let mut layouts = candidates(false, &SINGLES);
    layouts.extend(candidates(true, &DOUBLES));
    if layouts.is_empty() {
        return Err(FormatError::Content(format!(
            "{} bytes are no whole number of records of 16 bytes (x, y, z, intensity as 32-bit floats), nor of another usual \
             size; the file is cut short or holds no points",
            bytes.len()
        )));
    }
    let double = !are_singles(bytes);
    let fits: Vec<(PointLayout, f64)> = layouts
        .into_iter()
        .filter(|layout| layout.double == double)
        .filter_map(|layout| Some((layout, PlausibleRows::new(bytes, layout).evidence()?)))
        .collect();
    let proven: Vec<PointLayout> =
        fits.iter().filter(|(_, evidence)| *evidence >= PROOF).map(|(layout, _)| *layout).collect();
    match (&fits[..], &proven[..]) {
        ([(layout, _)], _) | (_, [layout]) => match PlausibleRows::new(bytes, *layout).alternates() {
            None => Ok(*layout),
            Some(times) => {
                let wider = PointLayout { numbers: times * layout.numbers, ..*layout };
                Err(FormatError::unclear(
                    format!(
                        "of {times} points of {layout} one is of another kind than the others: points of {wider}?"
                    ),
                    "--layout",
                ))
            }
        },
        ([], _) => Err(FormatError::unclear(
            "the numbers are no points in any usual layout (coordinates from 1e-7 to 1e8, intensities from 0): is this a file \
             of points? If so, what a point is has to be said, such as `4xf32`",
            "--layout",
        )),
        _ => {
            let names: Vec<String> = fits
                .iter()
                .map(|(layout, _)| format!("{layout} ({} points)", bytes.len() / layout.bytes()))
                .collect();
            Err(FormatError::unclear(
                format!("the numbers fit several layouts: {}", names.join(", ")),
                "--layout",
            ))
        }
    }
}

fn usual(value: f64) -> bool {
    value.is_nan() || value == 0.0 || USUAL.contains(&value.abs())
}

/// Whether the words are `float32`: halves of `float64` look like none.
fn are_singles(bytes: &[u8]) -> bool {
    let words = bytes.as_chunks::<4>().0;
    let zero = words.iter().step_by(2).filter(|word| **word == [0; 4]).count();
    // Short decimals as float64 have 0 in every other word.
    if words.len() >= 6 && zero * 10 >= words.len().div_ceil(2) * 9 {
        return false;
    }
    let fine = words.iter().filter(|word| usual(f32::from_le_bytes(**word).into())).count();
    fine as f64 >= WORDS * words.len() as f64
}

/// The numbers of a file in rows.
struct PlausibleRows<'a> {
    bytes: &'a [u8],
    layout: PointLayout,
}

impl<'a> PlausibleRows<'a> {
    fn new(bytes: &'a [u8], layout: PointLayout) -> Self {
        Self { bytes, layout }
    }

    fn value(&self, at: usize) -> f64 {
        match self.layout.double {
            true => self.bytes.as_chunks::<8>().0.get(at).map_or(f64::NAN, |word| f64::from_le_bytes(*word)),
            false => self
                .bytes
                .as_chunks::<4>()
                .0
                .get(at)
                .map_or(f64::NAN, |word| f32::from_le_bytes(*word).into()),
        }
    }

    fn rows(&self) -> usize {
        self.bytes.len() / self.layout.bytes()
    }

    fn column(&self, column: usize) -> impl Iterator<Item = f64> + '_ {
        (0..self.rows()).map(move |row| self.value(row * self.layout.numbers + column))
    }

    /// Share of all numbers that obey a rule.
    fn share(&self, rule: impl Fn(f64) -> bool) -> f64 {
        let all = self.rows() * self.layout.numbers;
        (0..all).filter(|&at| rule(self.value(at))).count() as f64 / all as f64
    }

    /// How much speaks for this layout; `None` where something speaks against it.
    fn evidence(&self) -> Option<f64> {
        let strange = (0..3).flat_map(|axis| self.column(axis)).filter(|&value| !usual(value)).count();
        let nothing = (0..3).all(|axis| self.column(axis).all(f64::is_nan));
        if nothing || strange as f64 > STRANGE * (3 * self.rows()) as f64 {
            return None;
        }
        match self.layout.numbers {
            4 => self.not_negative(3, INTENSITY),
            5 => {
                let ring = self.whole(4, RING).or_else(|| self.not_negative(4, RING))?;
                Some(self.not_negative(3, INTENSITY)? + ring)
            }
            6 => self.normals().or_else(|| {
                let colour = |c| self.whole(c, INTENSITY).or_else(|| self.not_negative(c, 1.0));
                Some(colour(3)? + colour(4)? + colour(5)?)
            }),
            _ => Some(0.0),
        }
    }

    /// Whether only every second or third row has coordinates like the others, so that a point has that many times more
    /// numbers: by how many.
    fn alternates(&self) -> Option<usize> {
        [2, 3].into_iter().find(|&times| {
            let rows = self.rows();
            rows.is_multiple_of(times)
                && rows >= FEWEST * times
                && times * self.layout.numbers <= PointLayout::MOST
                && (0..3).any(|column| {
                    let share = |rule: fn(f64) -> bool, kind: usize| {
                        let obey = self.column(column).skip(kind).step_by(times).filter(|&v| rule(v)).count();
                        obey as f64 / (rows / times) as f64
                    };
                    let whole: Vec<f64> = (0..times).map(|kind| share(|v| v.fract() == 0.0, kind)).collect();
                    let something = (0..times).all(|kind| share(|v| v != 0.0, kind) > 0.5);
                    something && whole.contains(&1.0) && whole.iter().any(|&share| share < 0.5)
                })
        })
    }

    /// A column from 0 to its own largest number, at most `most`.
    fn not_negative(&self, column: usize, most: f64) -> Option<f64> {
        let top = self.column(column).fold(0.0, f64::max);
        let rule = |value: f64| (0.0..=top).contains(&value);
        (top <= most && self.column(column).all(rule)).then(|| self.surprise(rule))
    }

    /// A column of whole numbers from 0 to `most`.
    fn whole(&self, column: usize, most: f64) -> Option<f64> {
        let rule = |value: f64| value.fract() == 0.0 && (0.0..=most).contains(&value);
        self.column(column).all(rule).then(|| self.surprise(rule))
    }

    /// How improbable it is that as many numbers as rows, of any in the file, obey a rule.
    fn surprise(&self, rule: impl Fn(f64) -> bool) -> f64 {
        -self.share(rule).ln() * self.rows() as f64
    }

    /// The last three columns are directions.
    fn normals(&self) -> Option<f64> {
        let unit = |row: usize| {
            let length = (3..6).map(|c| self.value(row * 6 + c)).fold(0.0, f64::hypot);
            length == 0.0 || (length - 1.0).abs() < 1e-3
        };
        // Of numbers of any kind, not one in a thousand.
        ((0..self.rows()).all(unit)).then(|| 6.0 * self.rows() as f64)
    }
}

#[cfg(test)]
mod tests {

    /// Numbers from -2 to 2 in a fixed order.
    fn cloud(n: usize) -> Vec<[f64; 3]> {
        let number = |i: usize| ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(4.0) - 2.0;
        (0..n).map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)]).collect()
    }

    fn singles(n: usize, more: impl Fn(usize) -> Vec<f64>) -> Vec<u8> {
        let rows = cloud(n).into_iter().enumerate().flat_map(|(i, p)| [p.to_vec(), more(i)].concat());
        rows.flat_map(|v| (v as f32).to_le_bytes()).collect()
    }

    fn doubles(n: usize, more: impl Fn(usize) -> Vec<f64>) -> Vec<u8> {
        let rows = cloud(n).into_iter().enumerate().flat_map(|(i, p)| [p.to_vec(), more(i)].concat());
        rows.flat_map(f64::to_le_bytes).collect()
    }

    fn intensity(i: usize) -> f64 {
        (i as f64 * 0.37).rem_euclid(1.0)
    }

    #[test]
    fn usual_layouts_are_found() {
        let find = |bytes: &[u8]| super::find(bytes).unwrap().to_string();
        for n in [40, 41, 60, 240] {
            assert_eq!(find(&singles(n, |_| vec![])), "3xf32", "{n}");
            assert_eq!(find(&singles(n, |i| vec![intensity(i)])), "4xf32", "{n}");
            assert_eq!(find(&singles(n, |i| vec![(i * 7 % 256) as f64])), "4xf32", "{n}");
            assert_eq!(find(&singles(n, |i| vec![(i * 7 % 256) as f64, (i % 32) as f64])), "5xf32", "{n}");
            assert_eq!(find(&singles(n, |i| vec![intensity(i), 0.05])), "5xf32", "{n}");
            let normal = |i: usize| vec![0.6 * (i as f64).cos(), 0.6 * (i as f64).sin(), -0.8];
            assert_eq!(find(&singles(n, normal)), "6xf32", "{n}");
            assert_eq!(find(&singles(n, |i| vec![(i % 256) as f64, 9.0, 255.0])), "6xf32", "{n}");
            assert_eq!(find(&doubles(n, |_| vec![])), "3xf64", "{n}");
            assert_eq!(find(&doubles(n, |i| vec![intensity(i)])), "4xf64", "{n}");
            assert_eq!(find(&doubles(n, normal)), "6xf64", "{n}");
        }
    }

    #[test]
    fn wider_points_are_asked_for() {
        let wide =
            singles(40, |i| vec![intensity(i), (i % 31 + 1) as f64, (i * 7 % 255 + 1) as f64, 0.5, 3.0]);
        let error = super::find(&wide).unwrap_err().to_string();
        assert!(error.contains("points of 8xf32?") && error.ends_with("`--layout`"), "{error}");
    }

    #[test]
    fn what_is_not_clear_is_asked() {
        let positive: Vec<u8> =
            cloud(40).into_iter().flatten().flat_map(|v| (v.abs() as f32 + 0.1).to_le_bytes()).collect();
        let error = super::find(&positive).unwrap_err().to_string();
        assert!(error.contains("3xf32 (40 points)") && error.contains("4xf32 (30 points)"), "{error}");
        assert!(error.ends_with("`--layout`"), "{error}");
        let random: Vec<u8> = (0..960u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        let error = super::find(&random).unwrap_err().to_string();
        assert!(error.contains("no points in any usual layout") && error.ends_with("`--layout`"), "{error}");
        let extreme: Vec<u8> =
            (0..160).flat_map(|i| (if i % 2 == 0 { 1e38f32 } else { 1e-42 }).to_le_bytes()).collect();
        assert!(super::find(&extreme).unwrap_err().to_string().contains("no points"));
        assert!(super::find(&[0; 15]).unwrap_err().to_string().contains("records of 16 bytes"));
    }
}
