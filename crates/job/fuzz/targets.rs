// The fuzz targets of the readers of jobs, scenes, points and partitions: whatever a file holds, a reader must not panic, run for ever or take memory without
// end. What is read is built, if it is small.

use std::path::Path;

use radiosity::Experiment;
use tempfile::TempDir;

/// Scenes of more patches are not built.
const PATCHES: u64 = 10_000;

/// A scene that needs all of the files below.
const SCENE: &str = "[material.wall]\nreflectance = 0.5\nemittance = 1.0\n\
    [[surface]]\nname = \"floor\"\nmaterial = \"wall\"\nquad = [[0,0,0], [1,0,0], [0,1,0]]\n\
    [[surface]]\nname = \"wall\"\nmaterial = \"wall\"\nquad = [[0,0,0], [0,1,0], [0,0,1]]\n\
    [[points]]\nname = \"eyes\"\nfile = \"desk.pts\"\n";

const LAMP: &str =
    "IESNA:LM-63-2002\nTILT=NONE\n1 -1 10 5 1 1 2 0 0 0\n1 1 10\n0 30 45 60 90\n0\n100 90 70 40 0\n";

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no a\nf 1 2 3\no b\nf 1 3 4\n";

const JOB: &str = "scene = { file = \"scene.toml\", patches = \"cuts.toml\" }\n[budget]\npaths = 1000\n";

const PARTITION: &str = "basis = \"linear\"\nsurfaces = [[2, 2], [1, 4]]\n";

thread_local! {
    /// A folder with all files, for each thread.
    static FOLDER: TempDir = {
        let folder = tempfile::tempdir().expect("a folder");
        let files = [("scene.toml", SCENE), ("down.ies", LAMP), ("mesh.obj", MESH), ("cuts.toml", PARTITION)];
        let files = files.into_iter().chain([("desk.pts", "0.5 0.5 0.5 0 0 1\n")]);
        files.for_each(|(name, text)| std::fs::write(folder.path().join(name), text).expect("room"));
        folder
    };
}

/// Reads a job from a file, with some content in one of the folder's files, and builds its scene.
fn read(content: &[u8], name: &str, job: &str) {
    FOLDER.with(|folder| {
        let file = |name: &str| folder.path().join(name);
        let before = std::fs::read(file(name)).ok();
        std::fs::write(file(name), content).expect("room");
        load(&file(job));
        if let Some(before) = before {
            std::fs::write(file(name), before).expect("room");
        }
    });
}

fn load(path: &Path) {
    let _ = job::load_surfaces(path, &[]);
    let Ok(job) = job::load(path, &[]) else { return };
    if job.scene.patch_count() > PATCHES {
        return;
    }
    let Ok(scene) = job.build_scene() else { return };
    let Ok(experiment) = Experiment::new(scene, job.method.walks()) else { return };
    let Ok(experiment) = experiment.with_sensors(job.scene.sensors()) else { return };
    let _ = experiment.with_groups(&job.sources, &job.sensitivity);
}

pub fn job(content: &[u8]) {
    read(content, "job.toml", "job.toml");
}

pub fn scene(content: &[u8]) {
    read(content, "scene.toml", "scene.toml");
}

pub fn points(content: &[u8]) {
    read(content, "desk.pts", "scene.toml");
}

pub fn partition(content: &[u8]) {
    FOLDER.with(|folder| std::fs::write(folder.path().join("job.toml"), JOB).expect("room"));
    read(content, "cuts.toml", "job.toml");
}
