//! What a run leaves to read: JSON lines, a progress bar, a picture of the loss curves.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use plotters::prelude::*;
use serde_json::{Value, json};

use crate::checkpoint::SavedWindow;
use crate::seam::Losses;
use crate::validate::Validation;

/// Name of the metrics file in the run's folder.
pub const FILE: &str = "metrics.jsonl";
/// Name of the picture of the curves.
pub const PICTURE: &str = "curve.svg";

/// A run's log file, one JSON object a line.
pub struct Log {
    path: PathBuf,
    file: std::fs::File,
}

impl Log {
    /// Opens the log of `folder`. Lines after step `step` belong to a part of the run that a kill
    /// lost and that is about to be made again: they are dropped.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(folder: &Path, step: usize) -> std::io::Result<Self> {
        let path = folder.join(FILE);
        let kept: Vec<String> = match std::fs::File::open(&path) {
            Ok(file) => BufReader::new(file)
                .lines()
                .map_while(Result::ok)
                .filter(|line| step_of(line).is_some_and(|at| at <= step))
                .collect(),
            Err(_) => Vec::new(),
        };
        srrf_cloud::io::write_atomically(&path, |out| {
            kept.iter().try_for_each(|line| writeln!(out, "{line}"))
        })?;
        let file = std::fs::OpenOptions::new().append(true).open(&path)?;
        Ok(Self { path, file })
    }

    /// One line about a stretch of training.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn train(
        &mut self,
        step: usize,
        epoch: f64,
        stage: &str,
        rate: f64,
        losses: &BTreeMap<String, f64>,
    ) -> std::io::Result<()> {
        let line = json!({ "kind": "train", "step": step, "epoch": round(epoch), "stage": stage,
            "learning_rate": rate, "losses": losses });
        writeln!(self.file, "{line}")
    }

    /// One line about a validation.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn validation(&mut self, step: usize, epoch: f64, result: &Validation) -> std::io::Result<()> {
        let rows: BTreeMap<_, _> = result
            .scores
            .iter()
            .map(|(name, s)| {
                (
                    name,
                    json!({ "rmse_r": s.rmse_r, "mae_r": s.mae_r, "median_rot_deg": s.median_rot_deg,
                    "rmse_t": s.rmse_t, "mae_t": s.mae_t, "recall": s.recall, "pairs": s.pairs }),
                )
            })
            .collect();
        let mut line = json!({ "kind": "validation", "step": step, "epoch": round(epoch), "scores": rows });
        for (name, value) in &result.notes {
            line[*name] = json!(value);
        }
        writeln!(self.file, "{line}")
    }

    /// Draws the curves of the log as `curve.svg` beside it: RMSE(R) of `rows` and the `losses`.
    ///
    /// # Errors
    /// A message, when the picture cannot be drawn.
    pub fn draw(&self, rows: &[&'static str], losses: &[&'static str]) -> Result<(), String> {
        let text = std::fs::read_to_string(&self.path).map_err(|e| e.to_string())?;
        let lines: Vec<Value> = text.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let curve = |kind: &str, value: &dyn Fn(&Value) -> Option<f64>| -> Vec<(f64, f64)> {
            let of_kind = lines.iter().filter(|l| l["kind"] == kind);
            of_kind.filter_map(|l| Some((l["epoch"].as_f64()?, value(l)?))).collect()
        };
        let score = |name: &'static str| curve("validation", &move |l| l["scores"][name]["rmse_r"].as_f64());
        let validation: Vec<_> = rows.iter().map(|&row| (row, score(row))).collect();
        let loss = |name: &'static str| curve("train", &move |l| l["losses"][name].as_f64());
        let losses: Vec<_> = losses.iter().map(|&name| (name, loss(name))).collect();

        let picture = self.path.with_file_name(PICTURE);
        let root = SVGBackend::new(&picture, (900, 640)).into_drawing_area();
        root.fill(&WHITE).map_err(|e| e.to_string())?;
        let parts = root.split_evenly((2, 1));
        panel(&parts[0], "RMSE(R) on the validation part, degrees", &validation)?;
        panel(&parts[1], "training losses", &losses)?;
        root.present().map_err(|e| e.to_string())
    }
}

/// One chart with several curves.
fn panel(
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
    title: &str,
    curves: &[(&str, Vec<(f64, f64)>)],
) -> Result<(), String> {
    let points = || curves.iter().flat_map(|(_, points)| points.iter());
    if points().next().is_none() {
        return Ok(());
    }
    let end = points().map(|p| p.0).fold(0.0, f64::max).max(1e-9);
    let high = points().map(|p| p.1).fold(0.0, f64::max);
    let low = points().map(|p| p.1).fold(0.0, f64::min);
    let fail = |e: &dyn std::fmt::Display| e.to_string();
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(30)
        .y_label_area_size(48)
        .build_cartesian_2d(0.0..end, low..high * 1.05 + 1e-9)
        .map_err(|e| fail(&e))?;
    chart.configure_mesh().x_desc("epochs").light_line_style(WHITE).draw().map_err(|e| fail(&e))?;
    for (i, (name, points)) in curves.iter().enumerate().filter(|(_, (_, points))| !points.is_empty()) {
        let color = Palette99::pick(i).to_rgba();
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))
            .map_err(|e| fail(&e))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()
        .map_err(|e| fail(&e))
}

fn step_of(line: &str) -> Option<usize> {
    serde_json::from_str::<Value>(line).ok()?["step"].as_u64().map(|step| step as usize)
}

fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// The losses since the last line of the log.
#[derive(Default)]
pub struct LossWindow {
    sums: BTreeMap<String, f64>,
    steps: usize,
}

impl LossWindow {
    /// As a checkpoint has it.
    pub fn of_saved(saved: &SavedWindow) -> Self {
        let sums = saved.sums.iter().map(|(name, bits)| (name.clone(), f64::from_bits(*bits))).collect();
        Self { sums, steps: saved.steps }
    }

    /// For a checkpoint.
    pub fn saved(&self) -> SavedWindow {
        let sums = self.sums.iter().map(|(name, sum)| (name.clone(), sum.to_bits())).collect();
        SavedWindow { sums, steps: self.steps }
    }

    /// Adds those of a step; none where it was left out.
    pub fn add(&mut self, losses: Losses) {
        self.steps += usize::from(!losses.is_empty());
        for (name, value) in losses {
            *self.sums.entry(name.to_owned()).or_insert(0.0) += value;
        }
    }

    /// Their means; what follows is a new window.
    pub fn mean(&mut self) -> BTreeMap<String, f64> {
        let Self { sums, steps } = std::mem::take(self);
        sums.into_iter().map(|(name, sum)| (name, sum / steps.max(1) as f64)).collect()
    }
}

/// A stretch of training in one line.
pub fn train_line(
    stage: &str,
    epoch: f64,
    rate: f64,
    losses: &BTreeMap<String, f64>,
    batch: usize,
    bar: &ProgressBar,
) -> String {
    let total = losses.get("total").copied().unwrap_or(f64::NAN);
    let pairs = bar.per_sec() * batch as f64;
    format!("{stage}  epoch {epoch:.2}  loss {total:.4}  lr {rate:.1e}  {pairs:.1} pairs/s")
}

/// A validation in one line.
pub fn summary(step: usize, epoch: f64, result: &Validation, rows: &[&str]) -> String {
    let row = |name: &&str| {
        let s = &result.scores[name];
        format!("{name} {:.2}/{:.2}/{:.2}", s.rmse_r, s.mae_r, s.median_rot_deg)
    };
    let rows = rows.iter().map(row).collect::<Vec<_>>().join(", ");
    let notes: String = result.notes.iter().map(|(name, value)| format!(", {name} {value:.3}")).collect();
    format!("step {step}, epoch {epoch:.2}: RMSE/MAE/median of R in degrees: {rows}{notes}")
}

/// The progress bar of a run, on standard error.
pub fn progress_bar(steps: usize, done: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_position(done as u64);
    let style = ProgressStyle::with_template("{bar:24} {pos}/{len} steps  {msg}  {elapsed} < {eta}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.reset_eta();
    bar
}
