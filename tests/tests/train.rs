//! Training through its front door: resume, kill, threads, bad input, a full disk.

#![allow(clippy::unwrap_used, reason = "a test may fail loudly")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use safetensors::SafeTensors;
use srrf_tests::{program, refuses, run};

const CONFIG: &str = "configs/smoke.toml";

/// Every tensor of a checkpoint that belongs to the network, as bytes.
fn parameters(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let bytes = std::fs::read(folder.join("checkpoint.safetensors")).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let model = tensors.tensors().into_iter().filter(|(name, _)| name.starts_with("model."));
    let found: BTreeMap<_, _> = model.map(|(name, view)| (name, view.data().to_vec())).collect();
    assert!(found.len() > 50, "a network has parameters");
    found
}

fn train(folder: &Path, more: &[&str]) {
    let folder = folder.to_str().unwrap();
    let (code, said) = run("srrf-train", &[&["--config", CONFIG, "--run", folder], more].concat());
    assert_eq!(code, 0, "{said}");
}

#[test]
fn killed_and_resumed_with_other_threads_equals_one_session() {
    let scratch = tempfile::tempdir().unwrap();
    let straight = scratch.path().join("straight");
    train(&straight, &["--threads", "2"]);

    let killed = scratch.path().join("killed");
    let mut child = program("srrf-train")
        .args(["--config", CONFIG, "--run", killed.to_str().unwrap(), "--threads", "1"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // Kill as soon as there is a checkpoint, wherever the run stands then.
    let started = Instant::now();
    while !killed.join("checkpoint.safetensors").exists() {
        assert!(started.elapsed() < Duration::from_secs(120), "no checkpoint appeared");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    train(&killed, &["--resume", "--threads", "2", "--until-step", "13"]);
    train(&killed, &["--resume", "--threads", "1"]);

    assert!(parameters(&straight) == parameters(&killed), "the parameters differ");
    for file in ["metrics.jsonl", "curve.svg"] {
        let [one, other] =
            [&straight, &killed].map(|folder| std::fs::read_to_string(folder.join(file)).unwrap());
        assert_eq!(one, other, "{file}");
    }
    for file in ["best.safetensors", "last.safetensors", "curve.svg", "config.toml", "metrics.jsonl"] {
        assert!(killed.join(file).metadata().unwrap().len() > 0, "{file}");
    }
}

#[test]
fn a_run_is_not_overwritten_without_a_word() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    train(&folder, &["--until-step", "1"]);
    let path = folder.to_str().unwrap();
    refuses("srrf-train", &["--config", CONFIG, "--run", path], &[path, "step 1", "--resume", "--restart"]);
    train(&folder, &["--until-step", "2", "--restart"]);
}

#[test]
fn a_checkpoint_of_another_configuration_is_refused() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    train(&folder, &["--until-step", "1"]);
    let text = std::fs::read_to_string(srrf_tests::workspace().join(CONFIG)).unwrap();
    let other = scratch.path().join("other.toml");
    std::fs::write(&other, text.replace("skeleton_points = 12", "skeleton_points = 13")).unwrap();
    let arguments = ["--config", other.to_str().unwrap(), "--run", folder.to_str().unwrap(), "--resume"];
    refuses("srrf-train", &arguments, &["checkpoint.safetensors", "network.sem.skeleton_points", "another"]);

    // A truncated checkpoint is named, too, and is left where it is.
    let file = folder.join("checkpoint.safetensors");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    let arguments = ["--config", CONFIG, "--run", folder.to_str().unwrap(), "--resume"];
    refuses("srrf-train", &arguments, &["checkpoint.safetensors", "not a usable checkpoint"]);
    assert_eq!(std::fs::read(&file).unwrap().len(), bytes.len() / 2);
}

#[test]
fn a_run_starts_from_parts_of_others() {
    let scratch = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(srrf_tests::workspace().join(CONFIG)).unwrap();
    let path = |name: &str| scratch.path().join(name).to_str().unwrap().to_string();
    let configured = |name: &str, start: &str, seed: usize| {
        let start = format!("seed = {seed}\n{start}");
        std::fs::write(path(&format!("{name}.toml")), text.replacen("seed = 3", &start, 1)).unwrap();
        [path(&format!("{name}.toml")), path(name)]
    };
    let begin = |[config, folder]: [String; 2]| {
        let (code, said) = run("srrf-train", &["--config", &config, "--run", &folder, "--until-step", "0"]);
        assert_eq!(code, 0, "{said}");
        parameters(Path::new(&folder))
    };
    let (a, b) = (begin(configured("a", "", 3)), begin(configured("b", "", 4)));
    let [from_a, from_b] = ["a", "b"].map(|run| path(&format!("{run}/last.safetensors")));
    let start = format!("start = {{ sem = \"{from_a}\", dense = \"{from_b}\" }}");
    let mixed = begin(configured("mixed", &start, 5));
    for (name, values) in &mixed {
        // Weights are exported in half precision, so that the first runs' own values are near, not equal.
        let near = |other: &[u8]| {
            let numbers = |bytes: &[u8]| -> Vec<f32> {
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
            };
            numbers(values).iter().zip(numbers(other)).all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs() + 1e-6)
        };
        if name.starts_with("model.sem.") {
            assert!(near(&a[name]), "{name}");
        } else if name.starts_with("model.dense.") {
            assert!(near(&b[name]), "{name}");
        } else if name.ends_with("weight") {
            assert!(!near(&a[name]) && !near(&b[name]), "{name}");
        }
    }
    let wrong = format!("start = {{ hands = \"{from_a}\" }}");
    let [config, folder] = configured("wrong", &wrong, 5);
    refuses("srrf-train", &["--config", &config, "--run", &folder], &["`hands`", "does not fit", "start"]);
    let [config, folder] = configured("nothing", "start = { sem = \"no/such.safetensors\" }", 5);
    refuses(
        "srrf-train",
        &["--config", &config, "--run", &folder],
        &["start", "no/such.safetensors", "no such file"],
    );
    let [config, _] = configured("number", "start = 5", 5);
    refuses("srrf-train", &["--config", &config], &["number.toml", "start", "a table of them by part"]);
}

#[test]
fn bad_configurations_are_refused_by_key() {
    let scratch = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(srrf_tests::workspace().join(CONFIG)).unwrap();
    let path = scratch.path().join("bad.toml");
    let arguments = ["--config", path.to_str().unwrap()];
    refuses("srrf-train", &arguments, &["bad.toml", "No such file"]);
    for (from, to, words) in [
        ("seed = 3", "seed = 3\nsede = 4", &["bad.toml", "unknown field `sede`"][..]),
        ("batch = 8", "batch = 7", &["bad.toml", "optimizer.batch", "multiple"][..]),
        (
            "severities = [1, 3, 5]",
            "severities = [9]",
            &["bad.toml", "draw.severities[0]", "between 1 and 5"][..],
        ),
        ("clean = 0.1", "clean = 1.5", &["bad.toml", "draw.clean", "between 0 and 1"][..]),
        ("epochs = 2.4", "epochs = -1", &["bad.toml", "stages[2].epochs"][..]),
        ("heads = 2, mlp", "heads = 3, mlp", &["bad.toml", "sfe.heads", "divide"][..]),
        ("name = \"smoke\"", "name = \"..\"", &["bad.toml", "`name`", "file name"][..]),
        ("weight_decay = 1e-4", "weight_decay = nan", &["bad.toml", "optimizer.weight_decay", "NaN"][..]),
        ("clip_norm = 1.0", "clip_norm = nan", &["bad.toml", "optimizer.clip_norm", "NaN"][..]),
        ("clip_norm = 1.0", "clip_norm = inf", &["bad.toml", "optimizer.clip_norm", "inf"][..]),
        ("beta_2 = 0.999", "beta_2 = 2", &["bad.toml", "optimizer.beta_2", "less than 1"][..]),
        ("residual_translation = 0.1", "residual_translation = 1e308", &["draw.residual_translation"][..]),
        (
            "of_epochs = 250.0",
            "of_epochs = 0",
            &["stages[2].schedule.milestones.of_epochs", "more than 0"][..],
        ),
        ("batch = 8", "batch = 80000000", &["bad.toml", "optimizer.batch", "between 1 and"][..]),
        ("shapes = 48", "shapes = 480000000000", &["bad.toml", "data.shapes", "between 1 and"][..]),
        ("points = 128", "points = 1280000000", &["bad.toml", "pairs.points", "between 3 and"][..]),
        ("width = 8, heads", "width = 8000000, heads", &["network.dense.sfe.width", "between 1 and"][..]),
        ("layers = 2", "layers = 2000000", &["network.dense.sfe.layers", "between 1 and"][..]),
        ("learning_rate = 1e-3", "learning_rate = nan", &["stages[0].learning_rate", "NaN"][..]),
        ("kind = \"adam\"", "kind = \"lion\"", &["bad.toml", "unknown variant `lion`"][..]),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        refuses("srrf-train", &arguments, words);
    }
}

#[test]
fn a_configuration_may_say_only_what_it_changes() {
    let scratch = tempfile::tempdir().unwrap();
    let base = srrf_tests::workspace().join(CONFIG);
    let small = scratch.path().join("small.toml");
    let arguments = ["--config", small.to_str().unwrap()];
    let extends = format!("extends = {base:?}\n");
    for (more, words) in [
        ("sede = 4\n", &["small.toml", "`sede`", "unknown field"][..]),
        ("[draw]\nclean = 1.5\n", &["small.toml", "draw.clean", "between 0 and 1"][..]),
        ("[network.dense]\ntokens = \"all\"\n", &["small.toml", "network.dense.tokens", "invalid type"][..]),
        ("[optimizer]\nbatch = 9\n", &["small.toml", "optimizer.batch", "multiple"][..]),
    ] {
        std::fs::write(&small, format!("{extends}{more}")).unwrap();
        refuses("srrf-train", &arguments, words);
    }
    std::fs::write(&small, "extends = \"small.toml\"\n").unwrap();
    refuses("srrf-train", &arguments, &["small.toml", "extends itself"]);
    std::fs::write(&small, "extends = \"nothing.toml\"\n").unwrap();
    refuses("srrf-train", &arguments, &["small.toml", "nothing.toml", "No such file"]);

    // What runs is the whole, and is written down so.
    std::fs::write(&small, format!("{extends}name = \"small\"\n[optimizer]\nbatch = 4\n")).unwrap();
    let run_folder = scratch.path().join("run");
    let folder = run_folder.to_str().unwrap();
    let (code, said) = run("srrf-train", &["--config", arguments[1], "--run", folder, "--until-step", "1"]);
    assert_eq!(code, 0, "{said}");
    let resolved = std::fs::read_to_string(run_folder.join("config.toml")).unwrap();
    assert!(resolved.contains("batch = 4") && resolved.contains("skeleton_points = 12"), "{resolved}");
    assert!(!resolved.contains("extends"), "{resolved}");
}

#[test]
fn a_restart_that_cannot_begin_harms_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    train(&folder, &["--until-step", "2"]);
    let before = parameters(&folder);
    let text = std::fs::read_to_string(srrf_tests::workspace().join(CONFIG)).unwrap();
    let wrong = scratch.path().join("wrong.toml");
    std::fs::write(&wrong, text.replacen("seed = 3", "seed = 3\nstart = \"no/such.safetensors\"", 1))
        .unwrap();
    let path = folder.to_str().unwrap();
    let arguments = ["--config", wrong.to_str().unwrap(), "--run", path, "--restart"];
    refuses("srrf-train", &arguments, &["start", "no/such.safetensors"]);
    assert!(parameters(&folder) == before);
    for file in ["last.safetensors", "metrics.jsonl", "config.toml"] {
        assert!(folder.join(file).exists(), "{file}");
    }
    // One without a step has nothing to put in its place.
    for no_time in [["--until-step", "0"], ["--minutes", "0"]] {
        let arguments = [&["--config", CONFIG, "--run", path, "--restart"][..], &no_time].concat();
        let (code, said) = run("srrf-train", &arguments);
        assert!(code == 0 && said.contains("no step was done"), "{code}: {said}");
        assert!(parameters(&folder) == before);
        assert!(folder.join("last.safetensors").exists() && !folder.join("before-restart").exists());
    }
    // One that begins replaces it, and leaves nothing behind.
    train(&folder, &["--until-step", "1", "--restart"]);
    assert!(parameters(&folder) != before);
    assert!(!folder.join("before-restart").exists());
}

/// A run may be started from the configuration that it left, but not write what else it reads.
#[test]
fn a_run_writes_nothing_that_it_reads() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    train(&folder, &["--until-step", "1"]);
    let resolved = folder.join("config.toml");
    let [path, config] = [&folder, &resolved].map(|path| path.to_str().unwrap());
    let again = ["--config", config, "--run", path, "--resume", "--until-step", "2"];
    assert_eq!(run("srrf-train", &again).0, 0);
    let text = std::fs::read_to_string(&resolved).unwrap();
    std::fs::write(&resolved, format!("# mine\n{text}")).unwrap();
    refuses("srrf-train", &again, &["config.toml", "the configuration", "would be lost"]);
    assert!(std::fs::read_to_string(&resolved).unwrap().starts_with("# mine"));
    let start = format!("start = \"{path}/last.safetensors\"\n{text}");
    let other = scratch.path().join("other.toml");
    std::fs::write(&other, start).unwrap();
    let arguments = ["--config", other.to_str().unwrap(), "--run", path, "--restart"];
    refuses("srrf-train", &arguments, &["last.safetensors", "`start`", "would be lost"]);
}

/// Any bit that turned over in a checkpoint is noticed.
#[test]
fn a_damaged_checkpoint_is_not_used() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    train(&folder, &["--until-step", "1"]);
    let file = folder.join("checkpoint.safetensors");
    let whole = std::fs::read(&file).unwrap();
    let header = 8 + u64::from_le_bytes(whole[..8].try_into().unwrap()) as usize;
    let progress = whole.windows(8).position(|w| w == b"\\\"step\\\"").unwrap() + 9;
    assert_eq!(whole[progress], b'1');
    for at in [progress, header, header + (whole.len() - header) / 3, whole.len() - 1] {
        let mut damaged = whole.clone();
        damaged[at] ^= 2; // step 1 becomes step 3
        std::fs::write(&file, damaged).unwrap();
        let arguments = ["--config", CONFIG, "--run", folder.to_str().unwrap(), "--resume"];
        refuses("srrf-train", &arguments, &["checkpoint.safetensors", "not a usable checkpoint"]);
    }
    std::fs::write(&file, whole).unwrap();
    train(&folder, &["--resume", "--until-step", "2"]);
}

#[test]
fn minutes_and_threads_have_a_range() {
    for (flag, value) in [
        ("--minutes", "1e300"),
        ("--minutes", "nan"),
        ("--minutes", "-1"),
        ("--threads", "0"),
        ("--threads", "1000000"),
    ] {
        refuses("srrf-train", &["--config", CONFIG, &format!("{flag}={value}")], &[flag, value]);
    }
    // No time at all is time for no step, and is said so.
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("run");
    let arguments = ["--config", CONFIG, "--run", folder.to_str().unwrap(), "--minutes", "0"];
    let (code, said) = run("srrf-train", &arguments);
    assert!(code == 0 && said.contains("no step was done") && said.contains("step 0"), "{code}: {said}");
}

#[test]
fn data_that_a_configuration_does_not_train_on_are_refused() {
    let scratch = tempfile::tempdir().unwrap();
    let [data, folder] = ["data", "run"].map(|name| scratch.path().join(name).to_str().unwrap().to_string());
    let arguments = ["--config", CONFIG, "--run", &folder, "--until-step", "0"];
    let with_data = [&arguments[..], &["--data", &data]].concat();
    refuses("srrf-train", &with_data, &["--data", "built-in shapes", "modelnet"]);
    // The environment is for whoever asks for it.
    let output = program("srrf-train").args(arguments).env("SRRF_DATA", &data).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn missing_data_say_where_and_what_works_without() {
    let words = ["--data", "SRRF_DATA", "accepted layouts", "configs/shapes.toml"];
    refuses("srrf-train", &["--config", "configs/modelnet-small.toml"], &words);
    let missing = ["--config", "configs/modelnet.toml", "--data", "no/such/folder"];
    refuses("srrf-train", &missing, &["no/such/folder", "accepted layouts", "configs/shapes.toml"]);
    refuses("srrf-train", &["--config", CONFIG, "--device", "abacus"], &["abacus", "flex"]);
}

/// A full disk loses nothing: the run stops with the file's name and the last checkpoint stays.
/// Needs the right to mount a small tmpfs; says so where it has not.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_and_harms_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let disk = scratch.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let path = disk.to_str().unwrap();
    let mounted = std::process::Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=256k", "tmpfs", path])
        .output()
        .is_ok_and(|o| o.status.success());
    if !mounted {
        println!("no right to mount a tmpfs here: the full disk was not tested");
        return;
    }
    let (code, said) = run("srrf-train", &["--config", CONFIG, "--run", disk.join("run").to_str().unwrap()]);
    let unmounted = std::process::Command::new("umount").arg(path).status().unwrap();
    assert!(unmounted.success());
    assert!(code == 1 || code == 2, "{code}: {said}");
    assert!(said.contains("No space left on device") && said.contains(path), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}
