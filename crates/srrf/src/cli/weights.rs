//! `srrf weights`: what models there are, their cards and configurations, and whether a file is whole.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};
use srrf_model::weights::{LoadedModel, with_config};
use srrf_model::{SrrfConfig, device, embedded};

use srrf_args::words::{count, visible};
use srrf_args::{Failure, OutputKind, Places, files};

/// List the models in the program, show their cards, check files of weights.
#[derive(Debug, Args)]
pub struct WeightsArgs {
    #[command(subcommand)]
    command: Option<WeightsCommand>,
}

#[derive(Debug, Subcommand)]
enum WeightsCommand {
    /// List the models in the program (the default)
    List,
    /// Show the card of a model: what it was trained on, how well it does, where it fails
    Show {
        /// Its name; with --header also a file
        name: String,
        /// Print the configuration in the header instead: the sizes of the network, and how it is used
        #[arg(long)]
        header: bool,
    },
    /// Write weights with another configuration in the header: how the network is used; its sizes stay
    Write {
        /// A file, or the name of a model in the program
        name: String,
        /// The configuration, as `srrf weights show NAME --header` prints it
        #[arg(long, value_name = "FILE")]
        used_as: PathBuf,
        /// The file to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Load weights, check that all numbers are finite, and print their SHA-256
    Verify {
        /// A file, or the name of a model in the program
        weights: String,
        /// The SHA-256 that it should have, in hexadecimal, or its first 8 digits or more
        #[arg(long, value_name = "HEX")]
        sha256: Option<String>,
    },
}

/// Lists, shows or checks.
///
/// # Errors
/// [`Failure`], with its exit code.
pub fn run(args: &WeightsArgs) -> Result<ExitCode, Failure> {
    let text = match &args.command {
        None | Some(WeightsCommand::List) => list()?,
        Some(WeightsCommand::Show { name, header: false }) => show(name)?.to_owned(),
        Some(WeightsCommand::Show { name, header: true }) => show_config(name)?,
        Some(WeightsCommand::Write { name, used_as, output }) => match write(name, used_as, output)? {
            Some(said) => said,
            None => return Ok(ExitCode::SUCCESS),
        },
        Some(WeightsCommand::Verify { weights, sha256 }) => verify(weights, sha256.as_deref())?,
    };
    files::write(Path::new("-"), format!("{}\n", text.trim_end()).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn list() -> Result<String, Failure> {
    let mut lines = Vec::new();
    for (i, name) in embedded::names().enumerate() {
        let loaded = open(name)?;
        let default = if i == 0 { ", the default" } else { "" };
        lines.push(format!(
            "{name:14} {} parameters, SHA-256 {}...{default}",
            count(loaded.parameter_count()),
            &loaded.sha256[..16]
        ));
    }
    lines.push("`srrf weights show NAME` prints the card of a model".to_owned());
    Ok(lines.join("\n"))
}

fn show(name: &str) -> Result<&'static str, Failure> {
    let model = embedded::model(name).filter(|model| model.registers);
    model.map(|model| model.weights.card).ok_or_else(|| unknown(name))
}

fn show_config(name: &str) -> Result<String, Failure> {
    toml::to_string(&open(name)?.config).map_err(Failure::other)
}

/// Writes the weights `name` with the configuration of a file.
fn write(name: &str, used_as: &Path, output: &Path) -> Result<Option<String>, Failure> {
    let of_file = Some(Path::new(name)).filter(|path| path.is_file());
    let places = Places::new().reads("the weights", of_file).reads("--used-as", used_as);
    places.writes("--output", output, OutputKind::WEIGHTS)?.check()?;
    let input = |source: std::io::Error, path: &Path| {
        Failure::usage(format!("{}: {source}", path.display())).because(source)
    };
    let text = std::fs::read_to_string(used_as).map_err(|e| input(e, used_as))?;
    let changed: SrrfConfig = toml::from_str(&text).map_err(|e| {
        Failure::usage(format!("{}: {}", used_as.display(), e.to_string().trim_end())).because(e)
    })?;
    let bytes = match embedded::model(name) {
        Some(model) => model.weights.bytes.to_vec(),
        None if !Path::new(name).exists() => return Err(unknown(name)),
        None => std::fs::read(name).map_err(|e| input(e, Path::new(name)))?,
    };
    let written = with_config(&bytes, name, &changed).map_err(Failure::input)?;
    files::write(output, &written)?;
    if output == Path::new("-") {
        return Ok(None); // nothing else may follow the bytes
    }
    Ok(Some(format!("wrote {}: {name} with the configuration of {}", output.display(), used_as.display())))
}

fn verify(weights: &str, sha256: Option<&str>) -> Result<String, Failure> {
    let loaded = open(weights)?;
    if let Some(wanted) = sha256 {
        let wanted = wanted.trim().to_ascii_lowercase();
        if wanted.len() < 8 || !wanted.chars().all(|c| c.is_ascii_hexdigit()) {
            return Err(Failure::usage(format!("--sha256 {wanted}: give 8 to 64 hexadecimal digits")));
        }
        if !loaded.sha256.starts_with(&wanted) {
            return Err(Failure::usage(format!(
                "{weights:?}: its SHA-256 is {}, not {wanted}; the file is damaged or another one, get it again",
                loaded.sha256
            )));
        }
    }
    let mut same = String::new();
    for name in embedded::names() {
        if open(name)?.sha256 == loaded.sha256 {
            same = format!("\nthe same as {name} in this program");
        }
    }
    // What others wrote is one line, and commands no terminal.
    let name = visible(&loaded.name).replace('\n', " ");
    let matches = if sha256.is_some() { "\nthe SHA-256 is the one that was asked for" } else { "" };
    Ok(format!(
        "{weights}: {}, complete, {} parameters, all finite\nSHA-256 {}{same}{matches}",
        name,
        count(loaded.parameter_count()),
        loaded.sha256
    ))
}

fn open(weights: &str) -> Result<LoadedModel, Failure> {
    let device = device("flex").map_err(|e| Failure::failed(e.to_string()))?;
    embedded::open(weights, &device).map_err(|e| Failure::usage(e.to_string()))
}

fn unknown(name: &str) -> Failure {
    Failure::usage(embedded::unknown(name).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_has_its_card() {
        assert_eq!(
            embedded::names().collect::<Vec<_>>(),
            embedded::MODELS.iter().filter(|m| m.registers).map(|m| m.name).collect::<Vec<_>>()
        );
        for name in embedded::names() {
            assert!(show(name).unwrap().starts_with(&format!("# {name}")));
        }
        assert!(show("srrf-large").unwrap_err().to_string().contains("srrf-small"));
    }
}
