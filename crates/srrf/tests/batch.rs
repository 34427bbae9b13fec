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
    let ids: Vec<&str> = results.iter().map(|r| r["id"].as_str().unwrap()).collect();
    let guessed = "../target.ply -> ../target.ply (t.txt)";
    assert_eq!(ids, ["../source.ply -> ../target.ply", "../source.ply -> gone.ply", guessed]);
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
    let list: String = (0..pairs).map(|i| format!("{i},source.ply,target.ply\n")).collect();
    scene.file("pairs.csv", format!("id,source,target\n{list}"));
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

/// The rows of a file of results by id, without the times.
#[allow(clippy::unwrap_used, reason = "what fails here fails the test")]
fn rows(scene: &Scene, file: &str) -> std::collections::BTreeMap<String, Value> {
    let lines = lines(&scene.read(file)).into_iter().map(|mut row| {
        row.as_object_mut().unwrap().remove("seconds");
        (row["id"].as_str().unwrap().to_owned(), row)
    });
    lines.collect()
}

#[test]
fn shards_in_any_format_join_to_the_whole() {
    let scene = Scene::new(300);
    let list: String = (0..9)
        .map(|i| {
            format!("{{\"id\":\"p{i}\",\"source\":\"source.ply\",\"target\":\"target.ply\",\"n\":{i}}}\n")
        })
        .collect();
    scene.file(
        "pairs.jsonl",
        format!("{list}{{\"id\":\"p9\",\"source\":\"gone.ply\",\"target\":\"target.ply\"}}\n"),
    );
    let batch = |arguments: &[&str]| {
        scene.srrf(&[&["batch", "pairs.jsonl", "--method", "fpfh-ransac"][..], arguments].concat())
    };
    let whole = batch(&["-o", "whole.jsonl"]);
    assert!(
        whole.code == 1 && whole.out.contains("10 pairs: 9 probably right, 0 abstained, 1 without a pose"),
        "{whole:?}"
    );
    assert!(whole.out.contains("least probable") && whole.out.contains("gone.ply"), "{whole:?}");
    let expected = rows(&scene, "whole.jsonl");
    assert_eq!((expected.len(), &expected["p4"]["columns"]["n"]), (10, &Value::from(4)));

    let parts = [("1/3", "a.jsonl"), ("2/3", "b.csv"), ("3/3", "c.parquet")];
    for (shard, file) in parts {
        let done = batch(&["-o", file, "--shard", shard]);
        assert!(done.out.contains(&format!("shard {shard}:")), "{done:?}");
        let again = batch(&["-o", file, "--shard", shard, "--retry-failed"]);
        assert_eq!(again.code, done.code, "{again:?}");
    }
    let merged =
        scene.srrf(&["batch", "merge", "c.parquet", "a.jsonl", "-o", "ab.csv", "--order", "pairs.jsonl"]);
    assert!(merged.code == 0 && merged.out.contains("of the list are missing"), "{merged:?}");
    for (from, to) in [(["ab.csv", "b.csv"], "d.parquet"), (["d.parquet", "a.jsonl"], "e.jsonl")] {
        let merged = scene.srrf(&["batch", "merge", from[0], from[1], "-o", to, "--order", "pairs.jsonl"]);
        assert!(
            merged.code == 0 && merged.out.contains("10 pairs in") && !merged.out.contains("missing"),
            "{merged:?}"
        );
    }
    assert_eq!(rows(&scene, "e.jsonl"), expected);
    let order: Vec<String> =
        lines(&scene.read("e.jsonl")).iter().map(|r| r["id"].as_str().unwrap().into()).collect();
    assert_eq!(order, (0..10).map(|i| format!("p{i}")).collect::<Vec<_>>());

    let summary = scene.srrf(&["summary", "d.parquet"]);
    assert!(summary.code == 0 && summary.out.starts_with("10 pairs: 9 probably right"), "{summary:?}");
    let summary = scene.srrf(&["summary", "source.ply"]);
    assert!(summary.code == 2 && summary.err.contains("source.ply"), "{summary:?}");

    // The file that was missing comes, and the list grows.
    std::fs::copy(scene.path("source.ply"), scene.path("gone.ply")).unwrap();
    scene.file("pairs.jsonl", format!("{list}{{\"id\":\"p9\",\"source\":\"gone.ply\",\"target\":\"target.ply\"}}\n{{\"id\":\"q\",\"source\":\"source.ply\",\"target\":\"target.ply\"}}\n"));
    let more = batch(&["-o", "d.parquet"]);
    assert!(more.code == 1 && more.out.contains("--retry-failed tries again"), "{more:?}");
    let more = batch(&["-o", "d.parquet", "--retry-failed", "--html", "pages"]);
    assert!(more.code == 0 && more.out.contains("1 pair: 1 probably right"), "{more:?}");
    let index = scene.read("pages/index.html");
    assert!(
        index.contains("11 pairs: 11 probably right") && index.matches("<tr class").count() == 11,
        "{index}"
    );
    let (_, after) = index.split_once("href=\"pair-").unwrap();
    let page = format!("pages/pair-{}", after.split_once('"').unwrap().0);
    assert!(index.matches("href").count() == 1 && scene.read(&page).starts_with("<!doctype html>"));
}

#[test]
fn a_pair_is_listed_once() {
    let scene = Scene::new(50);
    scene.file("twice.csv", "source,target\nsource.ply,target.ply\nsource.ply,target.ply\n");
    let done = scene.srrf(&["batch", "twice.csv", "-o", "r.jsonl"]);
    assert!(
        done.code == 2 && done.err.contains("line 2 and line 3") && done.err.contains("column `id`"),
        "{done:?}"
    );
    let bare = scene.srrf(&["batch"]);
    assert!(bare.code == 2 && bare.err.contains("--output"), "{bare:?}");
    let shard = scene.srrf(&["batch", "twice.csv", "-o", "r.jsonl", "--shard", "4/3"]);
    assert!(shard.code == 2 && shard.err.contains("--shard") && shard.err.contains("3/64"), "{shard:?}");
}
