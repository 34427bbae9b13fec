//! `srrf register`: two clouds in, the pose out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use srrf::{Outcome, Registrar, Request, Stage, StageTime};
use srrf_cloud::Rigid;
use srrf_cloud::io::Kept;
use srrf_cloud::pose::PoseNote;

use super::common::{EXIT_CODES, answer, failed, unusable, warnings_of};
use super::method::MethodArgs;
use super::outputs::Outputs;
use super::page::{self, PageArgs};
use super::poses::{PoseReading, PoseWriting, described, looks_inverted};
use super::scale::{self, ScaleArgs};
use super::surface::SurfaceArgs;
use super::values::ShownValues;
use super::watch::Watch;
use super::{rrd, summary};
use srrf_args::files::{self, Input};
use srrf_args::flags::Common;
use srrf_args::reading::PairReadFlags;
use srrf_args::{Failure, Output, OutputKind, Places, Progress};

/// The exit code of an answer that is probably wrong.
const ABSTAINED: u8 = 3;

/// Find the pose that lays one cloud on another: target ~ R source + t.
///
/// Any sizes, any unit, any place; points with NaN are left out. `-` reads a cloud from standard input,
/// and writes a result to standard output.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct RegisterArgs {
    /// The cloud to move, or `-`
    source: PathBuf,

    /// The cloud to lay it on, or `-`
    target: PathBuf,

    /// Write the pose, in the format that the name says: 4 rows of 4 (.txt), .json, .npy, .tum, .kitti, .ros
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Write the source, moved; in its own format colours, faces and all else are kept
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,

    /// Write everything that is known of the answer
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,

    /// Write a page that shows the answer, for any browser
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,

    /// Write a picture that shows the answer: before, after, and the distances that are left
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,

    /// Write a Rerun recording (builds with the feature `rerun`)
    #[arg(long, value_name = "FILE")]
    rrd: Option<PathBuf>,

    /// A first guess: a file of any kind that `--output` writes, or the JSON of an answer
    #[arg(long, value_name = "FILE")]
    initial: Option<PathBuf>,

    /// Write nothing where the answer is `abstain`; the exit code is 3 as always then
    #[arg(long)]
    require_answer: bool,

    #[command(flatten)]
    writing: PoseWriting,

    #[command(flatten)]
    reading: PoseReading,

    #[command(flatten)]
    method: MethodArgs,

    #[command(flatten)]
    scale: ScaleArgs,

    #[command(flatten)]
    surface: SurfaceArgs,

    /// Format of the source where it is a stream [default: by its content]
    #[arg(long, alias = "format-source", value_name = "NAME")]
    source_format: Option<String>,

    /// Format of the target where it is a stream [default: by its content]
    #[arg(long, alias = "format-target", value_name = "NAME")]
    target_format: Option<String>,

    #[command(flatten)]
    read: PairReadFlags,

    #[command(flatten)]
    page: PageArgs,

    #[command(flatten)]
    common: Common,
}

/// Registers.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &RegisterArgs) -> Result<ExitCode, Failure> {
    let begun = Instant::now();
    let out = args.check()?;
    args.common.threads.start()?;
    let guess = args.initial.as_deref().map(|path| args.reading.read(path)).transpose()?;
    let initial = guess.as_ref().map(|guess| guess.target_from_source);
    let progress = args.common.progress();
    progress.step(format!("reading {:?} and {:?}, loading the network", args.source, args.target));
    // The network loads while the files are read.
    let (inputs, registrar) =
        rayon::join(|| args.read(), || Registrar::new(args.scale.options(args.method.options())));
    let (mut source, mut target) = inputs?;
    args.scale.apply(&mut source)?;
    args.check_save(&source, &target)?;
    let (one_unit, seed) = (args.scale.is_one_unit(), args.method.seed.seed);
    let surfaces = args.surface.draw(&mut source, &mut target, one_unit, seed)?;
    let registrar = registrar.map_err(unusable)?;
    let opened = begun.elapsed().as_secs_f64();

    let watch = Watch::new(&progress);
    let request = Request { initial, ..Request::new(&source.cloud, &target.cloud) }.observed_by(&watch);
    let mut outcome =
        args.scale.register(&registrar, &request).map_err(|e| failed(e, &source.name, &target.name))?;
    scale::applied(&outcome, &mut source)?;
    outcome.surfaces = surfaces;
    outcome.times.insert(0, StageTime { stage: Stage::Open, seconds: opened });
    outcome.warnings.extend([&source, &target].into_iter().flat_map(warnings_of));
    outcome.warnings.extend(initial.and_then(|pose| looks_inverted(&pose, &source.cloud, &target.cloud)));

    let written = if outcome.abstain && args.require_answer {
        Outputs { lines: vec!["--require-answer: nothing was written".to_owned()], ..Outputs::default() }
    } else {
        args.write(&outcome, &source, &target, initial.as_ref(), &progress)
    };
    progress.clear();
    if out != Output::Quiet {
        guess.iter().for_each(|guess| out.say(&described("--initial", guess)));
        out.say(&summary::text(&outcome, &source, &target, begun.elapsed().as_secs_f64()));
        written.lines.iter().for_each(|line| out.say(line));
    }
    if let Some(failure) = failure_of(written, &outcome.target_from_source) {
        return Err(failure);
    }
    Ok(if outcome.abstain { ExitCode::from(ABSTAINED) } else { ExitCode::SUCCESS })
}

impl RegisterArgs {
    /// Checks what can be checked before any work, and finds where to speak.
    fn check(&self) -> Result<Output, Failure> {
        self.rrd.as_deref().map_or(Ok(()), rrd::check)?;
        let weights = self.method.weights.weights.as_deref().map(Path::new).filter(|path| path.is_file());
        let places = Places::new()
            .reads("the source", &*self.source)
            .reads("the target", &*self.target)
            .reads("--initial", self.initial.as_deref())
            .reads("--weights", weights);
        let places = self
            .writing
            .among(places, "--output", self.output.as_deref())?
            .writes_copy("--save", self.save.as_deref())?
            .writes("--json", self.json.as_deref(), OutputKind::JSON)?
            .writes("--html", self.html.as_deref(), OutputKind::PAGE)?
            .writes("--png", self.png.as_deref(), OutputKind::PNG)?
            .writes("--rrd", self.rrd.as_deref(), OutputKind::RECORDING)?;
        places.check()?;
        Ok(Output::new(self.common.quiet.quiet, places.takes_standard_output()))
    }

    fn read(&self) -> Result<(Input, Input), Failure> {
        let source = files::read_solid(&self.source, self.source_format.as_deref(), self.read.source())?;
        let target = files::read_solid(&self.target, self.target_format.as_deref(), self.read.target())?;
        self.read.check(&source.file, &target.file)?;
        Ok((source, target))
    }

    /// Checks that the moved source can be written once its pose is known.
    fn check_save(&self, source: &Input, target: &Input) -> Result<(), Failure> {
        let Some(path) = &self.save else { return Ok(()) };
        let (points, target) = (source.cloud.points(), target.cloud.points());
        let checked = match self.scale.changes_size() {
            false => files::check_moved(path, &source.file, target),
            true if self.scale.is_one_unit() => files::check_points(path, Some(points), target),
            true => files::check_points(path, None, target),
        };
        checked.map_err(|failure| failure.at("--save"))
    }

    /// Writes what was asked for.
    fn write(
        &self,
        outcome: &Outcome,
        source: &Input,
        target: &Input,
        initial: Option<&Rigid>,
        progress: &Progress,
    ) -> Outputs {
        let mut written = Outputs::default();
        let mut put =
            |path: Option<&PathBuf>, is_answer: bool, write: &dyn Fn(&Path) -> Result<String, Failure>| {
                written.put(path, is_answer, |path| {
                    progress.step(format!("writing {path:?}"));
                    write(path)
                });
            };
        put(self.output.as_ref(), true, &|path| self.write_pose(path, outcome));
        put(self.json.as_ref(), true, &|path| {
            let found = answer(outcome, &source.name, &target.name, [source.dropped, target.dropped]);
            let text = serde_json::to_string_pretty(&found).map_err(Failure::other)?;
            files::write(path, format!("{text}\n").as_bytes())?;
            Ok("all figures".to_owned())
        });
        put(self.save.as_ref(), false, &|path| save(path, outcome, source));
        let shown = self.html.is_some() || self.png.is_some();
        let values = if shown { ShownValues::of_pair(source, target) } else { Default::default() };
        let pair = || page::of_outcome(outcome, source, target, &values, initial, &self.page);
        put(self.html.as_ref(), false, &|path| {
            files::write(path, page::html(pair(), source, target).as_bytes())?;
            Ok("open it in a browser".to_owned())
        });
        put(self.png.as_ref(), false, &|path| {
            files::write(path, &page::png(&pair())?)?;
            Ok("a picture: before, after, and the distances that are left".to_owned())
        });
        put(self.rrd.as_ref(), false, &|path| {
            rrd::write(path, outcome, source, target)?;
            Ok("open it with `rerun`".to_owned())
        });
        written
    }

    fn write_pose(&self, path: &Path, outcome: &Outcome) -> Result<String, Failure> {
        let note = PoseNote { abstain: outcome.abstain, probability: Some(outcome.probability.get()) };
        self.writing.write(path, &outcome.target_from_source, &note)?;
        Ok(if outcome.abstain { "the pose, with the word abstain" } else { "the pose" }.to_owned())
    }
}

/// The failure of the outputs that could not be written, with the pose where no file has it.
fn failure_of(written: Outputs, pose: &Rigid) -> Option<Failure> {
    let rows = pose.to_matrix4();
    let row = |i: usize| format!("{:?}", [0, 1, 2, 3].map(|j| rows[(i, j)]));
    let matrix = [0, 1, 2, 3].map(row).join(", ");
    let left = (!written.holds_answer).then(|| format!("the pose that was found is [{matrix}]"));
    Failure::of_outputs(written.failed, left)
}

/// Writes the source, moved and maybe scaled.
fn save(path: &Path, outcome: &Outcome, source: &Input) -> Result<String, Failure> {
    let pose = &outcome.target_from_source;
    let factor = outcome.scale.map_or(1.0, |scale| scale.factor);
    let whole = factor == 1.0;
    let (what, kept) = if whole {
        ("the moved source", files::write_moved(path, &source.file, pose)?)
    } else {
        ("the points of the source, scaled and moved", files::write_scaled(path, source, factor, pose)?)
    };
    Ok(kept_words(what, &kept, whole))
}

/// What was written, and what of the original it has.
fn kept_words(what: &str, kept: &Kept, whole: bool) -> String {
    let kept = if whole { kept.to_string() } else { "and nothing else".to_owned() };
    if kept.is_empty() { what.to_owned() } else { format!("{what} {kept}") }
}
