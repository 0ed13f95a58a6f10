//! Tests of the page and the files for other programs: they hold the numbers of the table, and are made again from the
//! tally.

use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use serde_json::Value;
use tempfile::tempdir;

use crate::support::{columns, run, summary};

const DERIVED: [&str; 7] = [
    "patches.csv",
    "summary.json",
    "radiosity.png",
    "report.html",
    "patches.vtu",
    "scene.glb",
    "patches.parquet",
];

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A short run of a job with every export.
fn run_with_exports(job: &str, out: &Path) {
    let (code, _, stderr) =
        run(&["run", job, "--paths", "20000", "--out", text(out), "--quiet", "--export", "vtu,glb,parquet"]);
    assert_eq!(code, 0, "{stderr}");
}

/// The text of an element of the page.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("id=\"{id}\">")).unwrap();
    rest.split_once("</script>").unwrap().0
}

fn inflate(packed: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(&STANDARD.decode(packed).unwrap()[..]).read_to_end(&mut bytes).unwrap();
    bytes
}

#[test]
fn the_page_holds_the_table_the_summary_and_the_corners() {
    let dir = tempdir().unwrap();
    run_with_exports("tests/data/cube54.toml", dir.path());
    let page = std::fs::read_to_string(dir.path().join("report.html")).unwrap();
    assert_eq!(inflate(element(&page, "table")), std::fs::read(dir.path().join("patches.csv")).unwrap());
    let facts: Value = serde_json::from_str(element(&page, "facts")).unwrap();
    assert_eq!(facts["summary"], summary(dir.path()));
    let corners: Vec<f32> = inflate(element(&page, "corners"))
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    assert_eq!(corners.len(), 54 * 12);
    let table = columns(&dir.path().join("patches.csv"));
    for (row, corners) in corners.chunks_exact(12).enumerate() {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let middle = corners.chunks_exact(3).map(|corner| corner[axis]).sum::<f32>() / 4.0;
            let centroid: f32 = table[name][row].parse().unwrap();
            assert!((middle - centroid).abs() < 1e-6, "row {row}: {middle}, not {centroid}");
        }
    }
    // The page fetches nothing from elsewhere: its icon is empty, so that browsers do not ask for one.
    let links: Vec<&str> = page.split("<link").skip(1).map(|link| link.split('>').next().unwrap()).collect();
    assert_eq!(links, [" rel=\"icon\" href=\"data:,\""]);
    assert!(!page.contains("src="));
}

#[test]
fn what_is_derived_is_made_again_from_the_tally() {
    let dir = tempdir().unwrap();
    run_with_exports("configs/cornell.toml", dir.path());
    let read = || DERIVED.map(|name| std::fs::read(dir.path().join(name)).unwrap());
    let before = read();
    DERIVED.iter().for_each(|name| std::fs::remove_file(dir.path().join(name)).unwrap());
    let (code, _, stderr) = run(&["report", text(dir.path()), "--export", "vtu,glb,parquet"]);
    assert_eq!(code, 0, "{stderr}");
    for ((name, before), after) in DERIVED.iter().zip(before).zip(read()) {
        assert!(before == after, "{name} differs");
    }
    // Exports that are not asked for do not stay beside a new result.
    let (code, _, _) = run(&["report", text(dir.path())]);
    assert_eq!(code, 0);
    assert!(!dir.path().join("scene.glb").exists() && dir.path().join("report.html").exists());
}

#[test]
fn vtk_files_have_the_numbers_of_the_table() {
    let dir = tempdir().unwrap();
    run_with_exports("configs/cornell.toml", dir.path());
    let text = std::fs::read_to_string(dir.path().join("patches.vtu")).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let table = columns(&dir.path().join("patches.csv"));
    let numbers = |name: &str| -> Vec<[u8; 8]> {
        let array = document.descendants().find(|node| node.attribute("Name") == Some(name)).unwrap();
        let bytes = STANDARD.decode(array.text().unwrap()).unwrap();
        let (length, values) = bytes.split_at(8);
        assert_eq!(u64::from_le_bytes(length.try_into().unwrap()), values.len() as u64);
        values.chunks_exact(8).map(|bytes| bytes.try_into().unwrap()).collect()
    };
    for name in ["radiosity_r", "std_error_g", "ci_high_b", "area"] {
        let written: Vec<Option<f64>> =
            numbers(name).into_iter().map(f64::from_le_bytes).map(|x| (!x.is_nan()).then_some(x)).collect();
        // An empty cell is no number.
        let expected: Vec<Option<f64>> = table[name].iter().map(|cell| cell.parse().ok()).collect();
        assert_eq!(written, expected, "{name}");
    }
    let hits: Vec<i64> = numbers("hits").into_iter().map(i64::from_le_bytes).collect();
    assert_eq!(hits, table["hits"].iter().map(|cell| cell.parse().unwrap()).collect::<Vec<i64>>());
    let types: Vec<i64> = numbers("types").into_iter().map(i64::from_le_bytes).collect();
    assert!(types.contains(&5) && types.contains(&9), "triangles and quads");
}

/// The importer reads what the exporter wrote: the same surface area, in triangles.
#[test]
fn a_scene_that_was_exported_is_read_again() {
    let dir = tempdir().unwrap();
    run_with_exports("tests/data/cube54.toml", dir.path());
    let scene = dir.path().join("scene.glb");
    // The mesh is white with no light of its own, which no job accepts.
    let grey = ["import.reflectance_limit=0.5", "import.material.radiosity.emittance=1"];
    let (code, stdout, stderr) = run(&["check", text(&scene), "--set", grey[0], "--set", grey[1]]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("108"), "54 patches are 108 triangles: {stdout}");
}

/// A scene with a quad and a point for sensors: their readings and their corners are in the page and in `scene.glb`.
#[test]
fn sensors_are_drawn_with_their_readings() {
    let dir = tempdir().unwrap();
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let scene = std::fs::read_to_string(configs.join("scenes/cube54.toml")).unwrap();
    let job = dir.path().join("scene.toml");
    std::fs::write(&job, scene + crate::sensors::SENSORS).unwrap();
    let out = dir.path().join("out");
    run_with_exports(text(&job), &out);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    let table = std::fs::read(out.join("sensors.csv")).unwrap();
    assert_eq!(inflate(element(&page, "sensor-table")), table);
    let corners: Vec<f32> = inflate(element(&page, "sensor-corners"))
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    assert_eq!(corners.len(), 7 * 12);
    let table = columns(&out.join("sensors.csv"));
    for (row, corners) in corners.chunks_exact(12).enumerate() {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let middle = corners.chunks_exact(3).map(|corner| corner[axis]).sum::<f32>() / 4.0;
            assert!(
                (middle - table[name][row].parse::<f32>().unwrap()).abs() < 1e-6,
                "row {row}: {corners:?}"
            );
        }
    }
    // The square of the point faces as the point does: its corners have its y.
    assert!(corners[72..].chunks_exact(3).all(|corner| (corner[1] - 0.1).abs() < 1e-7), "{corners:?}");

    let glb = std::fs::read(out.join("scene.glb")).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let nodes: Vec<&Value> = document["nodes"].as_array().unwrap().iter().skip(1).collect();
    assert_eq!(nodes.iter().map(|node| node["name"].as_str().unwrap()).collect::<Vec<_>>(), ["desk", "eye"]);
    let readings: Vec<f64> = nodes
        .iter()
        .flat_map(|node| node["extras"]["irradiance"].as_array().unwrap())
        .map(|h| h.as_f64().unwrap())
        .collect();
    let expected: Vec<f64> = table["irradiance"].iter().map(|cell| cell.parse().unwrap()).collect();
    // The reader of JSON rounds the last place as it likes.
    let is_read = |(read, written): (&f64, &f64)| (read - written).abs() <= 1e-15 * written.abs();
    assert_eq!(readings.len(), expected.len());
    assert!(readings.iter().zip(&expected).all(is_read), "{readings:?}, not {expected:?}");
    let mesh = &document["meshes"][nodes[0]["mesh"].as_u64().unwrap() as usize];
    assert_eq!(mesh["primitives"][0]["mode"], 1, "lines, which importers do not take for surfaces");
    assert_eq!(document["buffers"][0]["byteLength"].as_u64().unwrap() as usize, glb.len() - 28 - length);
    assert_eq!(document["scenes"][0]["nodes"], serde_json::json!([0, 1, 2]));
}

/// The check `escape`, the page and the doctor tell the same power, all channels together. The run's figures are the same to the last
/// digit; the doctor's is an estimate of other walks, and within 4 standard errors, with those of the run (a false alarm once in
/// 16,000, once and for all for this seed).
#[test]
fn power_that_leaves_is_one_figure_everywhere() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("out");
    let scene = ROOM_OF_ONE_COLOUR;
    let (file, job) = (folder.path().join("room.toml"), folder.path().join("job.toml"));
    std::fs::write(&file, scene).unwrap();
    std::fs::write(&job, "scene = \"room.toml\"\n").unwrap();
    let set = ["--set", "method.space=continuous", "--paths", "200000"];
    let (code, _, stderr) = run(&[&["run", text(&job), "--quiet", "--out", text(&out)], &set[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    let checks = summary(&out)["checks"].clone();
    let escape = checks.as_array().unwrap().iter().find(|check| check["name"] == "escape").unwrap();
    let message = escape["message"].as_str().unwrap();
    let (share, words) = message.split_once(" % of the power").unwrap();
    assert_eq!(words, ", all channels together, left the scene");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains(&format!("left the scene {share} %")), "{message}");
    let cell = "left the scene</th><td>";
    let cells = [cell.to_owned(), format!("{cell}{share} %</td>")].map(|text| page.matches(&text).count());
    assert_eq!(cells, [2, 2], "both tables have the figure of the check: {message}");
    let (code, stdout, stderr) =
        run(&["check", text(&file), "--fix-report", "--out", text(&folder.path().join("d"))]);
    let text = stdout
        .lines()
        .find(|line| line.contains("leaves the scene"))
        .unwrap_or_else(|| panic!("{code}: {stdout}{stderr}"));
    let number = |words: &str| words.trim().parse::<f64>().unwrap();
    let predicted = number(
        text.split_once("open: ").unwrap().1.split_once(" % of the power, all channels together,").unwrap().0,
    );
    let error = number(text.split_once("(± ").unwrap().1.split_once(',').unwrap().0);
    let share = number(share);
    // Of 200,000 walks whose weights are at most 3.
    let of_run = 100.0 * (3.0 * share / 100.0 / 2e5_f64).sqrt();
    assert!(error < 1.0 && (predicted - share).abs() < 4.0 * error.hypot(of_run), "{text}, {share}");
}

/// A deep room, open at one end, with walls that are nearly white in red and dark in blue.
const ROOM_OF_ONE_COLOUR: &str = r#"
[material.wall]
reflectance = [0.95, 0.6, 0.2]
[material.lamp]
reflectance = 0.0
emittance = [3.0, 2.0, 1.0]
[[surface]]
material = "wall"
quad = [[0,0,0], [6,0,0], [0,2,0]]
[[surface]]
material = "wall"
quad = [[0,0,2], [0,2,0], [6,0,0]]
[[surface]]
material = "wall"
quad = [[0,0,0], [0,0,2], [6,0,0]]
[[surface]]
material = "wall"
quad = [[0,2,0], [6,0,0], [0,0,2]]
[[surface]]
material = "lamp"
quad = [[0,0,0], [0,2,0], [0,0,2]]
"#;
