//! Scene files with some surfaces turned round and others left out; all else stays.

use toml::{Table, Value};

/// The text of a scene file in which the `[[surface]]`s of these numbers are turned round, and those left out. `None` where a number is none
/// of its surfaces: it is a face of a mesh, or of the sky. Comments are lost.
pub fn repaired_text(text: &str, turned: &[u32], removed: &[u32]) -> Option<String> {
    let mut scene: Table = text.parse().ok()?;
    let mut empty = Vec::new();
    let surfaces = scene.get_mut("surface").and_then(Value::as_array_mut).unwrap_or(&mut empty);
    for &number in turned {
        turn(surfaces.get_mut(number as usize)?.as_table_mut()?)?;
    }
    if removed.iter().any(|&number| number as usize >= surfaces.len()) {
        return None;
    }
    let mut number = 0;
    surfaces.retain(|_| {
        number += 1;
        !removed.contains(&(number - 1))
    });
    Some(scene.to_string())
}

/// Exchanges front and back of a surface; cells keep their places.
fn turn(surface: &mut Table) -> Option<()> {
    let is_triangle = surface.contains_key("triangle");
    let shape = surface.get_mut(if is_triangle { "triangle" } else { "quad" })?;
    shape.as_array_mut().filter(|corners| corners.len() == 3)?.swap(1, 2);
    if let Some(patches) = surface.get_mut("patches").and_then(Value::as_array_mut) {
        patches.reverse();
    }
    for emit in surface.get_mut("emit").and_then(Value::as_array_mut).into_iter().flatten() {
        let cell = emit.get_mut("cell")?.as_array_mut()?;
        let [row, place] = [cell.first()?.as_integer()?, cell.get(1)?.as_integer()?];
        *cell = if is_triangle { [row, 2 * row - place] } else { [place, row] }.map(Value::Integer).to_vec();
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"
        [material.w]
        reflectance = 0.5
        [[surface]]
        name = "n"
        material = "w"
        quad = [[0, 0, 0], [1, 0, 0], [0, 2.5, 0]]
        patches = [3, 2]
        [[surface.emit]]
        cell = [2, 0]
        emittance = 1.5
        [[surface]]
        material = "w"
        triangle = [[0, 0, 1], [1, 0, 1], [0, 1, 1]]
        [[lamp]]
        file = "x.ies"
        position = [0, 0, 2]
    "#;

    #[test]
    fn all_but_the_named_surfaces_stays() {
        let text = repaired_text(SCENE, &[0], &[1]).unwrap();
        let [before, after]: [Table; 2] = [SCENE.parse().unwrap(), text.parse().unwrap()];
        assert_eq!((&before["lamp"], &before["material"]), (&after["lamp"], &after["material"]));
        let expected = r#"name = "n"
            material = "w"
            quad = [[0, 0, 0], [0, 2.5, 0], [1, 0, 0]]
            patches = [2, 3]
            emit = [{ cell = [0, 2], emittance = 1.5 }]"#;
        let expected: Table = expected.parse().unwrap();
        assert_eq!(after["surface"].as_array().unwrap(), &[Value::Table(expected)]);
        let turned_twice = repaired_text(&repaired_text(SCENE, &[1], &[]).unwrap(), &[1], &[]).unwrap();
        assert_eq!(turned_twice.parse::<Table>().unwrap(), before);
        assert!(repaired_text(SCENE, &[2], &[]).is_none() && repaired_text(SCENE, &[], &[2]).is_none());
    }
}
