//! Writes a scene file: `radwalk-lab write interior 57000 > interior.toml`

use job::to_toml;
use scenes::{cornell, cube, interior, two_rooms};

use super::Failure;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let scene = match words[..] {
        ["cornell"] => Some(cornell()),
        ["cube", cells] => cells.parse().ok().filter(|&n| n > 0).map(cube),
        ["interior", triangles] => triangles.parse().ok().map(interior),
        ["two-rooms", reflectance] => reflectance.parse().ok().map(|reflectance| two_rooms(0.1, reflectance)),
        _ => None,
    };
    let scene = scene
        .ok_or("usage: write cornell | cube CELLS_PER_EDGE | interior TRIANGLES | two-rooms REFLECTANCE")?;
    print!("{}", to_toml(&scene));
    Ok(())
}
