//! What groups of faces that a pilot chooses save in an imported interior.
//!
//! `radwalk-lab groups docs/results [millions of walks of a reference]` writes `groups.md` into the folder.
//!
//! Errors are measured on cells of at most 5 cm² against two references of independent walks, whose noise drops out of products.

mod light;
mod page;
mod runs;

use std::fs;
use std::path::Path;

use self::light::Reference;
use self::page::Studied;
use self::runs::{Failure, GroupOutcome, chosen, given};

/// Walks of the jobs that are compared.
pub const PATHS: [u64; 4] = [30_000, 100_000, 300_000, 1_000_000];

/// Cells that faces are cut into uniformly, at most of these areas [m²]; without bound: one patch a face.
pub const UNIFORM: [f64; 4] = [f64::INFINITY, 0.32, 0.08, 0.02];

const JOB: &str = "[scene]\nfile = \"interior.obj\"\npatches = \"auto\"\n[import]\nup = \"z\"\nsides = 1\n\
                   [import.material.\"*-both\"]\nsides = 2\n";

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let mut args = words.iter();
    let folder = args.next().ok_or("usage: groups FOLDER [MILLIONS]")?;
    let millions: u64 = args.next().map_or(Ok(100), |text| text.parse())?;
    let scene = tempfile::tempdir()?;
    let [obj, mtl] = scenes::interior_obj(57_000);
    fs::write(scene.path().join("interior.obj"), obj)?;
    fs::write(scene.path().join("interior.mtl"), mtl)?;
    let job = scene.path().join("job.toml");
    fs::write(&job, JOB)?;
    let reference = Reference::new(&job, millions * 1_000_000)?;
    let uniform = UNIFORM.map(|area| given(&job, area, &reference));
    let uniform: Vec<_> = uniform.into_iter().collect::<Result<_, _>>()?;
    let under = |more: &[&str]| -> Result<Vec<GroupOutcome>, Failure> {
        PATHS.iter().map(|&paths| chosen(&job, paths, more, &reference)).collect()
    };
    let [open, constant, linear] =
        [under(&[])?, under(&["method.basis=constant"])?, under(&["method.basis=linear"])?];
    page::write(Path::new(folder), millions, &Studied { uniform, open, of_basis: [constant, linear] })
}
