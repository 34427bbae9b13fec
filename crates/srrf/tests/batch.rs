//! `srrf batch`: a list of pairs in, a line for each out.

mod common;

use common::{Scene, lines, pose_of_json};
use serde_json::Value;

#[test]
fn goes_on_where_it_stopped() {
    let scene = Scene::new(500);
    scene.file("t.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    let list =
        "source,target,initial\nsource.ply,target.ply,\nsource.ply,gone.ply,\ntarget.ply,target.ply,t.txt\n";
    std::fs::create_dir(scene.path("lists")).unwrap();
    // Files are relative to the list.
    scene.file(
        "lists/pairs.csv",
        list.replace("source.ply", "../source.ply").replace("target.ply", "../target.ply"),
    );
    let batch = ["batch", "lists/pairs.csv", "--out", "r.jsonl", "--method", "fpfh-ransac"];
    let run = |threads: &str| scene.srrf(&[&batch[..], &["--threads", threads]].concat());
    let done = run("2");
    assert_eq!(done.code, 1, "{done:?}");
    let whole = scene.read("r.jsonl");
    let results = lines(&whole);
    assert_eq!(results.iter().map(|r| r["pair"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2, 3]);
    assert!(scene.worst(&pose_of_json(&results[0])) < 1e-3);
    assert!(
        results[1]["error"].as_str().unwrap().contains("gone.ply") && results[1]["probability"].is_null()
    );
    assert_eq!(results[2]["initial"], "t.txt");

    // As an interruption leaves it, in the middle of a line.
    scene.file("r.jsonl", &whole[..whole.find('\n').unwrap() + 40]);
    let done = run("1");
    assert!(done.code == 1 && done.out.contains("1 of 3 pairs done already"), "{done:?}");
    let untimed = |mut results: Vec<Value>| {
        results.iter_mut().for_each(|r| drop(r.as_object_mut().unwrap().remove("seconds")));
        results
    };
    assert_eq!(untimed(lines(&scene.read("r.jsonl"))), untimed(results));

    let before = scene.read("r.jsonl");
    assert_eq!(run("2").code, 1, "one pair still has no pose");
    assert_eq!(scene.read("r.jsonl"), before);
    let other = scene.srrf(&["batch", "lists/pairs.csv", "--out", "r.jsonl", "--method", "icp"]);
    assert!(other.code == 2 && other.err.contains("other options"), "{other:?}");
}

#[test]
fn lists_that_cannot_be_used() {
    let scene = Scene::new(50);
    scene.file("bare.csv", "source.ply,target.ply\n");
    scene.file("short.csv", "source,target\nsource.ply\n");
    for (list, fact) in
        [("gone.csv", "No such file"), ("bare.csv", "`source` and `target`"), ("short.csv", "line 2")]
    {
        let done = scene.srrf(&["batch", list, "--out", "r.jsonl"]);
        assert!(done.code == 2 && done.err.contains(list) && done.err.contains(fact), "{done:?}");
        assert!(!scene.path("r.jsonl").exists());
    }
}

/// Ctrl-C ends the run with 130 and whole lines only; the same command goes on.
#[cfg(unix)]
#[test]
fn an_interruption_loses_nothing() {
    let scene = Scene::new(3000);
    let pairs = 40;
    scene.file("pairs.csv", format!("source,target\n{}", "source.ply,target.ply\n".repeat(pairs)));
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_srrf"))
        .args(["batch", "pairs.csv", "--out", "r.jsonl", "--method", "fpfh-ransac", "--quiet"])
        .current_dir(scene.folder.path())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begun = std::time::Instant::now();
    let some = || std::fs::read(scene.path("r.jsonl")).is_ok_and(|bytes| bytes.contains(&b'\n'));
    while !some() && begun.elapsed().as_secs() < 300 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let text = scene.read("r.jsonl");
    let done = lines(&text).len();
    assert!(text.ends_with('\n') && done > 0 && done < pairs, "{done} of {pairs}");
}
