//! The first screen of the README: its command on its files gives its output.

use std::path::Path;
use std::process::Command;

/// Shares, angles and lengths may differ so much between processors.
const TOLERANCE: f64 = 0.05;

#[test]
fn the_first_command_says_what_the_readme_says() {
    let root = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../..");
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let block = readme.split("$ srrf ").nth(1).unwrap().split("```").next().unwrap();
    let (command, promised) = block.split_once('\n').unwrap();

    let folder = tempfile::tempdir().unwrap();
    let demo = folder.path().join("demo");
    std::fs::create_dir_all(&demo).unwrap();
    for name in ["source.ply", "target.pcd"] {
        std::fs::copy(root.join("demo").join(name), demo.join(name)).unwrap();
    }
    let output = Command::new(env!("CARGO_BIN_EXE_srrf"))
        .args(command.split_whitespace())
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));

    let lines = |text: &str| -> Vec<String> {
        text.lines().map(str::trim_end).filter(|l| !l.is_empty()).map(str::to_owned).collect()
    };
    // The README leaves lines out; those that it shows come in the program's order.
    let found = lines(&said);
    let mut rest = found.iter();
    for promised in lines(promised) {
        assert!(rest.any(|line| alike(&promised, line)), "README:  {promised}\nprogram: {found:#?}");
    }
    for file in ["pose.txt", "look.html"] {
        assert!(folder.path().join(file).exists(), "{file}");
    }
}

/// The same words, and numbers that are nearly the same.
fn alike(a: &str, b: &str) -> bool {
    let words = |line: &str| -> Vec<String> {
        line.split_whitespace()
            .map(|w| w.trim_matches(&['(', ')', ',', ';', '°'][..]).replace(',', ""))
            .collect()
    };
    let (a, b) = (words(a), words(b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= TOLERANCE * (1.0 + a.abs().max(b.abs())),
            _ => a == b,
        })
}

#[test]
fn numbers_are_compared_as_numbers() {
    assert!(alike("rotation 75.21° about (0.30, -0.51)", "rotation     75.30° about (0.31, -0.50)"));
    assert!(!alike("rotation 75.21°", "rotation 95.21°"));
    assert!(!alike("verdict probably right", "verdict abstain right"));
}
