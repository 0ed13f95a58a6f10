//! Tests of README and docs: their TOML blocks and commands run, the reference names every command, flag, key, column,
//! field, metric and check, and no link leads nowhere.
//!
//! `RADWALK_BLESS=1 cargo test --test suite documents::` writes the pages that consist of the program's own words.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{draw_job, path, radwalk, run, summary, wait_for};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn read(page: impl AsRef<Path>) -> String {
    let page = Path::new(ROOT).join(page);
    fs::read_to_string(&page).unwrap_or_else(|error| panic!("{}: {error}", page.display()))
}

/// The pages that people wrote, README first.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![PathBuf::from("README.md"), "docs/README.md".into()];
    for shelf in ["docs/guide", "docs/reference", "docs/theory", "docs/developer"] {
        let mut files: Vec<PathBuf> =
            fs::read_dir(Path::new(ROOT).join(shelf)).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        pages.extend(files.iter().map(|file| file.strip_prefix(ROOT).unwrap().to_owned()));
    }
    pages
}

/// The code blocks of a page in a language.
fn blocks(page: &Path, language: &str) -> Vec<String> {
    let text = read(page);
    let fence = format!("```{language}\n");
    text.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// A folder with the files that the jobs of the pages name.
fn workshop() -> tempfile::TempDir {
    let folder = tempdir().unwrap();
    fs::create_dir(path(&folder, "scenes")).unwrap();
    for scene in ["scenes/cornell.toml", "scenes/lamps.toml"] {
        fs::copy(Path::new(ROOT).join("configs").join(scene), path(&folder, scene)).unwrap();
    }
    let mesh = "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 1\nusemtl Wall\nf 1 2 3\nusemtl Lamp1\nf 4 5 6\n";
    for name in ["two.obj", "kitchen.obj"] {
        fs::write(path(&folder, name), mesh).unwrap();
    }
    let lamp = Path::new(ROOT).join("crates/photometry/tests/lamps/lambert.ies");
    fs::copy(lamp, path(&folder, "downlight.ies")).unwrap();
    fs::write(path(&folder, "two.mtl"), "newmtl Lamp1\nKd 0 0 0\nnewmtl Wall\nKd 0.5 0.5 0.5\n").unwrap();
    folder
}

fn lit_part(summary: &Value) -> f64 {
    let [judged, sealed] = ["area", "sealed_area"].map(|key| summary["headline"][key].as_f64().unwrap());
    judged / (judged + sealed) - summary["unhit"]["area"].as_f64().unwrap()
}

#[test]
fn every_toml_block_runs() {
    let folder = workshop();
    let short = [
        "--paths",
        "300000",
        "--workers",
        "2",
        "--set",
        "target.relative_error=1",
        "--set",
        "target.fraction=0.5",
        "--force",
    ];
    let (mut jobs, mut scenes, mut sensors, mut imports) = (0, 0, 0, 0);
    let (mut groups, mut skies, mut meshes, mut planes) = (0, 0, 0, 0);
    for page in pages() {
        for block in blocks(&page, "toml") {
            let file = path(&folder, "block.toml");
            let out = path(&folder, "out");
            if block.contains("transmittance = 0.2") {
                let scene = fs::read_to_string("configs/scenes/daylit.toml").unwrap();
                fs::write(&file, format!("{scene}\n{block}")).unwrap();
                let [file, out] = [&file, &out].map(|path| path.to_str().unwrap());
                let words = ["daylight", file, "--weather", "configs/weather/made.epw", "--out", out];
                let (code, _, stderr) = run(&[&words[..], &["--paths", "1e6", "--force"]].concat());
                assert!(code <= 1, "{page:?}: {stderr}");
            } else if block.contains("[[surface]]") {
                scenes += 1;
                fs::write(&file, &block).unwrap();
                let (code, stdout, stderr) = run(&["check", file.to_str().unwrap(), "--fix-report"]);
                assert_eq!(code, 0, "{page:?}: {stderr}");
                assert!(!stdout.contains("coincident") && !stdout.contains("buried"), "{stdout}");
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "100000", "--force"]);
                assert!(lit_part(&summary) > 0.99, "{page:?}: {summary}");
            } else if block.contains("[[mesh]]") {
                meshes += 1;
                fs::write(&file, &block).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "100000", "--force"]);
                assert_eq!(summary["sensors"]["list"][0]["name"], "desk", "{summary}");
            } else if block.contains("[[plane]]") {
                planes += 1;
                let scene = blocks(Path::new("docs/guide/first-scene.md"), "toml").swap_remove(0);
                fs::write(&file, format!("{scene}\n{block}")).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "100000", "--force"]);
                assert_eq!(summary["planes"][0]["points"], 16, "{summary}");
                names("docs/reference/outputs.md", header(&out.join("planes.csv")));
                let columns = summary["planes"][0].as_object().unwrap().keys().cloned();
                names("docs/reference/outputs.md", columns);
            } else if block.contains("[[pane]]") {
                let scene = fs::read_to_string("configs/scenes/daylit.toml").unwrap();
                fs::write(&file, format!("{scene}\n{block}")).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "20000", "--force"]);
                assert_eq!(summary["escaped"], 0, "panes absorb: {summary}");
                let (_, stdout, _) = run(&["check", file.to_str().unwrap()]);
                assert!(stdout.contains("1 pane of clear glass"), "{stdout}");
            } else if block.contains("[[sensor]]") {
                sensors += 1;
                let scene = blocks(Path::new("docs/guide/first-scene.md"), "toml").swap_remove(0);
                fs::write(&file, format!("{scene}\n{block}")).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "100000", "--force"]);
                assert_eq!(
                    (&summary["sensors"]["list"][0]["name"], &summary["sensors"]["samples"]),
                    (&"desk".into(), &97.into())
                );
                let rows = fs::read_to_string(out.join("sensors.csv")).unwrap().lines().count();
                assert_eq!(rows, 1 + 8 + 1);
            } else if block.contains("[[group]]") {
                groups += 1;
                let scene = path(&folder, "scene.toml");
                fs::write(&scene, blocks(Path::new("docs/guide/first-scene.md"), "toml").swap_remove(0))
                    .unwrap();
                fs::write(&file, &block).unwrap();
                let heat = block.contains("temperature");
                let of = if heat {
                    ["--groups", "by-surface", "--temperatures"]
                } else {
                    ["--paths", "50000", "--groups"]
                };
                let (code, _, stderr) = run(&[
                    &[
                        "factors",
                        scene.to_str().unwrap(),
                        "--quiet",
                        "--force",
                        "--out",
                        out.to_str().unwrap(),
                    ][..],
                    &of,
                    &[file.to_str().unwrap()],
                ]
                .concat());
                assert_eq!(code, 0, "{page:?}: {stderr}");
            } else if block.starts_with("[sky]") {
                skies += 1;
                let scene = blocks(Path::new("docs/guide/first-scene.md"), "toml").swap_remove(0);
                fs::write(&file, format!("{scene}\n{block}")).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--paths", "100000", "--force"]);
                assert_eq!(summary["escaped"], 0, "{summary}");
            } else if block.starts_with("[import]") {
                imports += 1;
                fs::write(&file, format!("scene = \"two.obj\"\n[budget]\npaths = 10000\n{block}")).unwrap();
                let summary = draw_job(file.to_str().unwrap(), &out, &["--force"]);
                // The sky of the block lights the wall's back, too, which faces away from the lamp.
                assert_eq!(lit_part(&summary), 1.0, "{page:?}: {summary}");
            } else {
                jobs += 1;
                fs::write(&file, &block).unwrap();
                draw_job(file.to_str().unwrap(), &out, &short);
            }
        }
    }
    let counts = (jobs >= 3, scenes, sensors, imports);
    assert_eq!(counts, (true, 1, 1, 1), "{jobs} jobs");
    assert_eq!((groups, skies, meshes, planes), (2, 1, 1, 1));
}

#[test]
fn what_the_comments_of_the_job_offer_runs_too() {
    let folder = workshop();
    let [job] = blocks(Path::new("docs/guide/methods.md"), "toml").try_into().unwrap();
    let file = path(&folder, "job.toml");
    // The lines that are commented out are meant for chains.
    let offered = job
        .replace("# final_gather", "final_gather")
        .replace("# batch_paths = 1_250_000", "batch_paths = 125_000")
        .replace("# jacobi  =", "jacobi =")
        .replace("\"shooting\"", "\"jacobi\"")
        .replace("sampler ", "# sampler ");
    fs::write(&file, offered).unwrap();
    let short = ["--paths", "1e6", "--workers", "2", "--set", "target.relative_error=1"];
    let summary = draw_job(file.to_str().unwrap(), &path(&folder, "offered"), &short);
    assert_eq!(summary["walk"], "jacobi");
}

/// The commands that the program knows.
fn commands() -> Vec<String> {
    let (_, help, _) = run(&["--help"]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

fn trimmed(text: &str) -> String {
    text.lines().map(|line| line.trim_end().to_owned() + "\n").collect::<String>().trim_end().to_owned()
}

/// Asserts that the page is as the program would write it.
fn hold(page: &str, expected: &str) {
    if std::env::var_os("RADWALK_BLESS").is_some() {
        fs::write(Path::new(ROOT).join(page), expected).unwrap();
    }
    let found = fs::read_to_string(Path::new(ROOT).join(page)).unwrap_or_default();
    assert!(found == expected, "{page} is not what the program says: RADWALK_BLESS=1 writes it anew");
}

/// The blocks of an indented list, each with the lines that go on below it.
fn blocks_of(list: &str, begins: impl Fn(&str) -> bool) -> Vec<String> {
    let mut blocks: Vec<String> = Vec::new();
    for line in list.lines() {
        match blocks.last_mut() {
            Some(block) if !begins(line) => *block += &format!("\n{line}"),
            _ => blocks.push(line.to_owned()),
        }
    }
    blocks
}

/// The help of a command without its first line and its examples, and without the arguments and options that the page has
/// already: the names of these options stand in one line.
fn without_repeats(help: &str, seen: &mut BTreeSet<String>) -> String {
    let help = help.split_once("\n\n").unwrap().1.split("\n\nExamples:").next().unwrap();
    let mut new_blocks = |list: &str, begins: fn(&str) -> bool| -> (Vec<String>, Vec<String>) {
        let words = |block: &String| block.split_whitespace().collect::<Vec<_>>().join(" ");
        blocks_of(list, begins).into_iter().partition(|block| seen.insert(words(block)))
    };
    let Some((head, options)) = help.split_once("\nOptions:\n") else { return help.to_owned() };
    let mut text = head.to_owned();
    if let Some((usage, arguments)) = head.split_once("\n\nArguments:\n") {
        let (new, _) =
            new_blocks(arguments, |line| line.starts_with("  ") && line.trim_start().starts_with(['<', '[']));
        text = format!("{usage}\n");
        if !new.is_empty() {
            text += &format!("\nArguments:\n{}\n", new.join("\n"));
        }
    }
    let begins =
        |line: &str| line.starts_with("  ") && line.trim_start().starts_with("-") && !line.contains(" - ");
    let (new, old) = new_blocks(options, begins);
    text = trimmed(&format!("{text}\nOptions:\n{}", new.join("\n")));
    let name =
        |block: &String| block.split_whitespace().find(|word| word.starts_with("--")).map(str::to_owned);
    let names: Vec<String> = old.iter().filter_map(name).filter(|name| name != "--help").collect();
    if !names.is_empty() {
        text += &format!("\n  as above: {}", names.join(" "));
    }
    text
}

#[test]
fn the_page_of_commands_is_their_help() {
    let mut page = "# Commands\n\nThe program's own help; `radwalk help COMMAND` prints it with examples. An argument or option of several \
                    commands stands once, at the first. A test writes this page.\n"
        .to_owned();
    let (_, help, _) = run(&["--help"]);
    let list = help.split("\n\nExamples:").next().unwrap();
    page += &format!("\n## radwalk\n\n```text\n{}\n```\n", trimmed(list));
    let mut seen = BTreeSet::new();
    for command in commands() {
        let (code, help, _) = run(&[&command, "--help"]);
        assert_eq!(code, 0);
        page += &format!(
            "\n## radwalk {command}\n\n```text\n{}\n```\n",
            without_repeats(&trimmed(&help), &mut seen)
        );
    }
    hold("docs/reference/commands.md", &page);
}

/// `radwalk help` prints every entry of the glossary, whose pages are there, and the help of every command.
#[test]
fn help_explains_commands_and_words() {
    let glossary = fs::read_to_string(Path::new(ROOT).join("docs/reference/glossary.md")).unwrap();
    let entries = || glossary.split("\n## ").skip(1).map(|entry| entry.split_once('\n').unwrap());
    let words: Vec<&str> = entries().map(|(word, _)| word).collect();
    assert!(words.len() > 20 && words.is_sorted(), "{words:?}");
    for (word, text) in entries() {
        let typed: Vec<&str> = ["help"].into_iter().chain(word.split(' ')).collect();
        let (code, stdout, _) = run(&typed);
        let entry = format!("{word}\n\n{}", text.trim());
        assert!(code == 0 && stdout.trim_end().ends_with(&entry), "{word}: {stdout}");
        let pages = text.split_whitespace().filter(|word| word.starts_with("docs/"));
        for page in pages.map(|page| page.trim_end_matches('.')) {
            assert!(Path::new(ROOT).join(page).exists(), "{word}: {page}");
        }
    }
    assert_eq!(run(&["help", "Walks"]).1, run(&["help", "walk"]).1);
    for command in commands() {
        let help = run(&[&command, "--help"]).1;
        assert!(run(&["help", &command]).1.starts_with(&help), "{command}: {help}");
    }
    assert!(run(&["help"]).1.contains("Words: access file, "));
    let (code, stdout, stderr) = run(&["help", "photon"]);
    assert_eq!((code, &stdout[..]), (2, ""));
    assert!(stderr.contains("\"photon\"") && stderr.contains("interval"), "{stderr}");
}

/// The values that a schema allows, in a few words.
fn kind(schema: &Value) -> String {
    if let Some(words) = schema["enum"].as_array() {
        return words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
    }
    if schema["properties"].is_object() {
        return "table".into();
    }
    if let Some(word) = schema["const"].as_str() {
        return format!("`\"{word}\"`");
    }
    if let Some(choices) = schema["anyOf"].as_array() {
        let one = kind(&choices[0]);
        if choices[1..].iter().map(kind).eq([format!("3 × {one}")]) {
            return format!("{one} or [red, green, blue]");
        }
        return choices.iter().map(kind).collect::<Vec<_>>().join(" or ");
    }
    let number = |key: &str| schema[key].as_f64();
    match schema["type"].as_str() {
        Some("array") => {
            let items = kind(&schema["items"]);
            match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                (Some(n), Some(most)) if n == most => format!("{n} × {items}"),
                _ => format!("list of {items}"),
            }
        }
        Some("object") => "table".into(),
        Some(word) => {
            let mut text = word.to_owned();
            for (key, sign) in
                [("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")]
            {
                if let Some(bound) = number(key).filter(|bound| bound.abs() < 1e9) {
                    text += &format!(" {sign} {bound}");
                }
            }
            text
        }
        None => "any".into(),
    }
}

/// The lists of keys below a schema, deeper ones after their own. Keys that an earlier list has alike stand in one line.
fn lists(name: &str, schema: &Value, page: &mut String, listed: &mut BTreeMap<String, String>) {
    let Some(keys) = schema["properties"].as_object() else { return };
    let required: BTreeSet<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let (mut items, mut repeats) = (String::new(), BTreeMap::<String, Vec<String>>::new());
    for (key, value) in keys {
        let must = if required.contains(key.as_str()) { " (required)" } else { "" };
        // The kind of a colour says what editors show in words.
        let means =
            value["description"].as_str().unwrap_or("").replace("; a number, or [red, green, blue]", "");
        let item = format!("- `{key}`{must}: {}. {means}\n", kind(value));
        match listed.get(&item) {
            Some(list) => repeats.entry(list.clone()).or_default().push(format!("`{key}`")),
            None => {
                items += &item;
                listed.insert(item, name.to_owned());
            }
        }
    }
    *page += &format!("\n## {name}\n\n{items}");
    for (list, keys) in repeats {
        *page += &format!("- {}: as in `{list}`.\n", keys.join(", "));
    }
    let path =
        if name.starts_with('[') { name.trim_matches(['[', ']']).to_owned() + "." } else { String::new() };
    let below = |key: &str| format!("[{path}{key}]");
    for (key, value) in keys {
        lists(&below(key), value, page, listed);
        lists(&below(&format!("{key}.NAME")), &value["additionalProperties"], page, listed);
        lists(&format!("[{}]", below(key)), &value["items"], page, listed);
        for choice in value["anyOf"].as_array().into_iter().flatten() {
            lists(&below(key), choice, page, listed);
        }
    }
}

#[test]
fn the_pages_of_keys_are_the_schemas() {
    let folder = tempdir().unwrap();
    let (code, _, stderr) = run(&["new", "schema", "--out", folder.path().to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    for (file, page, title) in
        [("job", "docs/reference/job.md", "Job files"), ("scene", "docs/reference/scene.md", "Scene files")]
    {
        let schema = find(folder.path(), &format!("schema/{file}.json"));
        let schema: Value = serde_json::from_slice(&fs::read(schema).unwrap()).unwrap();
        let mut text = format!(
            "# {title}\n\nEvery key, from the schema by which editors complete keys (`radwalk new schema`). Unknown keys are errors. A test\n\
             writes this page.\n"
        );
        lists("Top of the file", &schema, &mut text, &mut BTreeMap::new());
        hold(page, &text);
    }
}

/// The file below a folder whose name has this ending.
fn find(folder: &Path, ending: &str) -> PathBuf {
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.to_str().unwrap().ends_with(ending) {
                return path;
            }
        }
    }
    panic!("no file ends in {ending}");
}

/// Asserts that a page has each of the words between backquotes.
fn names(page: &str, words: impl IntoIterator<Item = String>) {
    let text = read(page);
    let missing: Vec<String> =
        words.into_iter().filter(|word| !text.contains(&format!("`{word}`"))).collect();
    assert!(missing.is_empty(), "{page} does not name {missing:?}");
}

fn header(csv: &Path) -> Vec<String> {
    fs::read_to_string(csv).unwrap().lines().next().unwrap().split(',').map(str::to_owned).collect()
}

#[test]
fn the_page_of_outputs_names_columns_fields_and_metrics() {
    const OUTPUTS: &str = "docs/reference/outputs.md";
    let folder = tempdir().unwrap();
    let two_sided = path(&folder, "two-sided.toml");
    let scene = blocks(Path::new("docs/guide/first-scene.md"), "toml")
        .swap_remove(0)
        .replace("sides    = 1", "sides = 2");
    fs::write(&two_sided, scene).unwrap();
    let two_sided = two_sided.to_str().unwrap();
    let target = ["--paths", "20000", "--set", "target.relative_error=1", "--set", "target.fraction=0.5"];
    let mixed = path(&folder, "mixed");
    let summary = draw_job(two_sided, &mixed, &[&target[..], &["--set", "method.mix=true"]].concat());
    let cut = path(&folder, "cut");
    let ends = [
        "--set",
        "method.estimator=infinite",
        "--set",
        "method.infinite.end=cutoff",
        "--set",
        "method.infinite.threshold=0.1",
    ];
    draw_job(two_sided, &cut, &[&target[..], &ends].concat());
    let (code, _, stderr) =
        run(&["exact", two_sided, "--quiet", "--out", path(&folder, "exact").to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let lamps = path(&folder, "lamps");
    let by_source = draw_job("configs/lamps.toml", &lamps, &["--paths", "20000"]);
    names(OUTPUTS, by_source.as_object().unwrap().keys().cloned());
    names(OUTPUTS, by_source["sources"][0].as_object().unwrap().keys().cloned());
    names(OUTPUTS, by_source["sensitivities"][0].as_object().unwrap().keys().cloned());
    for table in ["sources.csv", "sensitivities.csv"] {
        names(OUTPUTS, header(&lamps.join(table)).into_iter().map(|head| without_channel(&head)));
    }
    let tables = [mixed.join("patches.csv"), cut.join("patches.csv"), path(&folder, "exact/exact.csv")];
    let (smoothed, heat) = (path(&folder, "factors"), path(&folder, "heat.toml"));
    fs::write(&heat, "[[group]]\nname = \"*\"\ntemperature = 300.0\n").unwrap();
    let words = ["factors", "configs/cube6-r90.toml", "--smooth", "--paths", "10000", "--quiet"];
    let rest = ["--temperatures", heat.to_str().unwrap(), "--out", smoothed.to_str().unwrap()];
    let (code, _, stderr) = run(&[&words[..], &rest].concat());
    assert_eq!(code, 0, "{stderr}");
    let of_factors = ["factors.csv", "groups.csv", "thermal.csv"].map(|name| smoothed.join(name));
    names(OUTPUTS, of_factors.iter().flat_map(|table| header(table)));
    let answer: Value = serde_json::from_slice(&fs::read(smoothed.join("factors.json")).unwrap()).unwrap();
    names(OUTPUTS, answer.as_object().unwrap().keys().cloned());
    names(OUTPUTS, header(&path(&folder, "exact/exact-factors.csv")));
    names(OUTPUTS, tables.iter().flat_map(|table| header(table)));
    names(OUTPUTS, summary.as_object().unwrap().keys().cloned());
    names(OUTPUTS, summary["model"].as_object().unwrap().keys().cloned());
    names(OUTPUTS, metrics(&folder));
}

/// The name of a column without the channel that it is of.
fn without_channel(head: &str) -> String {
    let channel = ["_r", "_g", "_b"].into_iter().find_map(|channel| head.strip_suffix(channel));
    channel.unwrap_or(head).into()
}

/// The names of all metrics of a running job.
fn metrics(folder: &tempfile::TempDir) -> BTreeSet<String> {
    let mut child = radwalk()
        .args([
            "run",
            "configs/cube54.toml",
            "--paths",
            "1e12",
            "--metrics",
            "127.0.0.1:0",
            "--set",
            "target.relative_error=1e-9",
        ])
        .args(["--out", path(folder, "running").to_str().unwrap()])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut stderr = child.stderr.take().unwrap();
    let mut said = String::new();
    let address = wait_for("the address of the metrics", || {
        let mut some = [0; 256];
        let n = stderr.read(&mut some).unwrap();
        said += &String::from_utf8_lossy(&some[..n]);
        let rest = said.split("http://").nth(1)?;
        rest.contains("/metrics").then(|| rest.split('/').next().unwrap().to_owned())
    });
    std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
    let page = wait_for("metrics of both workers and errors", || {
        let mut stream = TcpStream::connect(&address).ok()?;
        stream.write_all(b"GET /metrics HTTP/1.0\r\n\r\n").ok()?;
        let mut page = String::new();
        stream.read_to_string(&mut page).ok()?;
        (page.contains("radwalk_worker_paths_per_second{") && page.contains("radwalk_relative_error_max "))
            .then_some(page)
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let lines = page.lines().filter(|line| line.starts_with("radwalk_"));
    lines.map(|line| line.split([' ', '{']).next().unwrap().to_owned()).collect()
}

#[test]
fn the_page_of_checks_names_every_check() {
    let folder = tempdir().unwrap();
    let mut names_of_checks = BTreeSet::new();
    for (name, set) in [("walks", "method.walk=shooting"), ("chains", "method.walk=jacobi")] {
        let out = path(&folder, name);
        draw_job("configs/cube54.toml", &out, &["--paths", "200000", "--set", set]);
        let checks = summary(&out)["checks"].as_array().unwrap().clone();
        names_of_checks.extend(checks.iter().map(|check| check["name"].as_str().unwrap().to_owned()));
    }
    assert!(names_of_checks.contains("reciprocity") && names_of_checks.contains("vov"));
    names("docs/reference/checks.md", names_of_checks);
}

/// The name by which a forge links to a heading.
fn anchor(heading: &str) -> String {
    let kept = heading
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .collect::<String>();
    kept.replace(' ', "-")
}

#[test]
fn no_link_leads_nowhere() {
    let mut generated: Vec<PathBuf> =
        ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(PathBuf::from).into();
    for name in
        ["atlas", "compare", "coverage", "gain", "papers/papers", "reading", "scale", "speed", "validation"]
    {
        generated.push(format!("docs/results/{name}.md").into());
    }
    let mut links = 0;
    for page in pages().into_iter().chain(generated) {
        let text = read(&page);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") || link.contains(' ') {
                continue;
            }
            links += 1;
            let (file, part) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(Path::new(ROOT).join(&target).exists(), "{page:?} links to {link}");
            if !part.is_empty() {
                let text = read(&target);
                let mut headings = text.lines().filter_map(|line| line.strip_prefix('#'));
                let found = headings.any(|rest| anchor(rest.trim_start_matches('#').trim()) == part)
                    || text.contains(&format!("id=\"{part}\""));
                assert!(found, "{page:?} links to {link}");
            }
        }
    }
    assert!(links > 60, "{links}");
}

/// A page names files between backquotes from the root of the project on. Those of other folders are not looked for.
#[test]
fn every_file_that_a_page_names_is_there() {
    let mut named = 0;
    for page in pages().into_iter().chain(["ARCHITECTURE.md".into(), "CONTRIBUTING.md".into()]) {
        let text = read(&page);
        let words = text.split('`').skip(1).step_by(2);
        let is_path = |word: &&str| {
            let inside =
                ["crates/", "tests/", "scripts/", "configs/"].iter().any(|root| word.starts_with(root));
            inside && word.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
        };
        for file in words.filter(is_path) {
            named += 1;
            assert!(Path::new(ROOT).join(file).exists(), "{page:?} names {file}, which is not there");
        }
    }
    assert!(named > 60, "{named} files are named");
}

/// In the pages of theory "`name` in `file`" stands for a function of the file.
#[test]
fn every_function_that_theory_names_is_there() {
    let mut named = 0;
    for page in pages().into_iter().filter(|page| page.starts_with("docs/theory")) {
        let text = read(&page);
        let words: Vec<&str> = text.split('`').collect();
        for three in words.windows(3).filter(|three| three[1] == " in " && three[2].ends_with(".rs")) {
            named += 1;
            let [name, file] = [three[0], three[2]];
            assert!(read(file).contains(&format!("fn {name}(")), "{page:?}: {file} has no function {name}");
        }
    }
    assert!(named >= 15, "{named} functions are named");
}

/// Every command in the guide is one that the program accepts: quick ones are run, of the others the words are parsed.
#[test]
fn every_command_of_the_pages_is_understood() {
    let folder = workshop();
    let (code, _, stderr) = run_in(&folder, "new box");
    assert_eq!(code, 0, "{stderr}");
    let mut seen = BTreeSet::new();
    for page in pages() {
        for line in blocks(&page, "sh").iter().flat_map(|block| block.lines()) {
            let line = line.split('#').next().unwrap().trim();
            for words in line.split("&&").filter_map(|part| part.trim().strip_prefix("radwalk ")) {
                let command = words.split(' ').next().unwrap();
                assert!(commands().iter().any(|known| known == command), "{page:?}: {line}");
                seen.insert(command.to_owned());
                // A flag that does not exist is refused before help is given.
                let (code, _, stderr) = run_in(&folder, &format!("{words} --help"));
                assert_eq!(code, 0, "{page:?}: {line}: {stderr}");
                let flags = words.split(' ').filter(|word| word.starts_with("--"));
                let (_, help, _) = run(&[command, "--help"]);
                for flag in flags {
                    assert!(help.contains(flag), "{page:?}: {line}: no {flag}");
                }
                if ["check", "run"].contains(&command) && words.contains("box.toml") {
                    let quick =
                        if command == "run" { " --paths 20000 --quiet --set view.size=[64,48]" } else { "" };
                    let (code, _, stderr) = run_in(&folder, &format!("{words}{quick}"));
                    assert!(code < 2, "{page:?}: {line}: {stderr}");
                }
            }
        }
    }
    assert!(seen.len() >= 6, "{seen:?}");
}

fn run_in(folder: &tempfile::TempDir, words: &str) -> (i32, String, String) {
    let output = radwalk().current_dir(folder.path()).args(words.split_whitespace()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

/// README is a page, ARCHITECTURE a quarter of an hour, and all documents but results, README, ARCHITECTURE and CHANGELOG together a short book.
#[test]
fn documents_are_short() {
    let lines = read("README.md").lines().count();
    assert!(lines < 100, "{lines} lines");
    let words = |page: &Path| read(page).split_whitespace().count();
    let architecture = words(Path::new("ARCHITECTURE.md"));
    assert!(architecture <= 3500, "{architecture} words");
    let others = ["CONTRIBUTING.md", "SECURITY.md", "crates/python/README.md"].map(PathBuf::from);
    let all: usize = pages().iter().skip(1).chain(&others).map(|page| words(page)).sum();
    assert!(all <= 35_000, "{all} words");
}

/// `check` finds no fault in any job that comes with the program.
#[test]
fn examples_pass_their_own_check() {
    let folder = fs::read_dir(Path::new(ROOT).join("configs")).unwrap();
    let jobs: Vec<_> = folder.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()).collect();
    assert!(jobs.len() > 5, "{jobs:?}");
    for job in jobs {
        let (code, stdout, stderr) = run(&["check", job.to_str().unwrap()]);
        assert_eq!(code, 0, "{job:?}: {stdout}{stderr}");
    }
}
