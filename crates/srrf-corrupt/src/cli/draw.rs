//! The contact sheet: every corruption at every severity, the paper's figures 2 to 4 in one.

use embedded_graphics::mono_font::ascii::{FONT_7X13, FONT_9X15_BOLD, FONT_10X20};
use rand::{SeedableRng, rngs::ChaCha8Rng};
use srrf_args::flags::Axis;
use srrf_cloud::PointCloud;

use super::canvas::{Canvas, Colour, Window};
use crate::card::Family;
use crate::corruption::{CorruptError, Corrupted};
use crate::corruptions::CorruptionKind;
use crate::kind::corruption;
use crate::severity::Severity;
use crate::variants::Variants;

const TILE: [i32; 2] = [208, 176];
const LABELS: i32 = 214;
const HEADER: i32 = 84;
const GROUP: i32 = 30;
const FOOTER: i32 = 40;

/// Share of a tile that the clean cloud fills; corrupted points may leave it.
const FILL: f64 = 0.80;

const PAPER: Colour = [255, 255, 255];
const INK: Colour = [28, 32, 40];
const GREY: Colour = [120, 126, 136];
const RULE: Colour = [226, 229, 234];
/// Near and far colours of points that were there before, of points that were added or displaced,
/// and the colour of points that are gone.
const OLD: [Colour; 2] = [[16, 42, 92], [168, 190, 220]];
const NEW: [Colour; 2] = [[208, 68, 16], [250, 186, 140]];
const GONE: Colour = [238, 150, 150];

/// What a sheet shows.
pub struct ContactSheet<'a> {
    /// The clean cloud, canonical frame.
    pub cloud: &'a PointCloud,
    /// What the cloud is, for the title.
    pub title: String,
    /// Readings of the corruptions.
    pub variants: Variants,
    /// Seed of the draws.
    pub seed: u64,
    /// Upward axis.
    pub up: Axis,
    /// Where the eye is, in degrees around the upward axis.
    pub yaw_deg: f64,
}

/// How view coordinates become pixels and shades.
struct Frame {
    /// Middle of the clean cloud.
    centre: [f64; 3],
    /// Pixels for a canonical unit.
    scale: f64,
    /// Extent of the clean cloud along the line of sight.
    depth: f64,
}

impl ContactSheet<'_> {
    /// Draws the sheet.
    ///
    /// # Errors
    /// [`CorruptError`] if the cloud cannot be corrupted.
    pub fn draw(&self) -> Result<Canvas, CorruptError> {
        let rows = GROUP * Family::ALL.len() as i32 + TILE[1] * CorruptionKind::ALL.len() as i32;
        let width = LABELS + 6 * TILE[0] + 12;
        let mut canvas = Canvas::new(width as u32, (HEADER + rows + FOOTER) as u32, PAPER);
        canvas.text(&self.title, [16, 14], &FONT_10X20, INK);
        for column in 0..6 {
            let heading = if column == 0 { "clean".into() } else { format!("severity {column}") };
            let x = LABELS + column * TILE[0] + (TILE[0] - 9 * heading.len() as i32) / 2;
            canvas.text(&heading, [x, HEADER - 26], &FONT_9X15_BOLD, INK);
        }
        let frame = self.frame();
        let mut y = HEADER;
        for family in Family::ALL {
            canvas.fill(Window { x: 12, y: y + 4, width: width - 24, height: 1 }, RULE);
            canvas.text(family.name(), [16, y + 12], &FONT_7X13, GREY);
            y += GROUP;
            for kind in CorruptionKind::of_family(family) {
                self.row(&mut canvas, &frame, kind, y)?;
                y += TILE[1];
            }
        }
        self.legend(&mut canvas, y + 12);
        Ok(canvas)
    }

    fn row(
        &self,
        canvas: &mut Canvas,
        frame: &Frame,
        kind: CorruptionKind,
        y: i32,
    ) -> Result<(), CorruptError> {
        canvas.text(kind.name(), [16, y + TILE[1] / 2 - 10], &FONT_10X20, INK);
        let clean = Corrupted::moved(self.cloud.points().to_vec());
        self.tile(canvas, frame, &clean, [LABELS, y]);
        for severity in Severity::ALL {
            // One stream for each row: from left to right the same draws grow.
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(kind as u64);
            let corrupted =
                corruption(kind, &self.variants).apply(self.cloud.points(), severity, &mut rng)?;
            let x = LABELS + i32::from(severity.get()) * TILE[0];
            self.tile(canvas, frame, &corrupted, [x, y]);
            if corrupted.points.len() != self.cloud.len() {
                let count = corrupted.points.len().to_string();
                canvas.text(
                    &count,
                    [x + TILE[0] - 12 - 7 * count.len() as i32, y + TILE[1] - 20],
                    &FONT_7X13,
                    GREY,
                );
            }
        }
        Ok(())
    }

    fn tile(&self, canvas: &mut Canvas, frame: &Frame, cloud: &Corrupted, [x, y]: [i32; 2]) {
        let window = Window { x, y, width: TILE[0], height: TILE[1] };
        let base = self.cloud.points();
        let moved = |p: &[f64; 3], origin: Option<u32>| origin.is_none_or(|o| *p != base[o as usize]);
        let marks: Vec<bool> = cloud.points.iter().zip(&cloud.origin).map(|(p, o)| moved(p, *o)).collect();
        // Where a corruption moves everything, marks would say nothing.
        let telling =
            cloud.origin.iter().zip(&marks).filter(|(o, m)| o.is_some() && **m).count() * 2 < base.len();
        let mut left = vec![false; base.len()];
        cloud.origin.iter().flatten().for_each(|o| left[*o as usize] = true);
        let gone = base.iter().zip(&left).filter(|(_, left)| !**left).map(|(p, _)| (self.view(p), None));
        let mut points: Vec<([f64; 3], Option<bool>)> = cloud
            .points
            .iter()
            .zip(&marks)
            .map(|(p, m)| (self.view(p), Some(*m && telling)))
            .chain(gone)
            .collect();
        points.sort_by(|a, b| a.0[2].total_cmp(&b.0[2]));
        let middle = [f64::from(x) + f64::from(TILE[0]) / 2.0, f64::from(y) + f64::from(TILE[1]) / 2.0];
        for ([right, up, near], mark) in points {
            let [cx, cy, cz] = frame.centre;
            let at = [middle[0] + frame.scale * (right - cx), middle[1] - frame.scale * (up - cy)];
            let depth = (0.5 - (near - cz) / frame.depth).clamp(0.0, 1.0);
            let radius = 1.8 - 0.6 * depth;
            match mark {
                None => canvas.disc(window, at, 0.9, GONE),
                Some(false) => canvas.disc(window, at, radius, mix(OLD, depth)),
                Some(true) => canvas.disc(window, at, radius, mix(NEW, depth)),
            }
        }
    }

    /// Where the clean cloud lies in the view.
    fn frame(&self) -> Frame {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in self.cloud.points().iter().map(|p| self.view(p)) {
            for c in 0..3 {
                low[c] = low[c].min(p[c]);
                high[c] = high[c].max(p[c]);
            }
        }
        let size = |c: usize| (high[c] - low[c]).max(1e-9);
        let scale = |c: usize| FILL * f64::from(TILE[c]) / size(c);
        Frame {
            centre: std::array::from_fn(|c| 0.5 * (low[c] + high[c])),
            scale: scale(0).min(scale(1)),
            depth: size(2),
        }
    }

    /// Right, up and towards the eye, seen from 25 degrees above.
    fn view(&self, p: &[f64; 3]) -> [f64; 3] {
        let [x, y, z] = match self.up {
            Axis::Y => [p[2], p[0], p[1]],
            Axis::Z => *p,
        };
        let (sin_yaw, cos_yaw) = self.yaw_deg.to_radians().sin_cos();
        let (sin_pitch, cos_pitch) = 25f64.to_radians().sin_cos();
        let (right, front) = (cos_yaw * y - sin_yaw * x, cos_yaw * x + sin_yaw * y);
        [right, cos_pitch * z - sin_pitch * front, sin_pitch * z + cos_pitch * front]
    }

    fn legend(&self, canvas: &mut Canvas, y: i32) {
        let mut x = LABELS + 8;
        let everywhere = Window { x: 0, y: 0, width: i32::MAX, height: i32::MAX };
        for (colour, text) in
            [(OLD[0], "points (dark: near, light: far)"), (NEW[0], "added or displaced"), (GONE, "missing")]
        {
            canvas.disc(everywhere, [f64::from(x), f64::from(y + 7)], 4.0, colour);
            canvas.text(text, [x + 12, y], &FONT_7X13, INK);
            x += 12 + 7 * text.len() as i32 + 28;
        }
        canvas.text("number: points, where it changes", [x, y], &FONT_7X13, GREY);
    }
}

fn mix([near, far]: [Colour; 2], depth: f64) -> Colour {
    std::array::from_fn(|c| {
        (f64::from(near[c]) + depth * (f64::from(far[c]) - f64::from(near[c]))).round() as u8
    })
}
