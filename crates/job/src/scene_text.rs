//! Scenes as the text of scene files.

use std::collections::HashMap;
use std::fmt::Write;

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

/// The text of a scene as a scene file. Numbers have the fewest digits from which the same number is read back.
pub fn to_toml(spec: &SceneSpec) -> String {
    let mut text = String::new();
    let mut materials = HashMap::new();
    for surface in &spec.surfaces {
        let properties = properties(surface);
        let next = materials.len();
        let material = *materials.entry(properties).or_insert_with_key(|properties| {
            write!(text, "[material.m{next}]\n{properties}\n").expect("strings take all");
            next
        });
        write_surface(&mut text, surface, material).expect("strings take all");
    }
    text
}

/// The keys of a surface's material.
fn properties(surface: &SurfaceSpec) -> String {
    format!(
        "reflectance = {:?}\nemittance = {:?}\n",
        surface.reflectance.channels(),
        surface.emittance.channels()
    )
}

fn write_surface(text: &mut String, surface: &SurfaceSpec, material: usize) -> std::fmt::Result {
    writeln!(text, "[[surface]]\nmaterial = \"m{material}\"")?;
    if let Some(name) = &surface.name {
        writeln!(text, "name = {name:?}")?;
    }
    match surface.shape {
        Shape::Parallelogram { corner, corner_u, corner_v, cells } => {
            writeln!(text, "quad = {}\npatches = {cells:?}", points([corner, corner_u, corner_v]))?;
        }
        Shape::Triangle { a, b, c, rows } => {
            writeln!(text, "triangle = {}\npatches = {rows}", points([a, b, c]))?;
        }
        Shape::Divided { .. } => unreachable!("scenes are written before they are cut"),
    }
    if surface.sides == Sides::Both {
        writeln!(text, "sides = 2")?;
    }
    for &(cell, emittance) in &surface.cell_emittance {
        let label = surface.shape.cell_label(cell);
        writeln!(text, "[[surface.emit]]\ncell = {label:?}\nemittance = {:?}", emittance.channels())?;
    }
    writeln!(text)
}

fn points(points: [DVec3; 3]) -> String {
    format!("{:?}", points.map(|point| point.to_array()))
}
