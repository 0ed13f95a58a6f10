//! Tests of meshes end to end: `run`, `check`, the doctor, `new`.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::support::{self, columns, run, run_job};

/// A folder that no other test uses.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("import").join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// The inner sides of a unit cube as polygons of an OBJ file, z up, the ceiling of the material `lamp`.
const OBJ: &str = "mtllib cube.mtl\no Cube\n\
    v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    usemtl wall\nf 1 2 3 4\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n\
    usemtl lamp\nf 5 8 7 6\n";

const MTL: &str = "newmtl wall\nKd 0.5 0.5 0.5\nKs 0.25 0.25 0.25\nnewmtl lamp\nKd 0 0 0\nKe 3 3 3\n";

/// The OBJ cube as a scene file.
fn toml() -> String {
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let faces = [[1, 2, 3, 4], [1, 5, 6, 2], [4, 3, 7, 8], [1, 4, 8, 5], [2, 6, 7, 3], [5, 8, 7, 6]];
    let mut text = "[material.wall]\nreflectance = 0.5\n[material.lamp]\nemittance = 3\n".to_owned();
    for (number, [a, b, c, d]) in faces.into_iter().enumerate() {
        let material = if number == 5 { "lamp" } else { "wall" };
        for triangle in [[a, b, c], [a, c, d]] {
            let triangle = triangle.map(|corner: usize| corners[corner - 1]);
            text += &format!("[[surface]]\nmaterial = \"{material}\"\ntriangle = {triangle:?}\n");
        }
    }
    text
}

fn written(name: &str) -> PathBuf {
    let folder = folder(name);
    std::fs::write(folder.join("cube.obj"), OBJ).unwrap();
    std::fs::write(folder.join("cube.mtl"), MTL).unwrap();
    std::fs::write(folder.join("cube.toml"), toml()).unwrap();
    folder
}

#[test]
fn a_mesh_has_the_bytes_of_its_scene_but_names() {
    let folder = written("bytes");
    let rows = |file: &str, more: &[&str]| {
        let out = folder.join(format!("out-{file}"));
        let given = ["--set", "method.walk=shooting", "--set", "scene.patches=given"];
        let args = [&["--paths", "20000", "--workers", "2"], &given[..], more].concat();
        let summary = run_job(folder.join(file).to_str().unwrap(), &out, &args);
        (columns(&out.join("patches.csv")), summary)
    };
    let (mut toml, summary) = rows("cube.toml", &[]);
    assert!(summary.get("import").is_none());
    let (mut obj, summary) = rows("cube.obj", &["--set", "import.up=z", "--set", "import.sides=1"]);
    assert!(summary["import"].to_string().contains("mirror-like in part"));
    assert_eq!((summary["escaped"].as_u64(), summary["absorbed_back"].as_u64()), (Some(0), Some(0)));
    assert_eq!(obj.remove("surface").unwrap()[2], "Cube:1");
    toml.remove("surface");
    assert_eq!(obj, toml);
}

#[test]
fn the_doctor_finds_turns_and_names() {
    let folder = written("doctor");
    let file = folder.join("cube.obj");
    std::fs::write(&file, OBJ.replace("f 1 4 8 5", "f 5 8 4 1")).unwrap();
    let file = file.to_str().unwrap();
    let sides = ["--set", "import.up=z", "--set", "import.sides=1"];
    let out = folder.join("found");
    let out = ["--out", out.to_str().unwrap()];
    let check = |more: &[&str]| run(&[&["check", file], &sides[..], &out[..], more].concat());
    let (code, said, _) = check(&["--fix-report"]);
    assert!(code == 1 && said.contains("fault 2: flipped: Cube:3 is turned round"), "{said}");
    let (code, said, _) = check(&["--repair"]);
    assert!(code == 1 && said.contains("cube.repaired.toml"), "{said}");
    let repaired = folder.join("cube.repaired.toml");
    let (code, said, _) = run(&["check", repaired.to_str().unwrap(), "--fix-report"]);
    assert!(code == 0 && said.contains("the doctor finds nothing wrong"), "{said}");
    let (code, _, said) = check(&["--repair"]);
    assert!(code == 2 && said.contains("is there already"), "{said}");
    let (code, said, _) = check(&["--set", "import.repair=true", "--fix-report"]);
    assert!(code == 0 && said.contains("turned round, the file is unchanged: Cube:3"), "{said}");
    assert!(said.contains("the doctor finds nothing wrong"), "{said}");
}

/// The test above covers `import.repair` and `--repair`. The folder has every finding, and a picture of each of the
/// worst.
#[test]
fn the_doctor_draws_what_it_finds() {
    let folder = written("pictures");
    let file = folder.join("cube.obj");
    std::fs::write(&file, OBJ.replace("f 1 4 8 5", "f 5 8 4 1")).unwrap();
    let out = folder.join("found");
    let keys = ["import.up=z", "import.sides=1", "import.join=false"];
    let args = keys.iter().flat_map(|key| ["--set", key]).chain(["--fix-report", "--out"]);
    let args: Vec<&str> = args.collect();
    let (code, said, _) =
        run(&[&["check", file.to_str().unwrap()], &args[..], &[out.to_str().unwrap()]].concat());
    assert_eq!(code, 1, "{said}");
    let text = std::fs::read_to_string(out.join("doctor.txt")).unwrap();
    assert!(
        text.starts_with("1. flipped: Cube:3 is turned round") && text.contains("1 more of Cube like it"),
        "{text}"
    );
    let picture = std::fs::read(out.join("finding-01.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    // A sound scene leaves no folder behind.
    let (code, said, _) = run(&[
        "check",
        folder.join("cube.toml").to_str().unwrap(),
        "--fix-report",
        "--out",
        out.join("none").to_str().unwrap(),
    ]);
    assert!(code == 0 && said.contains("finds nothing wrong") && !out.join("none").exists(), "{said}");
}

/// Tests the units of summary, check and plan; the numbers are those of the scene in watts.
#[test]
fn lumens_in_lux_out() {
    let folder = written("luminous");
    let job = folder.join("cube.toml");
    let job = job.to_str().unwrap();
    let runs = ["radiant", "luminous"].map(|light| {
        let out = folder.join(light);
        let summary =
            run_job(job, &out, &["--paths", "20000", "--workers", "1", "--set", &format!("light={light}")]);
        (summary, std::fs::read(out.join("patches.csv")).unwrap())
    });
    assert!(runs[0].1 == runs[1].1 && runs[0].0["job_hash"] == runs[1].0["job_hash"]);
    let units = |run: usize| runs[run].0["units"].to_string();
    assert_eq!(
        units(0),
        r#"{"irradiance":"W/m²","light":"radiant","power":"W","radiance":"W/(m² sr)","radiosity":"W/m²"}"#
    );
    assert_eq!(
        units(1),
        r#"{"irradiance":"lx","light":"luminous","power":"lm","radiance":"cd/m²","radiosity":"lm/m²"}"#
    );
    for (light, unit) in [("radiant", " W in all"), ("luminous", " lm in all")] {
        let (_, said, _) = run(&["check", job, "--set", &format!("light={light}")]);
        assert!(said.contains(unit), "{said}");
    }
}

/// A worker runs in another folder after the mesh was removed: it gets the scene from the coordinator.
#[test]
fn workers_need_no_file() {
    let folder = written("no-file");
    let [out, access, elsewhere] = ["out", "access.json", "elsewhere"].map(|name| folder.join(name));
    std::fs::create_dir(&elsewhere).unwrap();
    let mut command = support::radwalk();
    command.args(["coordinate", "--quiet", "--paths", "20000", "--set", "import.up=z"]);
    command.args(support::SMALL_PICTURE);
    command.arg(folder.join("cube.obj")).arg("--out").arg(&out).arg("--access").arg(&access);
    let coordinator = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    support::wait_for("the access file", || access.exists().then_some(()));
    std::fs::remove_file(folder.join("cube.obj")).unwrap();
    std::fs::remove_file(folder.join("cube.mtl")).unwrap();
    let worker = support::radwalk()
        .current_dir(&elsewhere)
        .args(["work", "--quiet", "--access"])
        .arg(&access)
        .spawn()
        .unwrap();
    let (code, _, stderr) = support::finish(coordinator);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(support::finish(worker).0, 0);
    assert_eq!(support::summary(&out)["paths"].as_u64(), Some(20_000));
}

#[test]
fn new_scenes_run_and_are_sound() {
    let folder = folder("new");
    let out = folder.to_str().unwrap();
    for kind in ["box", "room", "cornell"] {
        let (code, said, error) = run(&["new", kind, "--out", out]);
        assert_eq!(code, 0, "{said}{error}");
        let job = folder.join(format!("{kind}.toml"));
        let first_line =
            |file: &Path| std::fs::read_to_string(file).unwrap().lines().next().unwrap().to_owned();
        for (file, schema) in [
            (job.clone(), "schema/job.json"),
            (folder.join(format!("scenes/{kind}.toml")), "../schema/scene.json"),
        ] {
            assert_eq!(first_line(&file), format!("#:schema {schema}"));
            assert!(file.parent().unwrap().join(schema).exists(), "{}", file.display());
        }
        let results = folder.join(kind);
        run_job(job.to_str().unwrap(), &results, &["--paths", "5000", "--workers", "1"]);
        let (code, _, error) = run(&["new", kind, "--out", out]);
        assert!(code == 2 && error.contains("is there already"), "{error}");
        if kind != "cornell" {
            let (_, said, _) = run(&["check", job.to_str().unwrap(), "--fix-report"]);
            assert!(said.contains("the doctor finds nothing wrong"), "{kind}: {said}");
        }
    }
}

/// A box without lamps and with a white material: it runs as it is, its notes are few, and each remedy that they offer runs, too.
#[test]
fn a_mesh_runs_as_it_is_and_each_remedy_does() {
    let folder = folder("as-it-is");
    let file = folder.join("cube.obj");
    std::fs::write(&file, OBJ.replace("usemtl lamp", "usemtl Red.003")).unwrap();
    std::fs::write(
        folder.join("cube.mtl"),
        "newmtl wall\nKd 1 1 1\nKs 1 1 1\nd 0.5\nnewmtl Red.003\nKd 0 0 0\n",
    )
    .unwrap();
    let (file, out) = (file.to_str().unwrap(), folder.join("out"));
    let out = ["--paths", "2000", "--workers", "1", "--force", "--out", out.to_str().unwrap()];
    let go = |more: &[String]| {
        let more: Vec<&str> = more.iter().map(String::as_str).collect();
        run(&[&["run", file, "--set", "import.up=z"], &out[..], &more].concat())
    };
    let (code, _, stderr) = go(&[]);
    assert_eq!(code, 0, "{stderr}");
    let notes: Vec<&str> =
        stderr.lines().filter_map(|line| line.split_once("note: ")).map(|(_, note)| note).collect();
    assert!((4..=10).contains(&notes.len()), "{stderr}");
    assert!(notes[0].starts_with("cube.obj: nothing in the file emits"), "{stderr}");
    let mut tried = 0;
    for note in notes {
        // What a shell makes of the arguments that the note offers.
        for (at, flag) in note.match_indices("--") {
            let typed = &note[at..];
            let (words, rest) = match typed.split_once(" '") {
                Some((flag, quoted)) if flag == "--set" => (flag, quoted.split_once('\'').unwrap().0),
                _ => typed.split_once([' ', '=', ';', ',']).unwrap_or((typed, "")),
            };
            let value = rest.split([' ', ';', ',']).next().unwrap();
            let remedy = match (words, flag) {
                ("--set", _) if typed.starts_with("--set '") => vec!["--set".to_owned(), rest.to_owned()],
                ("--sky", _) => vec![format!("--sky={value}")],
                (words, _) => vec![words.to_owned(), value.to_owned()],
            };
            let (code, _, stderr) = go(&remedy);
            assert_eq!(code, 0, "{remedy:?}: {stderr}");
            tried += 1;
        }
    }
    assert!(tried >= 5, "{tried} remedies");
    let (code, _, stderr) = go(&["--strict".into()]);
    assert!(code == 2 && stderr.contains("reflectance_limit = 0.95"), "{stderr}");
    let (code, said, _) =
        run(&["check", file, "--json", "--set", "import.material.\"Red.003\".emittance=10"]);
    let json: serde_json::Value = serde_json::from_str(&said).unwrap();
    let row = json["materials"].as_array().unwrap().iter().find(|row| row["name"] == "Red.003").unwrap();
    assert_eq!((code, &row["emittance"][0], &row["area"]), (0, &10.0.into(), &1.0.into()), "{said}");
    assert_eq!(
        (&json["scene"]["extent"][2], json["faults"].as_array().unwrap().len()),
        (&1.0.into(), 0),
        "{said}"
    );
    // What cannot be run is shown all the same, with its fault.
    let strict = ["--strict", "--set", "import.reflectance_limit=0.9"];
    let (code, said, _) = run(&[&["check", file], &strict[..]].concat());
    assert!(
        code == 1
            && said.contains("fault 1: ")
            && said.contains("no emitter")
            && said.contains("\"Red.003\""),
        "{said}"
    );
}

/// The arguments that a note offers, as they stand there: from `--` to a space outside quotes, and the word behind `--set` and `--light`.
fn offered(note: &str) -> Vec<String> {
    let word = |text: &str| {
        let (mut quoted, mut escaped) = (false, false);
        let ends = |letter: char| {
            quoted ^= letter == '\'' && !escaped;
            escaped = letter == '\\' && !quoted;
            letter == ' ' && !quoted
        };
        text.find(ends).unwrap_or(text.len())
    };
    let starts = note.match_indices("--").filter(|(at, _)| *at == 0 || note[..*at].ends_with(' '));
    let typed = starts.map(|(at, _)| {
        let first = word(&note[at..]);
        let more = ["--set ", "--light "].iter().any(|flag| note[at..].starts_with(flag));
        let end = if more { first + 1 + word(&note[at + first + 1..]) } else { first };
        note[at..at + end].trim_end_matches([';', ',']).to_owned()
    });
    typed.collect()
}

/// What `check --json` tells of a file with arguments that a shell reads: exit code, notes, names of materials, error.
fn noted(file: &Path, typed: &str) -> (i32, Vec<String>, Vec<String>, String) {
    let command = format!("'{}' check '{}' --json {typed}", env!("CARGO_BIN_EXE_radwalk"), file.display());
    let done = std::process::Command::new("sh").args(["-c", &command]).output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap_or_default();
    let texts = |values: &serde_json::Value, text: fn(&serde_json::Value) -> &serde_json::Value| {
        let values = values.as_array().into_iter().flatten();
        values.map(|value| text(value).as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let (notes, names) = (texts(&json["notes"], |note| note), texts(&json["materials"], |row| &row["name"]));
    (done.status.code().unwrap(), notes, names, String::from_utf8_lossy(&done.stderr).into_owned())
}

/// An image of 2 × 1 pixels, white and grey (BMP).
fn bmp() -> Vec<u8> {
    let mut bytes = b"BM".to_vec();
    let words = |numbers: &[u32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    bytes.extend(words(&[62, 0, 54, 40, 2, 1, 24 << 16 | 1, 0, 8, 0, 0, 0, 0]));
    bytes.extend([255, 255, 255, 128, 128, 128, 0, 0]);
    bytes
}

/// Every remedy that a note offers can be copied to a shell as it stands, and takes the note away or changes it.
#[test]
fn every_remedy_can_be_copied_and_works() {
    let folder = folder("remedies");
    let put = |name: &str, content: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    put("wood.bmp", &bmp());
    put(
        "all.mtl",
        b"newmtl bare wall's\nKd 1 1 1\nKs 1 1 1\nnewmtl glass\nKd 0 0 0\nd 0.1\nnewmtl wood\nmap_Kd wood.bmp\n\
          newmtl lost\nKd 0.5 0.5 0.5\nmap_Kd gone.png\nnewmtl panel\nKd 0.1 0.1 0.1\nKe 1 1 1\nmap_Ke wood.bmp\n",
    );
    let cube = |materials: [&str; 6]| {
        let mut materials = materials.iter();
        let text = OBJ.replace("mtllib cube.mtl\n", "mtllib all.mtl\nvt 0 0\nvt 1 0\nvt 1 1\n");
        let lines = text.lines().filter(|line| !line.starts_with("usemtl")).map(|line| {
            match line.strip_prefix("f ") {
                Some(corners) => format!("usemtl {}\nf {corners}\n", materials.next().unwrap()),
                None => format!("{line}\n"),
            }
        });
        lines.collect::<String>()
    };
    let dark = cube(["bare wall's", "glass", "wood", "lost", "unknown", "unknown"]);
    let lit = cube(["wood", "wood", "lost", "wood", "wood", "panel"]) + "f 1 2 2\nf 1 2 3 4\n";
    let large = "# File units = inches\nv 0 0 0\nv 160 0 0\nv 0 0 200\nv 0 100 0\nf 1 2 3\nf 1 2 4\n";
    let mgf = "m red =\n\tc red =\n\t\tcxy 0.7 0.3\n\trd 0.5\nm lamp =\n\tc\n\ted 9\nv a =\n\tp 0 0 0\nv b =\n\tp 0 0 4\nm red\nsph a 1\nm lamp\nsph b 1\n";
    let gltf = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1,2]}],"nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}}},
        {"translation":[0.2,0.2,1],"extensions":{"KHR_lights_punctual":{"light":1}}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"componentType":5126,"count":3,"type":"VEC3","bufferView":0}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional"},{"type":"point","name":"Bulb","intensity":9}]}}}"#;
    let mut tried = 0;
    for (name, content) in [
        ("dark.obj", &dark[..]),
        ("lit.obj", &lit[..]),
        ("large.obj", large),
        ("curved.mgf", mgf),
        ("lights.gltf", gltf),
    ] {
        let file = put(name, content.as_bytes());
        let (code, notes, _, error) = noted(&file, "");
        assert!(code < 2 && (1..=10).contains(&notes.len()), "{name}: {code} {notes:?} {error}");
        for note in &notes {
            for typed in offered(note) {
                let (code, after, names, error) = noted(&file, &typed);
                let works = match () {
                    () if typed.contains("faults=refuse") => code == 2 && error.contains("Cube:"),
                    () if typed.starts_with("--sky") => code < 2 && names.contains(&"sky".to_owned()),
                    () => code < 2 && !after.contains(note),
                };
                assert!(works, "{typed}: {code} {error}\n{after:?}");
                tried += 1;
            }
        }
    }
    assert!(tried >= 16, "{tried} remedies");
}
