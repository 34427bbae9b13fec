//! Seconds and memory that reading a cloud takes: `read_speed FILE [TIMES]`. Prints JSON with the fastest of them.
//!
//! `scripts/speed_reading.py` compares it with other readers.

#![allow(clippy::print_stdout, reason = "a program")]

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use srrf_cloud::io::CloudFile;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("read_speed FILE [TIMES]")?);
    let times: usize = arguments.next().map_or(Ok(1), |times| times.parse())?;
    let before = peak()?;
    let (mut seconds, mut points, mut sum) = (f64::INFINITY, 0, 0.0);
    for _ in 0..times.max(1) {
        let begun = Instant::now();
        let contents = CloudFile::open(&path)?.contents()?;
        seconds = seconds.min(begun.elapsed().as_secs_f64());
        points = contents.points.len();
        sum = contents.points.iter().flatten().sum();
    }
    let memory = peak()? - before;
    println!("{{\"seconds\": {seconds}, \"bytes\": {memory}, \"points\": {points}, \"sum\": {sum}}}");
    Ok(())
}

/// Most bytes of memory that the process has had.
fn peak() -> Result<u64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no VmHWM")?;
    Ok(1024 * line.trim().trim_end_matches(" kB").parse::<u64>()?)
}
