//! One dialect: the same flag means the same thing in the four programs, and is said in the same words.

use std::collections::BTreeMap;

use clap::{Arg, Command};

/// Flags that say what a verb writes or draws: each verb says it of its own output. Their value is the same
/// everywhere but for a folder instead of a file.
const OF_THE_VERB: [&str; 8] = ["output", "json", "html", "png", "save", "initial", "max-memory", "up"];

/// The four programs with all their verbs, by name.
fn verbs() -> Vec<(String, Command)> {
    let mut found = Vec::new();
    let programs = [
        srrf::cli::command(),
        srrf_corrupt::cli::command(),
        srrf_eval::command(),
        srrf_train::cli::command(),
    ];
    for mut program in programs {
        program.build();
        collect(program.get_name().to_owned(), &program, &mut found);
    }
    found
}

fn collect(name: String, command: &Command, found: &mut Vec<(String, Command)>) {
    found.push((name.clone(), command.clone()));
    for inner in command.get_subcommands().filter(|c| c.get_name() != "help") {
        collect(format!("{name} {}", inner.get_name()), inner, found);
    }
}

fn flags(command: &Command) -> impl Iterator<Item = (&str, &Arg)> {
    let of_clap = ["help", "version"];
    command
        .get_arguments()
        .filter_map(|a| Some((a.get_long()?, a)))
        .filter(move |(n, _)| !of_clap.contains(n))
}

fn value_name(arg: &Arg) -> String {
    if !arg.get_action().takes_values() {
        return "none".into();
    }
    arg.get_value_names().unwrap_or_default().join(" ")
}

/// What differs, a line each: the flag, and what the verbs say of it.
fn differences(read: impl Fn(&str, &Arg) -> Option<String>) -> Vec<String> {
    let mut said: BTreeMap<String, BTreeMap<String, Vec<String>>> = BTreeMap::new();
    for (verb, command) in verbs() {
        for (flag, arg) in flags(&command) {
            if let Some(text) = read(flag, arg) {
                said.entry(flag.to_owned()).or_default().entry(text).or_default().push(verb.clone());
            }
        }
    }
    said.retain(|_, texts| texts.len() > 1);
    said.iter().map(|(flag, texts)| format!("--{flag}: {texts:?}")).collect()
}

#[test]
fn one_help_for_one_flag() {
    let help = |flag: &str, arg: &Arg| {
        (!OF_THE_VERB.contains(&flag)).then(|| arg.get_help().map(ToString::to_string).unwrap_or_default())
    };
    let found = differences(help);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn one_name_of_the_value_for_one_flag() {
    let found = differences(|flag, arg| {
        let name = value_name(arg);
        // `--json` of `inspect` prints, that of `register` writes a file; reports are folders.
        (!OF_THE_VERB.contains(&flag)).then_some(name)
    });
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn one_short_letter_for_one_flag() {
    let found = differences(|_, arg| Some(arg.get_short().map(String::from).unwrap_or_default()));
    assert!(found.is_empty(), "{found:#?}");
    let mut letters: BTreeMap<char, String> = BTreeMap::new();
    for (verb, command) in verbs() {
        for (flag, arg) in flags(&command) {
            let Some(letter) = arg.get_short() else { continue };
            let before = letters.entry(letter).or_insert_with(|| flag.to_owned());
            assert_eq!(before, flag, "-{letter} of {verb}");
        }
    }
}

#[test]
fn every_flag_is_explained_in_one_style() {
    for (verb, command) in verbs() {
        for (flag, arg) in flags(&command).filter(|(_, arg)| !arg.is_hide_set()) {
            let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
            assert!(!help.is_empty() && !help.ends_with('.'), "{verb} --{flag}: {help:?}");
            if arg.get_action().takes_values() && arg.get_possible_values().is_empty() {
                let name = value_name(arg);
                let upper = name.chars().all(|c| !c.is_lowercase()) || name.contains('.');
                assert!(upper && !name.contains('_'), "{verb} --{flag} <{name}>");
            }
        }
    }
}

#[test]
fn every_program_has_completions_manual_pages_a_version_and_exit_codes() {
    for program in ["srrf", "srrf-corrupt", "srrf-eval", "srrf-train"] {
        let command = verbs().into_iter().find(|(name, _)| name == program).map(|(_, c)| c);
        let command = command.unwrap_or_else(|| panic!("{program} is there"));
        for verb in ["completions", "man"] {
            assert!(command.find_subcommand(verb).is_some(), "{program} {verb}");
        }
        assert_eq!(command.get_version(), Some(env!("CARGO_PKG_VERSION")));
        let after = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for code in ["Exit codes:", "0    done", "1    failure", "2    bad usage", "130  interrupted"] {
            assert!(after.contains(code), "{program}: {code} in {after:?}");
        }
    }
}

#[test]
fn corrupt_is_one_verb() {
    let all = verbs();
    let of = |name: &str| {
        let (_, command) = all.iter().find(|(verb, _)| verb == name).unwrap_or_else(|| panic!("{name}"));
        let arguments = command.get_arguments().map(|a| (a.get_id().to_string(), value_name(a)));
        arguments.filter(|(id, _)| !["help", "version"].contains(&id.as_str())).collect::<Vec<_>>()
    };
    assert_eq!(of("srrf corrupt"), of("srrf-corrupt"));
}

#[test]
fn old_spellings_are_understood() {
    let understood = |mut program: Command, arguments: &str| {
        let words =
            [program.get_name().to_owned()].into_iter().chain(arguments.split(' ').map(str::to_owned));
        program.try_get_matches_from_mut(words).map(|_| ()).map_err(|e| e.to_string())
    };
    for arguments in [
        "corrupt a.ply b.ply -t cutout",
        "corrupt a.ply b.ply --type cutout -s 5",
        "skeleton a.ply b.ply",
        "batch pairs.csv --out results.jsonl",
        "register a.ply b.ply --rotation 180",
    ] {
        assert_eq!(understood(srrf::cli::command(), arguments), Ok(()), "srrf {arguments}");
    }
    for arguments in
        ["a.ply -c cutout -o b.ply --variants modelnet40-c --drop-nan", "sheet -o a.png --variants paper"]
    {
        assert_eq!(understood(srrf_corrupt::cli::command(), arguments), Ok(()), "srrf-corrupt {arguments}");
    }
    for arguments in ["--out report --variants modelnet40_c", "tables --out report"] {
        assert_eq!(understood(srrf_eval::command(), arguments), Ok(()), "srrf-eval {arguments}");
    }
}
