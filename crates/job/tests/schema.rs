//! The JSON schemas say what the readers say.

use std::path::{Path, PathBuf};

use crate::common::Folder;
use job::{job_schema, load, scene_schema};
use jsonschema::Validator;
use serde_json::Value;

fn validators() -> [Validator; 2] {
    [job_schema(), scene_schema()].map(|schema| {
        jsonschema::draft7::meta::validate(&schema).expect("the schema is one");
        jsonschema::validator_for(&schema).unwrap()
    })
}

fn parsed(text: &str) -> Value {
    toml::from_str(text).unwrap()
}

/// Every TOML file that the project ships.
fn shipped() -> Vec<PathBuf> {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    let mut folders = vec![configs];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
            match entry.is_dir() {
                true => folders.push(entry),
                false if entry.extension().is_some_and(|end| end == "toml") => files.push(entry),
                false => {}
            }
        }
    }
    files
}

#[test]
fn every_shipped_file_is_valid() {
    let [job, scene] = validators();
    let files = shipped();
    assert!(files.len() >= 10, "{files:?}");
    for file in files {
        let value = parsed(&std::fs::read_to_string(&file).unwrap());
        // Temperatures of groups have no schema.
        if value.get("group").is_some() {
            continue;
        }
        let validator = if value.get("budget").is_some() { &job } else { &scene };
        let errors: Vec<String> = validator.iter_errors(&value).map(|error| error.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:?}", file.display());
    }
}

/// The keys whose schema allows anything: the readers know them, and the schema says nothing of them.
fn unsaid(schema: &Value, path: &str, found: &mut Vec<String>) {
    match schema {
        Value::Object(fields) => {
            if fields.is_empty() {
                found.push(path.to_owned());
            }
            fields.iter().for_each(|(key, value)| unsaid(value, &format!("{path}.{key}"), found));
        }
        Value::Array(items) => items.iter().for_each(|item| unsaid(item, path, found)),
        _ => {}
    }
}

#[test]
fn every_key_of_the_readers_has_a_schema() {
    let mut found = Vec::new();
    unsaid(&job_schema(), "job", &mut found);
    unsaid(&scene_schema(), "scene", &mut found);
    assert!(found.is_empty(), "say in crates/job/src/schema.rs what these keys may hold: {found:?}");
}

const SCENE: &str = "[material.m]\nreflectance = [0.5, 0.4, 0.3]\nemittance = 1\n[[surface]]\nmaterial = \"m\"\n\
    sides = 2\ntriangle = [[0,0,0],[1,0,0],[0,1,0]]\npatches = 4\nemit = [{ cell = [0, 0], emittance = 2 }]\n\
    [[sensor]]\nname = \"desk\"\nquad = [[0,0,1],[1,0,1],[0,1,1]]\npatches = [3, 2]\n\
    [[sensor]]\npoint = [0,0,1]\nnormal = [0,0,-1]\n[[mesh]]\nfile = \"chair.obj\"\n";

const JOB: &str = "name = \"a\"\nscene = \"s.toml\"\nseed = 3\nconfidence = 0.9\nsimultaneous = true\n\
    light = \"luminous\"\n\
    [method]\nwalk = \"gathering\"\nestimator = \"infinite\"\nspace = \"continuous\"\n\
    infinite = { end = \"length\", length = 5 }\nbirth = { patches = [1, 2] }\n\
    [budget]\npaths = 100000\nstream_paths = 10\nwall_seconds = 1.5\nfirst_path = 7\ncheckpoint_seconds = 2\n\
    [target]\nrelative_error = 0.1\nfraction = 0.5\nmin_paths = 1\nmin_hits = 0\nunhit = \"ignore\"\npatches = [2]\n\
    sensors = { desk = 0.2 }\n\
    [import]\nup = \"x\"\nunit = 0.5\nsides = \"file\"\npatch_size = 2\nfaults = \"refuse\"\nrepair = true\njoin = true\n\
    reflectance_limit = 0.9\nstrict = true\nsky = [1, 2, 3]\ncurve_error = 0.1\n\
    [output]\nfiles = [\"csv\", \"exr\"]\n\
    [view]\neye = [0, 0, 3]\nlook_at = [0.1, 0.1, 0]\nup = [0, 1, 0]\nfov = 50\nsize = [640, 480]\nexposure = 0.5\n";

/// A change of one of the two files, and whether both reader and schema take it.
const CHANGES: &[(&str, &str, bool)] = &[
    ("", "", true),
    ("seed = 3", "seed = -3", false),
    ("confidence = 0.9", "confidence = 1", false),
    ("simultaneous = true", "simultaneous = 1", false),
    ("light = \"luminous\"", "light = \"lux\"", false),
    ("light = \"luminous\"", "colour = 3", false),
    ("walk = \"gathering\"", "walk = \"running\"", false),
    ("estimator = \"infinite\"", "estimator = \"infinity\"", false),
    ("end = \"length\", length = 5", "end = \"length\", length = 0", false),
    ("end = \"length\", length = 5", "end = \"cutoff\", threshold = 0.5", true),
    ("end = \"length\", length = 5", "length = 5", false),
    ("birth = { patches = [1, 2] }", "birth = { patches = [] }", false),
    ("paths = 100000", "paths = 0", false),
    ("paths = 100000", "paths = 1.5", false),
    ("stream_paths = 10", "stream_paths = 16777217", false),
    ("wall_seconds = 1.5", "wall_seconds = 0", false),
    ("relative_error = 0.1", "relative_error = 0", false),
    ("relative_error = 0.1", "", false),
    ("fraction = 0.5", "fraction = 1.5", false),
    ("patches = [2]", "patches = [2, 2]", false),
    ("sensors = { desk = 0.2 }", "sensors = 0.2", true),
    ("sensors = { desk = 0.2 }", "sensors = 0", false),
    ("sensors = { desk = 0.2 }", "sensors = {}", false),
    ("sensors = { desk = 0.2 }", "sensors = { desk = \"well\" }", false),
    ("patches = [3, 2]", "patches = [3, 0]", false),
    ("patches = [3, 2]", "cells = [3, 2]", false),
    ("[[0,0,1],[1,0,1],[0,1,1]]", "[[0,0,1],[1,0,1]]", false),
    ("point = [0,0,1]", "point = [0,0]", false),
    ("up = \"x\"", "up = \"w\"", false),
    ("unit = 0.5", "unit = 0", false),
    ("sides = \"file\"", "sides = 3", false),
    ("faults = \"refuse\"", "faults = \"ignore\"", false),
    ("reflectance_limit = 0.9", "reflectance_limit = 1", false),
    ("curve_error = 0.1", "curve_error = 0.5", false),
    ("strict = true", "strict = 1", false),
    ("sky = [1, 2, 3]", "sky = -1", false),
    ("files = [\"csv\", \"exr\"]", "files = []", true),
    ("files = [\"csv\", \"exr\"]", "files = [\"png\"]", false),
    ("files = [\"csv\", \"exr\"]", "files = [\"csv\", \"csv\"]", false),
    ("files = [\"csv\", \"exr\"]", "file = [\"csv\"]", false),
    ("eye = [0, 0, 3]", "eye = [0, 0]", false),
    ("eye = [0, 0, 3]\n", "", false),
    ("look_at = [0.1, 0.1, 0]\n", "", false),
    ("up = [0, 1, 0]\n", "", true),
    ("fov = 50", "fov = 0", false),
    ("fov = 50", "fov = 171", false),
    ("size = [640, 480]", "size = [640, 0]", false),
    ("size = [640, 480]", "size = 640", false),
    ("exposure = 0.5", "exposure = 0", false),
    ("exposure = 0.5", "sharpness = 1", false),
    ("reflectance = [0.5, 0.4, 0.3]", "reflectance = [0.5, 0.4]", false),
    ("reflectance = [0.5, 0.4, 0.3]", "reflectance = 1", false),
    ("emittance = 1\n", "emittance = -1\n", false),
    ("sides = 2", "sides = 3", false),
    ("triangle = [[0,0,0],[1,0,0],[0,1,0]]", "triangle = [[0,0,0],[1,0,0]]", false),
    ("patches = 4", "patches = 0", false),
    ("patches = 4", "patch = 4", false),
    ("material = \"m\"\n", "", false),
    ("cell = [0, 0], emittance = 2", "cell = [0, 0]", false),
];

#[test]
fn schema_and_readers_take_and_refuse_the_same_values() {
    let [job_schema, scene_schema] = validators();
    let folder = Folder::new("schema");
    folder.write("chair.obj", "v 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\n");
    for &(from, to, good) in CHANGES {
        let [job, scene] = [JOB, SCENE].map(|text| text.replacen(from, to, 1));
        assert!(from == to || job != JOB || scene != SCENE, "{from:?} is in neither file");
        let valid = job_schema.is_valid(&parsed(&job)) && scene_schema.is_valid(&parsed(&scene));
        folder.write("s.toml", &scene);
        let path = folder.write("job.toml", &job);
        let read = load(&path, &[]).and_then(|job| job.build_scene());
        assert_eq!(valid, good, "the schema takes {to:?} in place of {from:?}: {valid}");
        assert_eq!(read.is_ok(), good, "{to:?} in place of {from:?}: {:?}", read.err());
    }
}
