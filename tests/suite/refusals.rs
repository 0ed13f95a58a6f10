//! Tests of bad input of any kind: exit code 2, one message with the problem, the reason and the remedy, and no loss.

use std::fs;

use crate::support::{path, run};
use tempfile::tempdir;

/// Runs a command that must be refused. Returns the message.
fn refused(code: i32, args: &[&str]) -> String {
    let (got, stdout, stderr) = run(args);
    assert_eq!(got, code, "{args:?}: {stdout}{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert_eq!(stderr.trim().lines().count(), 1, "one message: {stderr}");
    stderr
}

#[test]
fn bad_jobs_and_scenes_are_refused_in_words() {
    let folder = tempdir().unwrap();
    let scene = "[material.m]\nreflectance = R\nemittance = E\n\n[[surface]]\nname = \"s\"\nmaterial = \"m\"\nquad = QUAD\n";
    let good_quad = "[[0,0,0],[1,0,0],[0,1,0]]";
    let cases = [
        ("1.0", "1", good_quad, "reflectance"),
        ("-0.1", "1", good_quad, "reflectance"),
        ("nan", "1", good_quad, "reflectance"),
        ("0.5", "-1", good_quad, "emittance"),
        ("0.5", "inf", good_quad, "emittance"),
        ("0.5", "0", good_quad, "no emitter"),
        ("0.5", "1", "[[0,0,0],[1,0,0],[2,0,0]]", "no area"),
        ("0.5", "1", "[[0,0,0],[1,0,0],[0,nan,0]]", "quad"),
        ("0.5", "1", "[[0,0,0],[1,0,0]]", "quad"),
    ];
    for (r, e, quad, word) in cases {
        let text = scene
            .replace("= R\n", &format!("= {r}\n"))
            .replace("= E\n", &format!("= {e}\n"))
            .replace("QUAD", quad);
        let (scene, job) = (path(&folder, "scene.toml"), path(&folder, "job.toml"));
        fs::write(&scene, text).unwrap();
        fs::write(&job, "scene = \"scene.toml\"\n[budget]\npaths = 1000\n").unwrap();
        let out = path(&folder, "out");
        for command in ["run", "exact"] {
            let message = refused(2, &[command, job.to_str().unwrap(), "--out", out.to_str().unwrap()]);
            assert!(message.contains("scene.toml") && message.contains(word), "{r} {e} {quad}: {message}");
            assert!(!out.exists(), "nothing is made for a job that is refused");
        }
        refused(2, &["check", scene.to_str().unwrap()]);
    }
}

#[test]
fn bad_usage_is_refused() {
    let message = refused(2, &["run", "configs/no-such-job.toml"]);
    assert!(message.contains("no-such-job.toml"));
    refused(2, &["run", "tests/data/cube54.toml", "--set", "budget.paths=0"]);
    for page in ["--metrics", "--watch"] {
        let folder = tempdir().unwrap();
        let out = path(&folder, "out");
        let args =
            ["run", "tests/data/cube54.toml", page, "nonsense", "--quiet", "--out", out.to_str().unwrap()];
        assert!(refused(2, &args).contains(&format!("write {page} HOST:PORT")));
    }
    let folder = tempdir().unwrap();
    let dark = path(&folder, "dark.obj");
    fs::write(&dark, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    for option in ["--sky=5000", "--strict"] {
        let message = refused(2, &["run", "configs/cornell.toml", option]);
        assert!(message.contains(&format!("cornell.toml with {option}: ")), "{message}");
    }
    let strict = refused(2, &["run", dark.to_str().unwrap(), "--strict"]);
    assert!(strict.contains("--light") && strict.contains("--sky"), "{strict}");
    let access = path(&folder, "access.json");
    fs::write(&access, "{}").unwrap();
    let early = refused(2, &["status", access.to_str().unwrap()]);
    assert!(early.contains("has reported by it yet") && early.contains("ask again"), "{early}");
    assert!(!refused(2, &["lamp", "configs"]).contains(".toml"));
    refused(2, &["run", "tests/data/cube54.toml", "--set", "bugdet.paths=10"]);
    refused(
        2,
        &["run", "tests/data/cube54.toml", "--set", "method.walk=jacobi", "--set", "method.space=continuous"],
    );
    let mixed = ["check", "tests/data/cube54.toml", "--light", "a=100lm", "--light", "b=60W"];
    assert!(refused(2, &mixed).contains("\"b\" in W"));
    // MGF is in lumens.
    let (file, light) = (path(&folder, "lamp.mgf"), "m em =\n\ted 100\n");
    let square = "v a =\n\tp 0 0 0\nv b =\n\tp 1 0 0\nv c =\n\tp 0 1 0\nm em\nf a b c\n";
    fs::write(&file, [light, square].concat()).unwrap();
    assert!(refused(2, &["run", file.to_str().unwrap(), "--light", "em=60W"]).contains("\"em\" in W"));
    let (code, ..) = run(&["run"]);
    assert_eq!(code, 2);
    let (code, ..) = run(&["run", "tests/data/cube54.toml", "--workers", "0"]);
    assert_eq!(code, 2);
    let (code, ..) = run(&["no-such-command"]);
    assert_eq!(code, 2);
}

#[test]
fn an_output_folder_in_use_is_refused_and_kept() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("patches.csv"), "precious").unwrap();
    let args =
        ["run", "tests/data/cube54.toml", "--paths", "1000", "--quiet", "--out", out.to_str().unwrap()];
    let message = refused(2, &args);
    assert!(message.contains("--force"), "{message}");
    assert_eq!(fs::read_to_string(out.join("patches.csv")).unwrap(), "precious");
    let (code, _, stderr) = run(&[&args[..], &["--force"]].concat());
    assert_eq!(code, 0, "{stderr}");
    assert_ne!(fs::read_to_string(out.join("patches.csv")).unwrap(), "precious");
}

#[test]
fn a_cluster_that_cannot_be_is_exit_code_3() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let message = refused(
        3,
        &["coordinate", "tests/data/cube54.toml", "--listen", "256.1.1.1:0", "--out", out.to_str().unwrap()],
    );
    assert!(message.contains("256.1.1.1"), "{message}");
    let access = path(&folder, "access.json");
    refused(2, &["work", "--access", access.to_str().unwrap(), "--wait", "0"]);
    fs::write(&access, "{\"address\": \"127.0.0.1:1\"").unwrap();
    refused(2, &["work", "--access", access.to_str().unwrap()]);
    let key = "00".repeat(32);
    let version = run(&["--version"]).1;
    let access_of = |build: &str| {
        let named = format!("\"run\": \"1\", \"build\": \"{build}\", \"scene\": \"{key}\"");
        format!("{{\"address\": \"127.0.0.1:1\", {named}, \"key\": \"{key}\"}}")
    };
    fs::write(&access, access_of(version.trim().trim_start_matches("radwalk "))).unwrap();
    let message = refused(3, &["work", "--access", access.to_str().unwrap(), "--wait", "0"]);
    assert!(message.contains("127.0.0.1:1"), "{message}");
    fs::write(&access, access_of("0.0.1+another")).unwrap();
    let message = refused(3, &["work", "--access", access.to_str().unwrap(), "--wait", "0"]);
    assert!(message.contains("0.0.1+another"), "{message}");
}

#[test]
fn check_says_what_will_be_modelled() {
    for file in ["configs/cornell.toml", "configs/scenes/cube54.toml"] {
        let (code, stdout, stderr) = run(&["check", file]);
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.contains("patches") && stdout.contains("no fault found"), "{stdout}");
    }
}

/// Surfaces of 4·10⁸ patches, enough of them to need more memory than there is, at 80 bytes per patch. To build them
/// would take minutes, and then the machine.
#[test]
#[cfg(target_os = "linux")]
fn a_scene_beyond_the_memory_is_refused_before_it_is_made() {
    let folder = tempdir().unwrap();
    let meminfo = std::fs::read_to_string("/proc/meminfo").unwrap();
    let kilobytes = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:")).unwrap();
    let bytes = 1024 * kilobytes.trim().trim_end_matches(" kB").parse::<u64>().unwrap();
    let surfaces = bytes / (80 * 400_000_000) + 1;
    let quad = |n: u64| {
        format!(
            "[[surface]]\nmaterial = \"white\"\nquad = [[0,0,{n}], [1,0,{n}], [0,1,{n}]]\npatches = [20000, 20000]\n"
        )
    };
    let material = "[material.white]\nreflectance = 0.5\nemittance = 1.0\n".to_owned();
    let scene = (0..surfaces).map(quad).fold(material, |scene, quad| scene + &quad);
    let file = path(&folder, "vast.toml");
    std::fs::write(&file, scene).unwrap();
    for command in ["check", "plan"] {
        let text = refused(2, &[command, file.to_str().unwrap()]);
        assert!(text.contains(&format!("{} patches", surfaces * 400_000_000)), "{text}");
        assert!(text.contains("GB") && text.contains("use coarser patches"), "{text}");
    }
}

#[test]
fn commands_of_the_laboratory_say_where_they_are() {
    for command in ["reproduce", "stability"] {
        for more in [&[][..], &["--quick", "--only", "scales", "--out", "nowhere"]] {
            let (code, stdout, stderr) = run(&[&[command], more].concat());
            assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
            assert!(
                stderr.lines().count() == 1 && stderr.contains(&format!("radwalk-lab {command}")),
                "{stderr}"
            );
        }
    }
}
