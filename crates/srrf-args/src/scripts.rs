//! [`Scripts`]: completions and manual pages, the same for every program.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Command, Subcommand};
use clap_complete::Shell;
use clap_mangen::Man;

use crate::Output;
use crate::failure::Failure;
use crate::files;

/// What every program writes about itself.
#[derive(Debug, Clone, Subcommand)]
pub enum Scripts {
    /// Write the completions for a shell to standard output
    Completions(CompletionsArgs),
    /// Write manual pages, one for the program and one for each of its commands
    Man(ManArgs),
}

/// Which completions to write.
#[derive(Debug, Clone, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Where to write manual pages.
#[derive(Debug, Clone, Args)]
pub struct ManArgs {
    /// The folder; it is made where it does not exist
    folder: PathBuf,
}

impl Scripts {
    /// Writes what was asked for about `command`.
    ///
    /// # Errors
    /// [`Failure`] where it cannot be written.
    pub fn run(&self, mut command: Command) -> Result<ExitCode, Failure> {
        match self {
            Self::Completions(args) => {
                let mut script = Vec::new();
                let name = command.get_name().to_owned();
                clap_complete::generate(args.shell, &mut command, name, &mut script);
                files::write(Path::new("-"), &script)?;
            }
            Self::Man(args) => {
                let cannot = |e| Failure::failed(format!("cannot write {:?}: {e}", args.folder)).because(e);
                fs::create_dir_all(&args.folder).map_err(cannot)?;
                command.build();
                let mut written = Vec::new();
                write_pages(&command, &args.folder, &mut written)?;
                Output::Standard.say(&format!("wrote {}: {}", args.folder.display(), written.join(", ")));
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The page of `command` and those of its commands.
fn write_pages(command: &Command, folder: &Path, written: &mut Vec<String>) -> Result<(), Failure> {
    let page = Man::new(command.clone());
    let file = page.get_filename();
    let mut text = Vec::new();
    page.render(&mut text)
        .map_err(|e| Failure::failed(format!("cannot write the page {file}: {e}")).because(e))?;
    files::write(&folder.join(&file), &text)?;
    written.push(file);
    let mut commands = command.get_subcommands().filter(|c| c.get_name() != "help" && !c.is_hide_set());
    commands.try_for_each(|inner| write_pages(inner, folder, written))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    /// A program.
    #[derive(Parser)]
    #[command(name = "weather", version)]
    struct Arguments {
        #[command(subcommand)]
        _scripts: Scripts,
    }

    #[test]
    fn every_command_has_its_page() {
        let folder = tempfile::tempdir().unwrap();
        let args = ManArgs { folder: folder.path().join("man") };
        Scripts::Man(args).run(<Arguments as clap::CommandFactory>::command()).unwrap();
        let page = |name: &str| fs::read_to_string(folder.path().join("man").join(name)).unwrap();
        assert!(page("weather.1").contains("A program"));
        assert!(page("weather-completions.1").contains("powershell"));
        assert!(page("weather-man.1").contains("The folder"));
    }
}
