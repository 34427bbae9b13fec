//! Small files of every format and flavour, made by hand from given points. Shared by the tests of
//! round trips and of broken files, and by the fuzzers in `fuzz/`.

#![allow(dead_code, reason = "each test uses its part")]

mod binary;
mod newer;
mod text;

/// A file, what it holds, and where its body begins.
#[derive(Clone)]
pub struct Sample {
    pub format: &'static str,
    pub name: String,
    pub bytes: Vec<u8>,
    pub points: Vec<[f64; 3]>,
    pub header: usize,
    /// Whether line ends may be `\r\n` everywhere.
    pub text: bool,
}

impl Sample {
    fn new(
        format: &'static str,
        name: impl Into<String>,
        header: &[u8],
        body: &[u8],
        points: &[[f64; 3]],
    ) -> Self {
        let text = header.iter().chain(body).all(|b| b.is_ascii() && (*b >= b' ' || b"\n\r\t".contains(b)));
        let bytes = [header, body].concat();
        Self { format, name: name.into(), bytes, points: points.to_vec(), header: header.len(), text }
    }
}

/// `points` rounded to single precision.
pub fn single(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    points.iter().map(|p| p.map(|c| f64::from(c as f32))).collect()
}

/// All flavours of the built-in formats.
pub fn samples(points: &[[f64; 3]]) -> Vec<Sample> {
    let mut all = text::samples(points);
    all.extend(binary::samples(points));
    all.extend(newer::samples(points));
    all
}

/// Numbers that lose something when handled carelessly.
pub fn odd_values() -> Vec<f64> {
    vec![
        0.0,
        -0.0,
        5e-324,
        -2.2e-308,
        f64::MIN_POSITIVE,
        1e-40,
        -1e-5,
        9.999_999e-6,
        0.1,
        1.0 / 3.0,
        431_234.567_891_234,
        -4_812_345.678_912_3,
        1e15 + 0.5,
        9_007_199_254_740_993.0,
        1e16,
        1e22,
        -3.4e38,
        1e300,
        -1.797_693_134_862_315_7e308,
    ]
}
