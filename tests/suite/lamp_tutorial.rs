//! The tutorial of luminaires (`docs/guide/lamps.md`), line by line: its commands run, and what it prints is what the program says.
//!
//! `RADWALK_BLESS=1 cargo test --test suite lamp_tutorial::` writes the printed lines anew.

use std::fs;
use std::path::Path;

use tempfile::{TempDir, tempdir};

use crate::support::{SMALL_PICTURE, finish, path, radwalk};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide/lamps.md");

/// The code blocks of the page in a language.
fn blocks(language: &str) -> Vec<String> {
    let text = fs::read_to_string(PAGE).unwrap();
    let fence = format!("```{language}\n");
    text.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// Runs a command of the page in a folder; what it says.
fn radwalk_in(folder: &TempDir, words: &[&str]) -> String {
    let mut command = radwalk();
    command.current_dir(folder.path()).args(words);
    command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
    let (code, stdout, stderr) = finish(command.spawn().unwrap());
    assert_eq!(code, 0, "{words:?}: {stderr}");
    stdout
}

/// The room of `radwalk new box` without its own lamp, and the two files of the page beside its scene.
fn room() -> TempDir {
    let folder = tempdir().unwrap();
    radwalk_in(&folder, &["new", "box", "--out", "."]);
    let scene = fs::read_to_string(path(&folder, "scenes/box.toml")).unwrap();
    let dark: String =
        scene.lines().filter(|line| !line.starts_with("emit ")).map(|line| format!("{line}\n")).collect();
    assert_ne!(dark, scene);
    fs::write(path(&folder, "scenes/box.toml"), format!("{dark}\n{}", blocks("toml")[0])).unwrap();
    let lamps = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/photometry/tests/lamps");
    for (from, to) in [
        ("lambert.ies", "downlight.ies"),
        ("lambert.ies", "scenes/downlight.ies"),
        ("strip.ldt", "street.ldt"),
    ] {
        fs::copy(lamps.join(from), path(&folder, to)).unwrap();
    }
    folder
}

/// The scene with a plane of people at the points of the desk, as the page describes it.
fn add_people(folder: &TempDir) {
    let block = &blocks("toml")[0];
    let desk = &block[block.find("[[plane]]").unwrap()..];
    let people: String = desk
        .lines()
        .filter(|line| !line.starts_with("demand"))
        .map(|line| line.replace("\"desk\"", "\"people\"") + "\n")
        .collect();
    let scene = fs::read_to_string(path(folder, "scenes/box.toml")).unwrap();
    fs::write(path(folder, "scenes/box.toml"), format!("{scene}\n{people}measure = \"cylindrical\"\n"))
        .unwrap();
}

fn line_of<'a>(said: &'a str, plane: &str) -> &'a str {
    let begin = format!("plane \"{plane}\"");
    said.lines().find(|line| line.starts_with(&begin)).unwrap_or_else(|| panic!("no {begin} in {said}"))
}

fn number_behind(line: &str, word: &str) -> f64 {
    let rest = line.split_once(word).unwrap_or_else(|| panic!("no {word:?} in {line:?}")).1;
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn every_line_of_the_tutorial_is_what_the_program_says() {
    let folder = room();
    for block in blocks("sh") {
        for line in block.lines() {
            let words: Vec<&str> = line.split('#').next().unwrap().split_whitespace().collect();
            assert_eq!(words[0], "radwalk", "{line}");
            radwalk_in(&folder, &words[1..]);
        }
    }
    for drawing in ["out/downlight.ies/polar.svg", "street.svg"] {
        assert!(fs::read_to_string(path(&folder, drawing)).unwrap().starts_with("<svg"), "{drawing}");
    }
    let run = || {
        let words = ["run", "box.toml", "--force"];
        radwalk_in(&folder, &[&words[..], &SMALL_PICTURE].concat())
    };
    let desk = run();
    assert!(path(&folder, "out/box/planes.csv").exists() && path(&folder, "out/box/planes.svg").exists());
    add_people(&folder);
    let people = run();
    let said = [line_of(&desk, "desk"), line_of(&people, "people")];
    let mut page = fs::read_to_string(PAGE).unwrap();
    for (printed, said) in blocks("text").iter().zip(said) {
        page = page.replace(printed.as_str(), &format!("{said}\n"));
    }
    if std::env::var_os("RADWALK_BLESS").is_some() {
        fs::write(PAGE, &page).unwrap();
    }
    assert!(
        fs::read_to_string(PAGE).unwrap() == page,
        "docs/guide/lamps.md is not what the program says: RADWALK_BLESS=1 writes it anew\n{said:#?}"
    );
}

/// A lamp that is a source: the sheet of the room with the lamp at 0.8 has 0.8 times the mean, but for the digits that are printed.
#[test]
fn the_sheet_of_a_dimmed_room_needs_no_run() {
    let folder = room();
    let job = fs::read_to_string(path(&folder, "box.toml")).unwrap();
    let source = "\n[[source]]\nname = \"downlight\"\nlamps = [\"downlight\"]\n";
    fs::write(path(&folder, "box.toml"), job + source).unwrap();
    let words = ["run", "box.toml", "--force", "--paths", "200000"];
    let full = radwalk_in(&folder, &[&words[..], &SMALL_PICTURE].concat());
    let dimmed = radwalk_in(&folder, &["combine", "out/box", "--set", "downlight=0.8"]);
    let [full, dimmed] = [&full, &dimmed].map(|said| number_behind(line_of(said, "desk"), "mean "));
    assert!((dimmed - 0.8 * full).abs() <= (0.8 + 1.0) * 0.05 + 1e-9, "{full} {dimmed}");
}
