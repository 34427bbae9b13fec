//! `srrf align`: many scans in, one map out.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use clap::Args;
use srrf::{Options, Registrar};
use srrf_align::{AlignError, AlignOptions, AlignProgress, AlignStage, Map};
use srrf_args::flags::{Common, value};
use srrf_args::reading::ReadFlags;
use srrf_args::words::counted;
use srrf_args::{Failure, Output, OutputKind, OutputLock, Places, Progress, files, interrupt};
use srrf_cloud::io::is_cloud_file;

use super::align_edges::EdgeFile;
use super::align_initial::{self, EarlierMap};
use super::align_merge::{MergedCloudArgs, merge};
use super::align_moved;
use super::align_page;
use super::align_places::expanded;
use super::align_poses;
use super::align_scans::{ScanFiles, ScanReading};
use super::align_summary::{shortened, summary};
use super::common::unusable;
use super::method::MethodArgs;
use super::outputs::Outputs;
use super::surface::SurfaceArgs;

/// The exit code of a map in which not every scan is placed.
const ABSTAINED: u8 = 3;

const HELP: &str = "Exit codes:
  0    all scans are in one map, each probably right
  1    failure: an output could not be written
  2    bad usage or input
  3    the poses were written, but some scans are in maps of their own, or may well be wrong
  130  interrupted; with --edges the same command goes on where it stopped";

/// Lay many scans in one frame, and say which may be trusted.
///
/// Files, or folders of files; in any order, of any sizes, one unit. Pairs that may overlap are registered, those that contradict the
/// others are found, and all poses are made to agree. Scans that nothing joins make maps of their own: two rooms
/// without overlap give two maps.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct AlignArgs {
    /// The scans: files, or folders of them; `file.e57#2` is the second scan of a file
    #[arg(required_unless_present = "add")]
    scans: Vec<PathBuf>,

    /// Write all poses and what is known of them, as JSON
    #[arg(short, long, value_name = value::FILE)]
    output: Option<PathBuf>,

    /// Write the poses of the largest map as TUM: number of the scan from 0, translation, quaternion x y z w
    #[arg(long, value_name = value::FILE)]
    tum: Option<PathBuf>,

    /// Write the poses as KITTI: 3 rows of 4 on a line, one line a scan; for a single map
    #[arg(long, value_name = value::FILE)]
    kitti: Option<PathBuf>,

    #[command(flatten)]
    merge: MergedCloudArgs,

    /// Write a copy of each scan of the largest map into this folder, moved into its frame; E57 and PTX keep all and get new poses
    #[arg(long, value_name = "FOLDER")]
    moved: Option<PathBuf>,

    /// Write a page that shows the map, for any browser
    #[arg(long, value_name = value::FILE)]
    html: Option<PathBuf>,

    /// Keep registered pairs here, and take those that are there: the same command goes on where it stopped
    #[arg(long, value_name = value::FILE)]
    edges: Option<PathBuf>,

    /// Add the scans to those of this earlier result (JSON of `--output`); with `--edges` only pairs with new scans are registered
    #[arg(long, value_name = value::FILE)]
    add: Option<PathBuf>,

    /// First guesses of the poses: JSON of `--output`, TUM or KITTI
    #[arg(long, value_name = value::FILE)]
    initial: Option<PathBuf>,

    /// The scans were taken one after the other, in this order, each overlapping the next
    #[arg(long)]
    sequence: bool,

    /// Try all pairs, however many scans there are
    #[arg(long)]
    all_pairs: bool,

    /// Leave out the joint refinement on the points
    #[arg(long)]
    no_joint: bool,

    /// Take no first guesses from the poses in files of several scans (E57, PTX)
    #[arg(long)]
    ignore_poses: bool,

    #[command(flatten)]
    read: ReadFlags,

    #[command(flatten)]
    surface: SurfaceArgs,

    #[command(flatten)]
    method: MethodArgs,

    #[command(flatten)]
    common: Common,
}

/// Aligns.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &AlignArgs) -> Result<ExitCode, Failure> {
    let begun = Instant::now();
    let out = args.check()?;
    args.common.threads.start()?;
    let _locks = args.locks()?;
    let options = args.read.options();
    let known = args.add.as_deref().map(|path| align_initial::read_result(path, &options)).transpose()?;
    let progress = args.common.progress();
    progress.step("reading the scans, loading the network");
    let scans = args.open(known.as_ref())?;
    let initial = match (&args.initial, &known) {
        (Some(path), _) => align_initial::read_initial(path, &scans.names(), &options)?,
        (None, Some(known)) => known.guesses(scans.len()),
        (None, None) if !args.ignore_poses && !args.sequence => scans.guesses(),
        (None, None) => Vec::new(),
    };
    if args.initial.is_none() && args.add.is_none() && !initial.is_empty() {
        let guessed = initial.iter().flatten().count();
        out.say(&format!(
            "{} with a first guess by the poses in their file; --ignore-poses takes none",
            counted(guessed, "scan")
        ));
    }
    // All scans are in one unit; a small scan beside a large one is no sign of another.
    let registrar =
        Registrar::new(Options { check_scale: false, ..args.method.options() }).map_err(unusable)?;
    let edges = EdgeFile::open(args.edges.as_deref(), &scans, &registrar.options().to_string())?;
    progress.clear();
    if edges.known() > 0 {
        out.say(&format!("{} known already", counted(edges.known(), "pair")));
    }
    if args.edges.is_some() {
        interrupt::advise("; the same command goes on where this one stopped");
    }
    let how = AlignOptions {
        initial,
        sequence: args.sequence,
        settled: known.as_ref().map_or(0, |k| k.scans.len()),
        all_pairs: if args.all_pairs { usize::MAX } else { AlignOptions::default().all_pairs },
        refine: !args.no_joint,
        at_once: Some(scans.at_once(rayon::current_num_threads())),
        ..AlignOptions::default()
    };
    let signs = Signs::new(&progress);
    let map = srrf_align::align(&scans, &registrar, &how, &edges, &|p| signs.show(p));
    progress.clear();
    let map = map.map_err(|e| failed(e, &scans))?;
    edges.finish()?;
    let seconds = begun.elapsed().as_secs_f64();

    let written = args.write(&map, &scans, &registrar, seconds);
    if out != Output::Quiet {
        out.say(&summary(&map, &scans, begun.elapsed().as_secs_f64()));
    }
    written.lines.iter().for_each(|line| out.say(line));
    if !written.failed.is_empty() && !written.holds_answer {
        // Better beside the errors than lost.
        Output::Aside.say(align_poses::to_tum(&map, &scans).trim_end());
    }
    if let Some(failure) = Failure::of_outputs(written.failed, None) {
        return Err(failure);
    }
    let doubtful = map.components.len() > 1 || map.scans.iter().any(|s| s.abstain);
    Ok(if doubtful { ExitCode::from(ABSTAINED) } else { ExitCode::SUCCESS })
}

impl AlignArgs {
    /// Checks what can be checked before any work, and finds where to speak.
    fn check(&self) -> Result<Output, Failure> {
        if self.all_pairs && self.sequence {
            return Err(Failure::usage(
                "--all-pairs tries all pairs, --sequence those in order: give one of them".into(),
            ));
        }
        self.merge.check()?;
        if self.edges.as_deref().is_some_and(files::is_stream) {
            return Err(Failure::usage(
                "--edges is a file that is read and written: it cannot be `-`".into(),
            ));
        }
        let mut places =
            Places::new().reads("--add", self.add.as_deref()).reads("--initial", self.initial.as_deref());
        for scan in &self.scans {
            let inside = std::fs::read_dir(scan).into_iter().flatten().flatten().map(|entry| entry.path());
            for file in inside.filter(|file| is_cloud_file(file)) {
                places = places.reads("a scan", &*file);
            }
            places = places.reads("a scan", Some(&**scan).filter(|scan| !scan.is_dir()));
        }
        let places = places
            .writes("--output", self.output.as_deref(), OutputKind::JSON)?
            .writes("--tum", self.tum.as_deref(), OutputKind::TUM)?
            .writes("--kitti", self.kitti.as_deref(), OutputKind::KITTI)?
            .writes("--html", self.html.as_deref(), OutputKind::PAGE)?
            .writes("--edges", self.edges.as_deref(), OutputKind::JSON_LINES)?
            .fills("--moved", self.moved.as_deref())
            .writes_cloud("--save", self.merge.save.as_deref())?;
        places.check()?;
        Ok(Output::new(self.common.quiet.quiet, places.takes_standard_output()))
    }

    /// One process at a time writes each output.
    fn locks(&self) -> Result<Vec<OutputLock>, Failure> {
        let outputs = [&self.edges, &self.output, &self.merge.save, &self.html, &self.tum, &self.kitti];
        outputs.into_iter().flatten().filter_map(|path| OutputLock::take(path).transpose()).collect()
    }

    fn open(&self, known: Option<&EarlierMap>) -> Result<ScanFiles, Failure> {
        let before: Vec<PathBuf> = known.map_or_else(Vec::new, EarlierMap::paths);
        let given = expanded(&self.scans)?;
        let files = [&before[..], &given].concat();
        let reading = ScanReading {
            options: self.read.options_for(&files)?,
            memory: self.read.max_memory,
            vertices: self.surface.vertices,
        };
        let scans = ScanFiles::open(&before, &given, &reading)?;
        if let Some(folder) = &self.moved {
            let mut places = Places::new();
            for (name, file) in align_moved::names(&scans)? {
                places =
                    places.reads("a scan", &*file).writes_into("--moved", folder, &name.to_string_lossy());
            }
            places.check()?;
            align_moved::check(&scans)?;
        }
        Ok(scans)
    }

    /// Writes what was asked for.
    fn write(&self, map: &Map, scans: &ScanFiles, registrar: &Registrar, seconds: f64) -> Outputs {
        let mut written = Outputs::default();
        written.put(self.output.as_ref(), true, |path| {
            let json = align_poses::to_json(map, scans, &registrar.options().to_string(), seconds);
            files::write(path, format!("{json:#}\n").as_bytes())?;
            Ok("all poses and figures".to_owned())
        });
        written.put(self.tum.as_ref(), true, |path| {
            files::write(path, align_poses::to_tum(map, scans).as_bytes())?;
            Ok("the poses of the largest map, as TUM".to_owned())
        });
        written.put(self.kitti.as_ref(), true, |path| {
            files::write(path, align_poses::to_kitti(map)?.as_bytes())?;
            Ok("the poses, as KITTI".to_owned())
        });
        written.put(
            self.merge.save.as_ref(),
            false,
            |path| Ok(merge(map, scans, &self.merge, path)?.words()),
        );
        written.put(self.moved.as_ref(), false, |folder| {
            let copies = align_moved::write(map, scans, folder)?;
            let mut what =
                format!("{}, moved into the frame of the largest map", counted(copies.written, "file"));
            if !copies.unmoved.is_empty() {
                what += &format!("; not in it and not moved: {}", shortened(&copies.unmoved));
            }
            Ok(what)
        });
        written.put(self.html.as_ref(), false, |path| {
            files::write(path, align_page::page(map, scans)?.as_bytes())?;
            Ok("open it in a browser".to_owned())
        });
        written
    }
}

/// The failure behind an error of the library, which knows no files.
fn failed(error: AlignError<Failure, srrf::Error>, scans: &ScanFiles) -> Failure {
    match error {
        AlignError::TooFew(n) => Failure::usage(format!(
            "{} given: at least two scans are needed; name more files, or a folder of them",
            counted(n, "scan")
        )),
        AlignError::Scan { source, .. } => source,
        AlignError::Cloud { number, source } => Failure::cloud(&scans.name(number), &source),
        AlignError::Register { number, source } => match source {
            srrf::Error::Source(e) | srrf::Error::Target(e) => Failure::cloud(&scans.name(number), &e),
            other => Failure::failed(format!("{:?}: {other}", scans.name(number))).because(other),
        },
        other @ (AlignError::Guesses { .. } | AlignError::Guess(_)) => Failure::input(other),
    }
}

/// Progress of the alignment as signs of life.
struct Signs<'a> {
    progress: &'a Progress,
    last: Mutex<Option<AlignProgress>>,
}

impl<'a> Signs<'a> {
    fn new(progress: &'a Progress) -> Self {
        Self { progress, last: Mutex::new(None) }
    }

    fn show(&self, now: AlignProgress) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let same = last.filter(|l| l.stage == now.stage && l.total == now.total);
        if same.is_none() {
            match now.stage {
                AlignStage::Read => self.progress.counted(now.stage.to_string(), now.total, "scans"),
                AlignStage::Pairs => self.progress.counted(now.stage.to_string(), now.total, "pairs"),
                AlignStage::Candidates | AlignStage::Graph | AlignStage::Joint => {
                    self.progress.step(now.stage.to_string());
                }
            }
        }
        let before = same.map_or(0, |l| l.done);
        // Threads report out of order.
        self.progress.advance(now.done.saturating_sub(before));
        *last = Some(AlignProgress { done: now.done.max(before), ..now });
    }
}
