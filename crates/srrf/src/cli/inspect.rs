//! `srrf inspect`: what is in a file.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};
use srrf_cloud::Solid;
use srrf_cloud::io::{CloudFile, ReadOptions, ScanEntry};

use super::scans;
use super::statistics::Statistics;
use srrf_args::Failure;
use srrf_args::Output;
use srrf_args::files::{self, Input};
use srrf_args::flags::Common;
use srrf_args::reading::ReadFlags;
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
    for path in &args.files {
        progress.step(format!("reading {path:?}"));
        let inspected = inspect(path, args.read.options());
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
    Cloud(Box<Input>, Statistics, Vec<ScanEntry>),
    /// Several scans that are no one cloud.
    Scans(CloudFile, Vec<ScanEntry>),
}

fn inspect(path: &Path, options: ReadOptions) -> Result<Found, Failure> {
    let input = match files::read(path, None, options.clone()) {
        Ok(input) => input,
        Err(failure) => {
            let (file, scans) = scans::of_path(path, options).ok_or(failure)?;
            return Ok(Found::Scans(file, scans));
        }
    };
    let statistics = Statistics::new(&input.cloud).map_err(|e| Failure::cloud(&input.name, &e))?;
    let several = scans::several(&input.file);
    Ok(Found::Cloud(Box::new(input), statistics, several))
}

impl Found {
    fn to_json(&self) -> Value {
        let (mut value, several) = match self {
            Self::Cloud(input, statistics, several) => (to_json(input, statistics), several),
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
            Self::Cloud(input, statistics, several) => (to_text(input, statistics), several),
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

fn to_json(input: &Input, statistics: &Statistics) -> Value {
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
        map.insert("suggestions".into(), json!(statistics.suggestions()));
        map.insert("determines_rotation".into(), json!(Solid::new(&input.cloud).is_ok()));
    }
    value
}

fn to_text(input: &Input, s: &Statistics) -> String {
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
    let suggestions = s.suggestions();
    for suggestion in &suggestions {
        line("maybe", suggestion.clone());
    }
    if suggestions.is_empty() {
        line("maybe", "nothing; holes, shear and bending cannot be seen in one cloud alone".into());
    }
    format!("{}: {}, {}\n{out}", input.name, input.file.format(), points(s.points + input.dropped))
}
