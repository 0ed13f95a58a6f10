//! Walks and nothing else, for tools that count instructions.

use std::path::Path;

use radiosity::{IndexChoice, Scene, Sequence};
use voice::say;

use super::collision_shooting;
use super::meshes::grey_scene;
use crate::walking::Failure;

/// Walks in a grey scene, and prints the number of rays.
pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let [walks, name] = words else { return Err("WALKS (cube | cornell | TRIANGLES | MESH)".into()) };
    let spec = match (&**name, name.parse()) {
        ("cube", _) => scenes::cube(3),
        ("cornell", _) => scenes::cornell(),
        (_, Ok(triangles)) => scenes::interior(triangles),
        _ => grey_scene(Path::new(name))?,
    };
    let experiment = collision_shooting(Scene::build(&spec, IndexChoice::Auto)?)?;
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(1), 0..walks.parse()?, &mut board);
    say(&board.take()?.counts.rays.to_string());
    Ok(())
}
