//! `srrf inspect`: what is in a file.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};
use srrf_cloud::Solid;
use srrf_cloud::io::{CloudFile, Note, ReadOptions, ScanEntry};

use super::scans;
use super::statistics::Statistics;
use super::strays::OddNumbers;
use srrf_args::Failure;
use srrf_args::Output;
use srrf_args::files::{self, Input};
use srrf_args::flags::Common;
use srrf_args::reading::ReadFlags;
use srrf_args::surface::{DrawnAlone, DrawnHow, SurfaceFlag};
use srrf_args::words::{count, length, points, vector};

/// Say what is in clouds: sizes, bounds, spacing, points with NaN, and what looks corrupted.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// The clouds; `-` reads one from standard input
    #[arg(required = true)]
    files: Vec<PathBuf>,

    /// Print JSON: a list with an object for each file
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    read: ReadFlags,

    #[command(flatten)]
    surface: SurfaceFlag,

    #[command(flatten)]
    common: Common,
}

/// Inspects all files; those that cannot be read are named, and the others inspected all the same.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &InspectArgs) -> Result<ExitCode, Failure> {
    args.common.threads.start()?;
    let mut values = Vec::new();
    let mut failures = Vec::new();
    let progress = args.common.progress();
    let options = args.read.options_for(&args.files)?;
    for path in &args.files {
        progress.step(format!("reading {path:?}"));
        let inspected = inspect(path, options.clone(), args.surface);
        progress.clear();
        match inspected {
            Ok(found) if args.json => values.push(found.to_json()),
            Ok(found) => Output::new(args.common.quiet.quiet, false).say(found.to_text().trim_end()),
            Err(failure) => {
                if args.json {
                    values.push(json!({ "file": path.display().to_string(), "error": failure.to_string() }));
                }
                failures.push(failure.to_string());
            }
        }
    }
    if args.json {
        files::write(Path::new("-"), format!("{:#}\n", Value::Array(values)).as_bytes())?;
    }
    if failures.is_empty() { Ok(ExitCode::SUCCESS) } else { Err(Failure::usage(failures.join("\nerror: "))) }
}

/// What is known of a file.
enum Found {
    /// A cloud, and the scans that it is made of if they are several.
    Cloud(Box<Inspected>, Vec<ScanEntry>),
    /// Several scans that are no one cloud.
    Scans(Box<CloudFile>, Vec<ScanEntry>),
}

/// A cloud, and what was found out about it.
struct Inspected {
    input: Input,
    /// Of the cloud, or of the points drawn from a surface.
    statistics: Statistics,
    odd: OddNumbers,
    drawn: Option<DrawnAlone>,
}

fn inspect(path: &Path, options: ReadOptions, surface: SurfaceFlag) -> Result<Found, Failure> {
    let mut input = match files::read(path, None, options.clone()) {
        Ok(input) => input,
        Err(failure) => {
            let (file, scans) = scans::of_path(path, options).ok_or(failure)?;
            return Ok(Found::Scans(Box::new(file), scans));
        }
    };
    let of = |input: &Input| Statistics::new(&input.cloud).map_err(|e| Failure::cloud(&input.name, &e));
    let vertices = of(&input)?;
    let odd = OddNumbers::of(&input.cloud, vertices.spacing, input.kept.as_deref());
    // Faces without an area are worth a word, and no reason to say nothing else.
    let (drawn, flaw) = match surface.draw_alone(&mut input, 0) {
        Ok(drawn) => (drawn, None),
        Err(failure) => (None, Some(failure.to_string())),
    };
    input.notes.extend(flaw.map(|what| Note::Ignored { what: format!("the faces: {what}") }));
    let mut statistics = vertices.clone();
    if drawn.as_ref().is_some_and(|drawn| matches!(drawn.how, DrawnHow::Points(..))) {
        // The box and the number of points are those of the file.
        statistics =
            Statistics { points: vertices.points, low: vertices.low, high: vertices.high, ..of(&input)? };
    }
    let several = scans::several(&input.file);
    Ok(Found::Cloud(Box::new(Inspected { input, statistics, odd, drawn }), several))
}

impl Found {
    fn to_json(&self) -> Value {
        let (mut value, several) = match self {
            Self::Cloud(inspected, several) => (to_json(inspected), several),
            Self::Scans(file, scans) => {
                (json!({ "file": file.path().display().to_string(), "format": file.format() }), scans)
            }
        };
        if let Value::Object(map) = &mut value
            && !several.is_empty()
        {
            map.insert("scans".into(), scans::to_json(several));
        }
        value
    }

    fn to_text(&self) -> String {
        let (mut out, several) = match self {
            Self::Cloud(inspected, several) => (to_text(inspected), several),
            Self::Scans(file, scans) => (format!("{}: {}\n", file.path().display(), file.format()), scans),
        };
        for (index, line) in scans::in_words(several).into_iter().enumerate() {
            let label = if index == 0 { "scans" } else { "" };
            // Writing to a string cannot fail.
            let _ = writeln!(out, "  {label:10} {line}");
        }
        out
    }
}

fn to_json(Inspected { input, statistics, odd, drawn }: &Inspected) -> Value {
    let mut value = json!(statistics);
    if let Value::Object(map) = &mut value {
        map.insert("file".into(), json!(input.name));
        map.insert("format".into(), json!(input.file.format()));
        map.insert("dropped_points".into(), json!(input.dropped));
        map.insert("faces".into(), json!(input.faces.len()));
        map.insert("single_precision".into(), json!(input.single));
        map.insert("viewpoint".into(), json!(input.viewpoint));
        map.insert("grid".into(), json!(input.grid));
        map.insert("notes".into(), json!(input.notes.iter().map(ToString::to_string).collect::<Vec<_>>()));
        let surface = drawn.as_ref().and_then(|drawn| match drawn.how {
            DrawnHow::Points(points, spacing) => Some(json!({ "points": points, "spacing": spacing })),
            DrawnHow::Asked | DrawnHow::Dense => None,
        });
        map.insert("surface".into(), json!(surface));
        map.insert("odd_numbers".into(), json!(odd));
        map.insert("warnings".into(), json!(odd.text()));
        map.insert("suggestions".into(), json!(statistics.suggestions()));
        map.insert("determines_rotation".into(), json!(Solid::new(&input.cloud).is_ok()));
    }
    value
}

fn to_text(Inspected { input, statistics: s, odd, drawn }: &Inspected) -> String {
    let mut out = String::new();
    let mut line = |label: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {label:10} {value}");
    };
    let dropped = match input.dropped {
        0 => String::new(),
        n => format!(", and {} with NaN or infinity", count(n)),
    };
    line("points", format!("{}{dropped}", count(s.points)));
    if !input.faces.is_empty() {
        line("faces", format!("{} triangles", count(input.faces.len())));
    }
    if let Some(drawn) = drawn {
        line("surface", drawn.text());
    }
    if let Some([width, height]) = input.grid {
        line("grid", format!("{width} x {height}"));
    }
    if let Some(viewpoint) = input.viewpoint {
        line("viewpoint", vector(viewpoint, s.spacing.max(f64::MIN_POSITIVE), 3));
    }
    for note in &input.notes {
        line("note", note.to_string());
    }
    let sides: [f64; 3] = std::array::from_fn(|c| s.high[c] - s.low[c]);
    let scale = if s.spacing > 0.0 { s.spacing } else { s.radius };
    line("box", format!("{} to {}", vector(s.low, scale, 3), vector(s.high, scale, 3)));
    line("", format!("sides {}", vector(sides, scale, 3)));
    line("centroid", vector(s.centroid, scale, 3));
    line(
        "radius",
        format!("{} (farthest point), {} (root mean square)", length(s.radius, 4), length(s.radius_rms, 4)),
    );
    line(
        "spacing",
        format!(
            "{} (median to the nearest other point); density {} points a square unit",
            length(s.spacing, 4),
            length(s.density, 3)
        ),
    );
    line(
        "figures",
        format!(
            "outliers {:.2} % of {} asked, repeated {:.2} %, crowding {:.2}, thinning {:.2}, roughness {:.2} spacings",
            100.0 * s.outliers,
            count(s.asked),
            100.0 * s.duplicates,
            s.clustering,
            s.thinning,
            s.roughness
        ),
    );
    if let Err(e) = Solid::new(&input.cloud) {
        line("warning", format!("it cannot be registered: {e}"));
    }
    odd.text().into_iter().for_each(|odd| line("warning", odd));
    let suggestions = s.suggestions();
    for suggestion in &suggestions {
        line("maybe", suggestion.clone());
    }
    if suggestions.is_empty() {
        line("maybe", "nothing; holes, shear and bending cannot be seen in one cloud alone".into());
    }
    format!("{}: {}, {}\n{out}", input.name, input.file.format(), points(s.points + input.dropped))
}
