//! Writes a scene file: `cargo run --release -p scenes --example write -- interior 57000 > interior.toml`

use std::process::ExitCode;

use scenes::{cornell, cube, interior, to_toml, two_rooms};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let scene = match words[..] {
        ["cornell"] => Some(cornell()),
        ["cube", cells] => cells.parse().ok().filter(|&n| n > 0).map(cube),
        ["interior", triangles] => triangles.parse().ok().map(interior),
        ["two-rooms", reflectance] => reflectance.parse().ok().map(|reflectance| two_rooms(0.1, reflectance)),
        _ => None,
    };
    let Some(scene) = scene else {
        eprintln!("usage: write cornell | cube CELLS_PER_EDGE | interior TRIANGLES | two-rooms REFLECTANCE");
        return ExitCode::from(2);
    };
    print!("{}", to_toml(&scene));
    ExitCode::SUCCESS
}
