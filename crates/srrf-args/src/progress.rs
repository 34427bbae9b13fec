//! [`Progress`]: signs of life while a program works, on standard error.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

use crate::words::count;

/// A step that takes longer than this is shown on a terminal.
const PATIENCE: Duration = Duration::from_secs(1);
/// How far lines are apart.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// How signs of life look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal; elsewhere a line each 10 seconds.
    Auto,
    /// A bar; lines where there is no terminal.
    Bar,
    /// A line for each step as it begins, and one each 10 seconds.
    Lines,
    /// Nothing.
    Off,
}

/// `--progress`
#[derive(Debug, Clone, Copy, Args)]
pub struct ProgressArgs {
    /// How to show what is being done, on standard error: `auto` (a bar on a terminal, else a line each 10 seconds),
    /// `bar`, `lines` (also one for each step) or `off`
    #[arg(long, value_enum, value_name = "HOW", default_value_t = ProgressKind::Auto, hide_possible_values = true)]
    pub progress: ProgressKind,
}

impl ProgressArgs {
    /// Signs of life of this kind; none in a quiet run.
    pub fn start(self, quiet: bool) -> Progress {
        let kind = if quiet { ProgressKind::Off } else { self.progress };
        Progress::new(Look::new(kind, io::stderr().is_terminal()))
    }
}

/// What is shown where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    Bar,
    Lines { each_step: bool, first: Duration },
    Off,
}

impl Look {
    fn new(kind: ProgressKind, terminal: bool) -> Self {
        match (kind, terminal) {
            (ProgressKind::Off, _) => Self::Off,
            (ProgressKind::Auto | ProgressKind::Bar, true) => Self::Bar,
            (ProgressKind::Auto | ProgressKind::Bar, false) => {
                Self::Lines { each_step: false, first: BETWEEN_LINES }
            }
            (ProgressKind::Lines, _) => Self::Lines { each_step: true, first: Duration::ZERO },
        }
    }
}

/// What is being done.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ProgressStep {
    what: String,
    /// How much of it is done, and how much there is; 0 where nobody knows.
    done: usize,
    total: usize,
    unit: &'static str,
}

impl ProgressStep {
    /// One line.
    fn line(&self, seconds: u64) -> String {
        let amount = match self.total {
            0 => String::new(),
            total => format!(", {} of {} {}", count(self.done), count(total), self.unit),
        };
        format!("{}{amount}, {seconds} s", self.what)
    }
}

/// When the next line is due.
#[derive(Debug)]
struct LineClock {
    next: Duration,
}

impl LineClock {
    /// Whether a line is due at `now`; if it is, the next one is due 10 seconds later.
    fn is_due(&mut self, now: Duration) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + BETWEEN_LINES;
        }
        due
    }
}

#[derive(Debug)]
struct ProgressState {
    step: Option<ProgressStep>,
    ended: bool,
    bar: Option<ProgressBar>,
    lines: LineClock,
}

#[derive(Debug)]
struct Shared {
    look: Look,
    begun: Instant,
    state: Mutex<ProgressState>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, ProgressState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self, step: &ProgressStep) {
        // Who has closed standard error does not want to know.
        let _ = writeln!(io::stderr(), "{}", step.line(self.begun.elapsed().as_secs()));
    }

    /// Shows bars and lines until the end.
    fn tick(&self) {
        let mut state = self.state();
        while !state.ended {
            let now = self.begun.elapsed();
            match self.look {
                Look::Bar if now >= PATIENCE => show_bar(&mut state),
                Look::Lines { .. } => {
                    if let Some(step) = state.step.clone()
                        && state.lines.is_due(now)
                    {
                        self.write(&step);
                    }
                }
                Look::Bar | Look::Off => {}
            }
            let wait = if state.bar.is_some() { 100 } else { 200 };
            let waited = self.changed.wait_timeout(state, Duration::from_millis(wait));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// Brings the bar in line with the step.
fn show_bar(state: &mut ProgressState) {
    let Some(step) = &state.step else { return };
    let bar = state.bar.get_or_insert_with(ProgressBar::new_spinner);
    let template = if step.total > 0 {
        "{msg} {wide_bar} {pos}/{len} {prefix}, {eta} left"
    } else {
        "{spinner} {msg}, {elapsed}"
    };
    if bar.length() != Some(step.total as u64) || bar.message() != step.what {
        bar.set_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        bar.set_length(step.total as u64);
        bar.set_message(step.what.clone());
        bar.set_prefix(step.unit);
        bar.reset_eta();
    }
    bar.set_position(step.done as u64);
    bar.tick();
}

/// Shows what is being done, until it is dropped. Cheap to call as often as one likes.
#[derive(Debug)]
pub struct Progress {
    shared: Arc<Shared>,
    ticker: Option<JoinHandle<()>>,
}

impl Progress {
    fn new(look: Look) -> Self {
        let first = if let Look::Lines { first, .. } = look { first } else { Duration::ZERO };
        let state = ProgressState { step: None, ended: false, bar: None, lines: LineClock { next: first } };
        let (state, changed) = (Mutex::new(state), Condvar::new());
        let shared = Arc::new(Shared { look, begun: Instant::now(), state, changed });
        let ticking = shared.clone();
        // Without a thread there are no signs of life, and the work goes on.
        let ticker = (look != Look::Off)
            .then(|| std::thread::Builder::new().name("progress".into()).spawn(move || ticking.tick()).ok());
        Self { shared, ticker: ticker.flatten() }
    }

    /// A bar on a terminal; elsewhere a line each 10 seconds.
    pub fn auto() -> Self {
        ProgressArgs { progress: ProgressKind::Auto }.start(false)
    }

    /// Nothing is shown.
    pub fn off() -> Self {
        Self::new(Look::Off)
    }

    /// A step begins, whose length nobody knows, such as `reading a.ply`.
    pub fn step(&self, what: impl Into<String>) {
        self.begin(ProgressStep { what: what.into(), done: 0, total: 0, unit: "" });
    }

    /// A step of `total` parts begins; `unit` names several of them, such as `pairs`.
    pub fn counted(&self, what: impl Into<String>, total: usize, unit: &'static str) {
        self.begin(ProgressStep { what: what.into(), done: 0, total, unit });
    }

    fn begin(&self, step: ProgressStep) {
        if self.shared.look == Look::Off {
            return;
        }
        let mut state = self.shared.state();
        if let Look::Lines { each_step: true, .. } = self.shared.look {
            self.shared.write(&step);
            state.lines.next = self.shared.begun.elapsed() + BETWEEN_LINES;
        }
        state.step = Some(step);
    }

    /// More parts of the step are done.
    pub fn advance(&self, parts: usize) {
        if let Some(step) = &mut self.shared.state().step {
            step.done += parts;
        }
    }

    /// Puts what is shown away, before something else is written to the terminal. Another step may follow.
    pub fn clear(&self) {
        let mut state = self.shared.state();
        state.step = None;
        if let Some(bar) = state.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
        self.shared.state().ended = true;
        self.shared.changed.notify_all();
        if let Some(ticker) = self.ticker.take() {
            let _ = ticker.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_on_a_terminal_and_lines_elsewhere() {
        let seldom = Look::Lines { each_step: false, first: BETWEEN_LINES };
        let each = Look::Lines { each_step: true, first: Duration::ZERO };
        for (kind, terminal, look) in [
            (ProgressKind::Auto, true, Look::Bar),
            (ProgressKind::Auto, false, seldom),
            (ProgressKind::Bar, false, seldom),
            (ProgressKind::Lines, true, each),
            (ProgressKind::Lines, false, each),
            (ProgressKind::Off, true, Look::Off),
        ] {
            assert_eq!(Look::new(kind, terminal), look, "{kind:?}, {terminal}");
        }
    }

    #[test]
    fn a_line_each_ten_seconds() {
        let mut clock = LineClock { next: BETWEEN_LINES };
        let due: Vec<u64> = (0..45).filter(|s| clock.is_due(Duration::from_secs(*s))).collect();
        assert_eq!(due, [10, 20, 30, 40]);
    }

    #[test]
    fn lines_say_what_and_how_much() {
        let mut step = ProgressStep { what: "registering".into(), done: 1234, total: 20_000, unit: "pairs" };
        assert_eq!(step.line(12), "registering, 1,234 of 20,000 pairs, 12 s");
        step.total = 0;
        assert_eq!(step.line(3), "registering, 3 s");
    }

    #[test]
    fn steps_come_and_go() {
        for look in [Look::Off, Look::Bar, Look::Lines { each_step: false, first: BETWEEN_LINES }] {
            let progress = Progress::new(look);
            progress.counted("pairs", 3, "pairs");
            progress.advance(2);
            let done = progress.shared.state().step.as_ref().map(|step| step.done);
            assert_eq!(done, (look != Look::Off).then_some(2));
            progress.clear();
            assert_eq!(progress.shared.state().step, None);
            progress.step("more");
        }
    }
}
