//! The commit of a build, for the build scripts of the binary and of the Python package: coordinator and workers must be of one build.

use std::env;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sets `RADWALK_GIT` for the package whose build script calls this: the commit, or a digest of the sources.
///
/// # Panics
///
/// Where cargo does not run it.
pub fn stamp() {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo says where the package is"));
    let root = package.ancestors().find(|folder| folder.join("Cargo.lock").is_file());
    env::set_current_dir(root.unwrap_or(&package)).expect("the sources are there");
    let git = |args: &[&str]| {
        let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        ["HEAD", "index"].iter().for_each(|file| println!("cargo::rerun-if-changed={folder}/{file}"));
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(sources);
    let dirty =
        git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|status| !status.is_empty());
    println!("cargo::rustc-env=RADWALK_GIT={commit}{}", if dirty { "-dirty" } else { "" });
}

/// Names the sources themselves where there is no git: an archive, an image. Builds of other sources have other names.
fn sources() -> String {
    let mut files = vec![PathBuf::from("Cargo.lock")];
    ["src", "crates"].iter().for_each(|folder| collect(Path::new(folder), &mut files));
    files.sort();
    let mut hasher = DefaultHasher::new();
    for file in files {
        println!("cargo::rerun-if-changed={}", file.canonicalize().unwrap_or(file.clone()).display());
        file.hash(&mut hasher);
        std::fs::read(&file).unwrap_or_default().hash(&mut hasher);
    }
    format!("sources-{:016x}", hasher.finish())
}

/// All Rust sources below a folder.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() && !path.ends_with("target") {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}
