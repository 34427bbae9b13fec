//! [`Meta`]: where a result comes from.

use std::collections::BTreeMap;
use std::fs;

use serde::Serialize;

/// Where a result comes from: what is needed to get it again.
#[derive(Debug, Clone, Serialize)]
pub struct Meta {
    /// Version of this program.
    pub version: String,
    /// The command line.
    pub command: String,
    /// The data, the split, and how the pairs were made.
    pub data: String,
    /// Seed of the pairs.
    pub seed: u64,
    /// For each method that learns, its weights.
    pub weights: BTreeMap<String, String>,
    /// Where tensors lived.
    pub device: String,
    /// Worker threads.
    pub threads: usize,
    /// Processor and number of cores.
    pub machine: String,
    /// Duration of the whole run, in seconds.
    pub seconds: f64,
    /// Start of the run, in seconds since 1970.
    pub started_unix: u64,
}

impl Meta {
    /// The lines above the tables.
    pub(crate) fn head(&self) -> String {
        let mut head = format!("- Data: {}\n- Seed: {}\n", self.data, self.seed);
        for (method, weights) in &self.weights {
            head += &format!("- Weights of {method}: {weights}\n");
        }
        head + &format!(
            "- Run: version {}, {:.0} s on {} threads of {}, device {}\n- Command: `{}`\n",
            self.version, self.seconds, self.threads, self.machine, self.device, self.command
        )
    }
}

/// Processor and number of cores of this machine, as far as the system tells.
pub fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let model = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("model name"))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    });
    format!("{} with {cores} cores", model.unwrap_or_else(|| std::env::consts::ARCH.to_owned()))
}
