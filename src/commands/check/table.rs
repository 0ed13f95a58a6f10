//! What a scene is made of: extents, and a table of materials.

use job::{MaterialRow, SceneFile};
use radiosity::Spectrum;
use serde_json::{Value, json};

/// The most materials that are listed; JSON has all.
const MOST: usize = 24;

/// The extents of a scene [m].
fn extents(scene: &SceneFile) -> [f64; 3] {
    let [low, high] = scene.bounds();
    [0, 1, 2].map(|axis| high[axis] - low[axis])
}

/// Extents and materials in words, the largest area first.
pub(super) fn lines(scene: &SceneFile) -> Vec<String> {
    let [x, y, z] = extents(scene).map(|extent| format!("{extent:.3}"));
    let rows = scene.materials();
    let shown: Vec<[String; 5]> = rows.iter().take(MOST).map(cells).collect();
    let heads = ["material", "area [m²]", "reflectance", "emittance", "texture"].map(str::to_owned);
    let all = || std::iter::once(&heads).chain(&shown);
    let widths: [usize; 4] =
        std::array::from_fn(|i| all().map(|row| row[i].chars().count()).max().unwrap_or(0));
    let mut lines = vec![format!("extent: {x} × {y} × {z} m, z up")];
    lines.extend(all().map(|[name, area, reflectance, emittance, texture]| {
        let [a, b, c, d] = widths;
        let line = format!("  {name:a$}  {area:>b$}  {reflectance:>c$}  {emittance:>d$}  {texture}");
        line.trim_end().to_owned()
    }));
    if let Some(more) = rows.len().checked_sub(MOST).filter(|more| *more > 0) {
        let area: f64 = rows[MOST..].iter().map(|row| row.area).sum();
        lines.push(format!("  and {more} more of {area:.3} m² together; --json lists them all"));
    }
    lines
}

fn cells(row: &MaterialRow) -> [String; 5] {
    let sides = if row.sides == 1 { " (one side)" } else { "" };
    let emittance =
        if row.emittance.is_lit() { format!("{}{sides}", rounded(row.emittance)) } else { "–".into() };
    let texture = row.texture.clone().unwrap_or_default();
    [format!("{:?}", row.name), format!("{:.3}", row.area), rounded(row.reflectance), emittance, texture]
}

/// A spectrum with three digits a channel, one number where it is grey.
fn rounded(spectrum: Spectrum) -> String {
    let digits = |value: f64| if value.abs() < 100.0 { format!("{value:.3}") } else { format!("{value:.0}") };
    match spectrum.is_grey() {
        true => digits(spectrum[0]),
        false => spectrum.channels().map(digits).join(" "),
    }
}

/// The extents of a scene as JSON.
pub(super) fn scene(scene: &SceneFile) -> Value {
    json!({
        "surfaces": scene.spec().surfaces.len(),
        "patches": scene.patch_count(),
        "extent": extents(scene),
        "likely_unit": scene.likely_unit(),
    })
}

/// The materials as JSON.
pub(super) fn values(scene: &SceneFile) -> Value {
    let value = |row: MaterialRow| {
        json!({
            "name": row.name,
            "surfaces": row.surfaces,
            "area": row.area,
            "reflectance": row.reflectance.channels(),
            "emittance": row.emittance.channels(),
            "sides": row.sides,
            "texture": row.texture,
        })
    };
    scene.materials().into_iter().map(value).collect()
}
