//! Tests of sensors as users meet them: tables, targets, workers that come and go, and the words of `check`.

use std::path::{Path, PathBuf};

use crate::support::{answer, columns, draw_job, numbers, path, run, run_job, storms_leave_no_trace};
use serde_json::Value;
use tempfile::{TempDir, tempdir};

/// A quad of six cells and a point.
pub(crate) const SENSORS: &str = "
[[sensor]]
name    = \"desk\"
quad    = [[0.2, 0.3, 0.5], [0.8, 0.3, 0.5], [0.2, 0.7, 0.5]]
patches = [3, 2]

[[sensor]]
name   = \"eye\"
point  = [0.5, 0.1, 0.6]
normal = [0, 1, 0]
";

/// The 54-patch cube with these tables after its surfaces.
fn cube_with(folder: &TempDir, sensors: &str) -> PathBuf {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let scene = std::fs::read_to_string(configs.join("scenes/cube54.toml")).unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene + sensors).unwrap();
    let job = "scene = \"scene.toml\"\nseed = 42\n[method]\nwalk = \"shooting\"\n[budget]\npaths = 300_000\nstream_paths = 5000\n";
    let path = folder.path().join("cube.toml");
    std::fs::write(&path, job).unwrap();
    path
}

/// The outputs that must not depend on how a job was run, the table of its sensors included.
fn all(out: &Path) -> (String, Vec<u8>, Vec<u8>) {
    let (hash, patches) = answer(out);
    (hash, patches, std::fs::read(out.join("sensors.csv")).unwrap())
}

fn sensed(job: &Path, out: &Path, args: &[&str]) -> Value {
    run_job(job.to_str().unwrap(), out, args)
}

/// Tests walks, whose samples begin and end within leases, and chains.
#[test]
fn workers_leave_no_trace_in_sensors_nor_sensors_in_patches() {
    let folder = tempdir().unwrap();
    let job = cube_with(&folder, SENSORS);
    for method in ["walk=shooting", "walk=gathering", "walk=jacobi"] {
        let set = format!("method.{method}");
        let [one, many, part] =
            ["one", "many", "part"].map(|name| path(&folder, &format!("{name}-{method}")));
        let chosen = ["--set", &set, "--set", "method.batch_paths=10000"];
        let set = if method == "walk=jacobi" { &chosen[..] } else { &chosen[..2] };
        let summary = draw_job(job.to_str().unwrap(), &one, &[set, &["--workers", "1"]].concat());
        let samples = if method == "walk=jacobi" { 30 } else { 300_000 / 1024 };
        assert_eq!(summary["sensors"]["samples"], samples, "{summary}");
        assert!(summary["sensors"]["rays"].as_u64().unwrap() > summary["rays"].as_u64().unwrap() / 5);
        assert_eq!(summary["sensors"]["list"][0]["name"], "desk");
        assert!(summary["checks"].as_array().unwrap().iter().all(|check| check["ok"] != false), "{summary}");

        // The second run has other leases, more workers, and two parts.
        sensed(&job, &many, &[set, &["--workers", "3", "--set", "budget.stream_paths=1777"]].concat());
        assert!(all(&many) == all(&one), "{method}: 3 workers");
        sensed(&job, &part, &[set, &["--paths", "110000"]].concat());
        sensed(&job, &part, &[set, &["--resume"]].concat());
        assert!(all(&part) == all(&one), "{method}: resumed");
        let (code, _, stderr) = run(&["audit", part.to_str().unwrap(), "--share", "1", "--quiet"]);
        assert_eq!(code, 0, "{stderr}");

        // The files can be made again from the tally alone; a table that was changed is found.
        let table = std::fs::read(one.join("sensors.csv")).unwrap();
        std::fs::write(one.join("sensors.csv"), &table[1..]).unwrap();
        let (code, _, stderr) = run(&["audit", one.to_str().unwrap(), "--share", "0.01", "--quiet"]);
        assert!(code == 3 && stderr.contains("sensors.csv"), "{code} {stderr}");
        assert_eq!(run(&["report", one.to_str().unwrap(), "--quiet"]).0, 0);
        assert_eq!(std::fs::read(one.join("sensors.csv")).unwrap(), table);
        let page = std::fs::read_to_string(one.join("report.html")).unwrap();
        assert!(page.contains("<th scope=\"row\">desk</th><td>6</td>"), "{method}");

        // The results of patches do not depend on sensors.
        let plain = path(&folder, &format!("plain-{method}"));
        let without = [set, &["--set", "scene=plain.toml"]].concat();
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/scenes/cube54.toml");
        std::fs::copy(scene, folder.path().join("plain.toml")).unwrap();
        let bare = sensed(&job, &plain, &without);
        assert!(answer(&plain).1 == answer(&one).1, "{method}: patches.csv");
        assert_eq!(bare["scene_hash"], summary["scene_hash"]);
        assert_ne!(bare["job_hash"], summary["job_hash"]);
        assert_eq!((bare.get("sensors"), plain.join("sensors.csv").exists()), (None, false));
    }
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_sensors() {
    let folder = tempdir().unwrap();
    let job = cube_with(&folder, SENSORS);
    storms_leave_no_trace(job.to_str().unwrap(), &["--paths", "5000000"]);
}

#[test]
fn the_table_has_a_row_a_patch_and_three_columns_in_colour() {
    let folder = tempdir().unwrap();
    let job = cube_with(&folder, SENSORS);
    let out = path(&folder, "grey");
    sensed(&job, &out, &[]);
    let text = std::fs::read_to_string(out.join("sensors.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("sensor,u,v,x,y,z,irradiance,std_error,ci_low,ci_high"));
    assert!(lines.next().unwrap().starts_with("desk,0,0,0.3"), "{text}");
    assert!(text.lines().last().unwrap().starts_with("eye,0,0,0.5,0.1,0.6,"), "{text}");
    let table = columns(&out.join("sensors.csv"));
    assert_eq!(table["u"], ["0", "0", "1", "1", "2", "2", "0"]);
    assert_eq!(table["v"], ["0", "1", "0", "1", "0", "1", "0"]);
    let [h, error, low, high] =
        ["irradiance", "std_error", "ci_low", "ci_high"].map(|name| numbers(&table[name]));
    for i in 0..7 {
        assert!(low[i] < h[i] && h[i] < high[i] && error[i] > 0.0 && error[i] < 0.1 * h[i], "{text}");
    }
    let scene = std::fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    std::fs::write(
        folder.path().join("scene.toml"),
        scene.replacen("reflectance = 0.8", "reflectance = [0.8, 0.5, 0.2]", 1),
    )
    .unwrap();
    let out = path(&folder, "colour");
    sensed(&job, &out, &[]);
    let text = std::fs::read_to_string(out.join("sensors.csv")).unwrap();
    let header = "sensor,u,v,x,y,z,irradiance_r,irradiance_g,irradiance_b,std_error_r,std_error_g,std_error_b,\
                  ci_low_r,ci_low_g,ci_low_b,ci_high_r,ci_high_g,ci_high_b";
    assert_eq!(text.lines().next(), Some(header));
    let table = columns(&out.join("sensors.csv"));
    let [red, blue] = ["irradiance_r", "irradiance_b"].map(|name| numbers(&table[name]));
    assert!(red.iter().zip(&blue).all(|(red, blue)| red > blue), "{text}");
}

/// A target on sensors ends the run before its budget, whether patches are known or not; with targets on both, the run
/// waits for both.
#[test]
fn a_target_on_sensors_stops_the_run() {
    let folder = tempdir().unwrap();
    let job = cube_with(&folder, SENSORS);
    let stopped = |name: &str, set: &[&str]| {
        let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
        let out = path(&folder, name);
        let summary = sensed(&job, &out, &[&["--paths", "4000000"][..], &set].concat());
        assert_eq!(summary["sensors"]["reached"], true, "{summary}");
        let table = columns(&out.join("sensors.csv"));
        let [h, low, high] = ["irradiance", "ci_low", "ci_high"].map(|name| numbers(&table[name]));
        let errors: Vec<f64> = (0..h.len()).map(|i| 0.5 * (high[i] - low[i]) / h[i]).collect();
        (summary["paths"].as_u64().unwrap(), errors, out)
    };
    let (all, errors, out) = stopped("all", &["target.sensors=0.02"]);
    assert!(all < 4_000_000 && errors.iter().all(|&error| error <= 0.02), "{all}: {errors:?}");
    let (one, errors, _) = stopped("one", &["target.sensors.desk=0.05"]);
    assert!(one < all && errors[..6].iter().all(|&error| error <= 0.05), "{one}: {errors:?}");
    let both = ["target.sensors=0.05", "target.relative_error=0.03", "target.fraction=0.9"];
    let (both, ..) = stopped("both", &both);
    assert!(both > one, "{both}");

    // The target sets when to stop, not the walks; if the budget ends first, the exit code says so.
    let straight = path(&folder, "straight");
    sensed(&job, &straight, &["--paths", &all.to_string()]);
    assert!(self::all(&straight) == self::all(&out));
    let missed = path(&folder, "missed");
    let [job, missed] = [&job, &missed].map(|path| path.to_str().unwrap());
    let short = ["run", job, "--out", missed, "--paths", "20000", "--set", "target.sensors=0.001"];
    let (code, stdout, stderr) = run(&short);
    assert_eq!(code, 1, "{stdout}{stderr}");
    assert!(stdout.contains("sensor \"desk\" (6 patches): known within"), "{stdout}");
    assert!(
        stdout.contains("0.100 % is asked for") && stdout.contains("target of sensors not reached"),
        "{stdout}"
    );
}

#[test]
fn check_tells_of_sensors_that_lie_badly() {
    let folder = tempdir().unwrap();
    let bad = "
[[sensor]]
name   = \"under the floor\"
point  = [0.5, 0.5, -0.5]
normal = [0, 0, 1]

[[sensor]]
name   = \"outwards\"
point  = [0.5, 0.5, 0]
normal = [0, 0, -1]
";
    let job = cube_with(&folder, &format!("{SENSORS}{bad}"));
    let job = job.to_str().unwrap();
    let (code, stdout, stderr) = run(&["check", job, "--set", "target.sensors.desk=0.05"]);
    assert_eq!(code, 1, "{stderr}");
    assert!(
        stdout.contains("sensor \"desk\": 6 patches\n") && stdout.contains("sensor \"eye\": a point\n"),
        "{stdout}"
    );
    assert!(
        stdout.contains("target: relative half-width 0.05 on every patch of sensor \"desk\""),
        "{stdout}"
    );
    assert!(
        stdout.contains("fault 1: sensor \"under the floor\": 100.000 % of the surfaces that it faces"),
        "{stdout}"
    );
    assert!(stdout.contains("behind a wall or inside one"), "{stdout}");
    assert!(stdout.contains("fault 2: sensor \"outwards\": it faces away from the scene"), "{stdout}");
    assert!(!stdout.contains(": sensor \"desk\": ") && !stdout.contains("no fault found"), "{stdout}");
    let few = ["check", job, "--set", "method={walk=\"gathering\",birth={patches=[3]}}"];
    let (code, _, stderr) = run(&few);
    assert!(code == 2 && stderr.contains("born on chosen patches"), "{code} {stderr}");
}

/// What a plan predicts of a target on sensors is where runs end: of four seeds no end lies beyond the plan's range by more than one
/// look, which is a factor of 1.5. The pilots' errors have standard errors of 2 on either side of them; the seeds are fixed.
#[test]
fn plans_predict_targets_on_sensors() {
    let folder = tempdir().unwrap();
    let job = cube_with(&folder, SENSORS);
    for seed in ["1", "2", "3", "4"] {
        let set = ["--set", "target.sensors=0.004", "--seed", seed, "--paths", "40000000"];
        let (code, stdout, stderr) = run(&[&["plan", job.to_str().unwrap(), "--json"][..], &set].concat());
        assert_eq!(code, 0, "{stderr}");
        let plan: Value = serde_json::from_str(&stdout).unwrap();
        assert!(plan["sensors"].as_str().unwrap().contains("\"desk\""), "{plan}");
        let [least, most] = ["least_paths", "most_paths"].map(|end| plan["ending"][end].as_u64().unwrap());
        let pilot = plan["pilot"]["paths"].as_u64().unwrap();
        let summary = sensed(&job, &path(&folder, seed), &set);
        let paths = summary["paths"].as_u64().unwrap();
        assert!(pilot < paths, "the pilot is the run: {pilot} of {paths}");
        assert!(2 * least <= 3 * paths && 2 * paths <= 3 * most, "{paths}, not {least} … {most}");
    }
}
