//! `srrf register`: two clouds in, the pose out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use srrf::{Outcome, Registrar, Request, Stage, StageTime};
use srrf_cloud::Rigid;
use srrf_cloud::io::Kept;

use super::common::{EXIT_CODES, failed, left_out, to_json, unusable};
use super::method::MethodArgs;
use super::page::{self, PageArgs};
use super::scale::{self, ScaleArgs};
use super::watch::Watch;
use super::{rrd, summary, transform};
use srrf_args::Failure;
use srrf_args::files::{self, Input};
use srrf_args::flags::Common;
use srrf_args::{Output, Progress};

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

    /// Write the pose: 4 rows of 4, which `numpy.loadtxt` reads
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

    /// A first guess: a file of the same kind as `--output` writes
    #[arg(long, value_name = "FILE")]
    initial: Option<PathBuf>,

    #[command(flatten)]
    method: MethodArgs,

    #[command(flatten)]
    scale: ScaleArgs,

    /// Format of the source where it is a stream [default: by its content]
    #[arg(long, value_name = "NAME")]
    format_source: Option<String>,

    /// Format of the target where it is a stream [default: by its content]
    #[arg(long, value_name = "NAME")]
    format_target: Option<String>,

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
    let initial = args.initial.as_deref().map(transform::read).transpose()?;
    let progress = args.common.progress();
    progress.step(format!("reading {:?} and {:?}, loading the network", args.source, args.target));
    // The network loads while the files are read.
    let (inputs, registrar) =
        rayon::join(|| args.read(), || Registrar::new(args.scale.options(args.method.options())));
    let (mut source, target) = inputs?;
    args.scale.apply(&mut source)?;
    let registrar = registrar.map_err(unusable)?;
    let opened = begun.elapsed().as_secs_f64();

    let watch = Watch::new(&progress);
    let request = Request { initial, ..Request::new(&source.cloud, &target.cloud) }.observed_by(&watch);
    let mut outcome =
        args.scale.register(&registrar, &request).map_err(|e| failed(e, &source.name, &target.name))?;
    scale::applied(&outcome, &mut source)?;
    outcome.times.insert(0, StageTime { stage: Stage::Open, seconds: opened });
    outcome.warnings.extend([&source, &target].into_iter().filter_map(left_out));

    let written = args.write(&outcome, &source, &target, initial.as_ref(), &progress)?;
    progress.clear();
    if out != Output::Quiet {
        out.say(&summary::text(&outcome, &source, &target, begun.elapsed().as_secs_f64()));
        written.iter().for_each(|line| out.say(line));
    }
    Ok(if outcome.abstain { ExitCode::from(ABSTAINED) } else { ExitCode::SUCCESS })
}

impl RegisterArgs {
    /// Checks what can be checked before any work, and finds where to speak.
    fn check(&self) -> Result<Output, Failure> {
        if files::is_stream(&self.source) && files::is_stream(&self.target) {
            return Err(Failure::usage(
                "both clouds are `-`: standard input holds one; name a file for the other".into(),
            ));
        }
        self.rrd.as_deref().map_or(Ok(()), rrd::check)?;
        let outputs = [&self.output, &self.save, &self.json, &self.html, &self.png, &self.rrd];
        outputs.into_iter().flatten().try_for_each(|path| files::check_output(path))?;
        if let Some(path) = &self.save {
            files::check_cloud_output(path)?;
        }
        let streams = outputs.into_iter().flatten().filter(|path| files::is_stream(path)).count();
        if streams > 1 {
            return Err(Failure::usage(format!(
                "{streams} results are to go to `-`: standard output takes one; name files for the others"
            )));
        }
        Ok(Output::new(self.common.quiet.quiet, streams > 0))
    }

    fn read(&self) -> Result<(Input, Input), Failure> {
        Ok((
            files::read_solid(&self.source, self.format_source.as_deref())?,
            files::read_solid(&self.target, self.format_target.as_deref())?,
        ))
    }

    /// Writes what was asked for; says what was written.
    fn write(
        &self,
        outcome: &Outcome,
        source: &Input,
        target: &Input,
        initial: Option<&Rigid>,
        progress: &Progress,
    ) -> Result<Vec<String>, Failure> {
        let pose = &outcome.target_from_source;
        let mut lines = Vec::new();
        let begin = |path: &Path| progress.step(format!("writing {path:?}"));
        if let Some(path) = &self.output {
            begin(path);
            files::write(path, transform::to_text(pose).as_bytes())?;
            lines.push(wrote(path, "the pose"));
        }
        if let Some(path) = &self.save {
            begin(path);
            let written = if outcome.scale.is_none_or(|scale| scale.factor == 1.0) {
                files::write_moved(path, &source.file, pose)?
            } else {
                files::write_points(path, &source.cloud.transformed(pose))?;
                Kept::Points
            };
            let what = match written {
                Kept::Points if outcome.scale.is_some() => {
                    "the points of the source, scaled and moved, and nothing else"
                }
                Kept::Everything => "the moved source with all else that its file holds",
                Kept::Points => {
                    "the moved points of the source; another format than the source's keeps nothing else"
                }
            };
            lines.push(wrote(path, what));
        }
        if let Some(path) = &self.json {
            begin(path);
            let value = to_json(outcome, &source.name, &target.name, [source.dropped, target.dropped]);
            files::write(path, format!("{value:#}\n").as_bytes())?;
            lines.push(wrote(path, "all figures"));
        }
        if let Some(path) = &self.html {
            begin(path);
            let pair = page::of_outcome(outcome, source, target, initial, &self.page);
            files::write(path, page::html(pair, source, target).as_bytes())?;
            lines.push(wrote(path, "open it in a browser"));
        }
        if let Some(path) = &self.png {
            begin(path);
            let pair = page::of_outcome(outcome, source, target, initial, &self.page);
            files::write(path, &page::png(&pair)?)?;
            lines.push(wrote(path, "a picture: before, after, and the distances that are left"));
        }
        if let Some(path) = &self.rrd {
            begin(path);
            rrd::write(path, outcome, source, target)?;
            lines.push(wrote(path, "open it with `rerun`"));
        }
        Ok(lines)
    }
}

fn wrote(path: &Path, what: &str) -> String {
    let name = if files::is_stream(path) { "standard output".to_owned() } else { path.display().to_string() };
    format!("wrote {name}: {what}")
}
