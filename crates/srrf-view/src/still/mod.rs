//! A pair as one picture, without a browser.

mod camera;
mod raster;

use embedded_graphics::mono_font::MonoFont;
use embedded_graphics::mono_font::iso_8859_1::{FONT_9X15, FONT_9X15_BOLD};
use srrf_cloud::PointCloud;

use crate::number::{Tone, count, significant, with_unit};
use crate::residual::{Distances, Residuals};
use crate::sample::even_indices;
use crate::{Pair, Pose, Up};
use camera::Camera;
use raster::{Raster, Rgb};

/// Points of one cloud that are drawn.
const DRAWN: usize = 200_000;
/// Size of one view.
const VIEW: [usize; 2] = [600, 480];
/// Height of the lines above and below the views.
const LINE: usize = 22;
/// Lines of figures below the views.
const FIGURES: usize = 3;
/// Points farther out than this many radii of nearly all are strays, which do not count for the view.
const STRAY: f64 = 3.0;

const BACKGROUND: Rgb = [0xf5, 0xf6, 0xf8];
const PAPER: Rgb = [255; 3];
const INK: Rgb = [0x1b, 0x1f, 0x24];
const SOURCE: Rgb = [0xd5, 0x5e, 0x00];
const TARGET: Rgb = [0x00, 0x72, 0xb2];
const NEUTRAL: Rgb = [0xbc, 0xc2, 0xca];
/// Viridis (van der Walt and Smith), the small distances first: bright, so that they fade.
const RAMP: [Rgb; 8] = [
    [0xdd, 0xe3, 0x18],
    [0x7a, 0xd1, 0x51],
    [0x35, 0xb7, 0x79],
    [0x1f, 0x9e, 0x89],
    [0x26, 0x82, 0x8e],
    [0x31, 0x68, 0x8e],
    [0x3e, 0x49, 0x89],
    [0x44, 0x01, 0x54],
];

/// The pair as a PNG picture: before, after its first pose, and the distance of each source point to the target. A pair without
/// poses is one view.
///
/// # Errors
/// The encoder's.
pub fn to_png(pair: &Pair<'_>) -> Result<Vec<u8>, png::EncodingError> {
    let views = views(pair);
    let (width, height) = (VIEW[0] * views.len(), VIEW[1] + LINE * (1 + FIGURES) + 10);
    let mut page = Raster::new(width, height, PAPER);
    for (i, view) in views.iter().enumerate() {
        let x = i * VIEW[0];
        view.draw().halve_into(&mut page, [x, LINE]);
        text(&mut page, &view.title, [x + 8, 4], VIEW[0] - 16, &FONT_9X15_BOLD, INK);
        if let Some(scale) = &view.scale {
            let (left, top) = (x + 12, LINE + VIEW[1] - 34);
            for step in 0..200 {
                page.fill(left + step, top, 1, 10, ramp(step as f64 / 199.0));
            }
            text(&mut page, scale, [left, top + 12], VIEW[0] - 24, &FONT_9X15, INK);
        }
    }
    let top = LINE + VIEW[1] + 6;
    for (i, (line, colour)) in figures(pair).iter().take(FIGURES).enumerate() {
        text(&mut page, line, [8, top + i * LINE], width - 16, &FONT_9X15, *colour);
    }
    page.to_png()
}

/// Text that is cut at a width, with three dots.
fn text(page: &mut Raster, line: &str, at: [usize; 2], width: usize, font: &MonoFont<'_>, colour: Rgb) {
    let most = width / font.character_size.width as usize;
    let plain: String = line.chars().map(|c| if c == '≥' { '>' } else { c }).collect();
    let cut = if plain.chars().count() > most {
        plain.chars().take(most.saturating_sub(3)).chain("...".chars()).collect()
    } else {
        plain
    };
    page.text(&cut, at, font, colour);
}

/// Lines below the views, with their colours.
fn figures(pair: &Pair<'_>) -> Vec<(String, Rgb)> {
    let mut lines = vec![(
        format!(
            "{}: source {} points (orange), target {} points (blue)",
            pair.name,
            count(pair.source.len()),
            count(pair.target.len())
        ),
        INK,
    )];
    if let Some(first) = pair.numbers.first() {
        let colour = match first.tone {
            Some(Tone::Good) => [0x0a, 0x6b, 0x47],
            Some(Tone::Bad) => [0xb3, 0x26, 0x1e],
            None => INK,
        };
        let words = format!("{}: {}", first.label, first.written());
        let help = if first.help.is_empty() { String::new() } else { format!(" - {}", first.help) };
        lines.push((words + &help, colour));
    }
    let rest: Vec<String> =
        pair.numbers.iter().skip(1).map(|n| format!("{}: {}", n.label, n.written())).collect();
    if !rest.is_empty() {
        lines.push((rest.join("; "), INK));
    }
    lines
}

/// One view: points with their colours.
struct Panel {
    title: String,
    camera: Camera,
    points: Vec<([f64; 3], Rgb)>,
    scale: Option<String>,
}

impl Panel {
    /// Twice as large as it will be.
    fn draw(&self) -> Raster {
        let mut raster = Raster::new(2 * VIEW[0], 2 * VIEW[1], BACKGROUND);
        let radius = (260.0 / (self.points.len().max(1) as f64).sqrt()).clamp(1.2, 7.0);
        for (point, colour) in &self.points {
            let Some((at, depth, back)) = self.camera.project(point) else { continue };
            let haze = 0.45 * back;
            let mixed = std::array::from_fn(|c| {
                (f64::from(colour[c]) * (1.0 - haze) + f64::from(BACKGROUND[c]) * haze).round() as u8
            });
            raster.disc(at, radius, depth, mixed);
        }
        raster
    }
}

fn views(pair: &Pair<'_>) -> Vec<Panel> {
    let up = pair.up.unwrap_or_else(|| Up::guess(pair.target));
    let (source, target) = (drawn(pair.source), drawn(pair.target));
    let finite = |pose: &&Pose| {
        let pose = &pose.target_from_source;
        pose.rotation.iter().chain(pose.translation.iter()).all(|v| v.is_finite())
    };
    let before = Some(&pair.before).filter(finite);
    let after = pair.poses.first().filter(finite);
    let moved = |pose: Option<&Pose>| -> Vec<[f64; 3]> {
        source.iter().map(|p| pose.map_or(*p, |pose| pose.target_from_source.apply(p))).collect()
    };
    let view = |title: String, source: Vec<[f64; 3]>| {
        let all: Vec<[f64; 3]> = near(&target).chain(near(&source)).collect();
        let camera = Camera::around(&all, up, [2 * VIEW[0], 2 * VIEW[1]]);
        let points = source.into_iter().map(|p| (p, SOURCE)).chain(target.iter().map(|p| (*p, TARGET)));
        Panel { title, camera, points: points.collect(), scale: None }
    };
    let mut views = vec![view(format!("before: {}", pair.before.name), moved(before))];
    if let Some(after) = after {
        let placed = moved(Some(after));
        views.push(view(format!("after: {}", after.name), placed.clone()));
        views.extend(distances(pair, &source, &target, placed, views[1].camera, after));
    }
    views
}

/// The view of the distances to the target.
fn distances(
    pair: &Pair<'_>,
    source: &[[f64; 3]],
    target: &[[f64; 3]],
    placed: Vec<[f64; 3]>,
    camera: Camera,
    after: &Pose,
) -> Option<Panel> {
    let distances = Distances::new(pair.target).ok()?;
    let found = Residuals::new(&distances, source, &after.target_from_source);
    let before = Residuals::new(&distances, source, &pair.before.target_from_source);
    let high = found.values.iter().copied().fold(0.0, f64::max);
    // Between the pose and the start, so that good and bad poses differ, but near the pose.
    let best = found.summary.p90;
    let middle = (best * before.summary.p90).sqrt();
    let most = high.min((2.0 * best).max(middle.min(10.0 * best))).max(f64::MIN_POSITIVE);
    let length = |value: f64| with_unit(&significant(value), &pair.unit);
    let coloured = placed.into_iter().zip(&found.values).map(|(p, d)| (p, ramp(d / most)));
    Some(Panel {
        title: "distance of the source's points to the target".into(),
        camera,
        points: coloured.chain(target.iter().map(|p| (*p, NEUTRAL))).collect(),
        scale: Some(format!(
            "0 to {}; median {}, 90 % within {}",
            length(most),
            length(found.summary.median),
            length(best)
        )),
    })
}

/// The colour of a share of the largest distance.
fn ramp(share: f64) -> Rgb {
    let at = (share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64).min(RAMP.len() as f64 - 1.001);
    let (low, part) = (at as usize, at.fract());
    std::array::from_fn(|c| {
        let [a, b] = [RAMP[low][c], RAMP[low + 1][c]].map(f64::from);
        (a + (b - a) * part).round() as u8
    })
}

fn drawn(cloud: &PointCloud) -> Vec<[f64; 3]> {
    even_indices(cloud.len(), DRAWN).into_iter().map(|i| cloud.points()[i]).collect()
}

/// The points without strays, by which the camera is placed.
fn near(points: &[[f64; 3]]) -> impl Iterator<Item = [f64; 3]> {
    let middle = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
        at(0.02) / 2.0 + at(0.98) / 2.0
    };
    let centre: [f64; 3] = std::array::from_fn(middle);
    let from = move |p: &[f64; 3]| (0..3).map(|c| (p[c] - centre[c]).powi(2)).sum::<f64>().sqrt();
    let mut away: Vec<f64> = points.iter().map(from).collect();
    away.sort_unstable_by(f64::total_cmp);
    let reach = STRAY * away[((away.len() - 1) as f64 * 0.98) as usize];
    points.iter().copied().filter(move |p| from(p) <= reach)
}

#[cfg(test)]
mod tests {
    use srrf_cloud::Rigid;

    use super::*;
    use crate::Number;

    fn decoded(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        (reader.info().width, reader.info().height, pixels)
    }

    fn pixels_where(pixels: &[u8], is: fn([i32; 3]) -> bool) -> usize {
        pixels.chunks(3).filter(|p| is([p[0], p[1], p[2]].map(i32::from))).count()
    }

    fn orange([r, g, b]: [i32; 3]) -> bool {
        r > g + 50 && g > b + 20
    }

    fn blue([r, _, b]: [i32; 3]) -> bool {
        b > r + 50
    }

    fn yellow([r, g, b]: [i32; 3]) -> bool {
        r > b + 60 && g > b + 60 && g > 150
    }

    fn cloud(shift: f64) -> PointCloud {
        let grid = (0..900)
            .map(|i| [f64::from(i % 30), f64::from(i / 30), 0.02 * f64::from(i % 30).powi(2) + shift]);
        PointCloud::new(grid.collect()).unwrap()
    }

    #[test]
    fn three_views_of_an_answer_and_one_without() {
        let (source, target) = (cloud(0.0), cloud(40.0));
        let bare = to_png(&Pair::new("a to b", &source, &target)).unwrap();
        assert_eq!(decoded(&bare).0, 600);
        let pose = Rigid { translation: [0.0, 0.0, 40.0].into(), ..Rigid::identity() };
        let pair = Pair::new("a to b", &source, &target)
            .pose(Pose::new("result", pose))
            .number(Number::text("Verdict", "probably right (97 %)").tone(Tone::Good).help("≥ 5 degrees"));
        let bytes = to_png(&pair).unwrap();
        let (width, height, pixels) = decoded(&bytes);
        assert_eq!((width, height), (1800, 578));
        assert_eq!(bytes, to_png(&pair).unwrap());
        let part = |view: usize| -> Vec<u8> {
            pixels
                .chunks(3 * 1800)
                .flat_map(|row| &row[3 * 600 * view..3 * 600 * (view + 1)])
                .copied()
                .collect()
        };
        // Apart before; after, the nearest of two coinciding points is drawn; the distances are all 0.
        assert!(pixels_where(&part(0), orange) > 500 && pixels_where(&part(0), blue) > 500);
        assert!(pixels_where(&part(2), yellow) > 500 && pixels_where(&part(1), yellow) == 0);
        assert_eq!(pixels_where(&part(2), orange), 0);
    }

    #[test]
    fn strays_and_poses_that_are_no_numbers_do_no_harm() {
        let mut points = cloud(0.0).into_points();
        points.push([1e7, 0.0, 0.0]);
        let source = PointCloud::new(points).unwrap();
        let bad = Rigid { translation: [f64::NAN; 3].into(), ..Rigid::identity() };
        let pair = Pair::new("p", &source, &source).pose(Pose::new("bad", bad));
        let (width, _, pixels) = decoded(&to_png(&pair).unwrap());
        assert_eq!(width, 600);
        let drawn = pixels_where(&pixels, orange) + pixels_where(&pixels, blue);
        assert!(drawn > 5000, "{drawn}");
        let one = PointCloud::new(vec![[1.0; 3]]).unwrap();
        assert!(to_png(&Pair::new("one", &one, &one)).is_ok());
    }
}
