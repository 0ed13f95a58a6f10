//! Light for a mesh whose file has none, and the sides to which its lamps shine.

use std::path::Path;

use doctor::{Around, ClosedRoom, Lightless, Shine};
use glam::DVec3;
use import::{Format, Imported, MaterialOverride, Options, setting};
use radiosity::{Shape, Sides, Spectrum, SurfaceSpec};

use crate::error::Error;
use crate::imports::read_mesh;

/// The flux of assumed lamps for each square metre of floor [lm/m²]: about that of an office.
const FLOOR: f64 = 500.0;

/// The emittance of an assumed sky [lm/m²]: that of an overcast day.
pub(crate) const SKY: f64 = 10_000.0;

/// The name of an assumed lamp, and the reflectance of its back.
const LAMP: &str = "assumed lamp";
const HOUSING: f64 = 0.5;

/// A mesh as a scene, and the light that it has been given.
pub(crate) struct Lit {
    pub(crate) imported: Imported,
    /// The emittance of the sky around it.
    pub(crate) sky: Option<Spectrum>,
}

/// Reads a mesh file as a scene of its own. Where nothing in it emits, and reading is not strict, it is lit by what is most likely
/// meant: materials or parts whose names mean lamps, a lamp below each ceiling of closed rooms, or a sky. The first note says so.
///
/// # Errors
/// What the file's reader refuses.
pub(crate) fn read_lit(path: &Path, format: Format, options: &Options) -> Result<Lit, Error> {
    let mesh = read_mesh(path, format, options)?;
    let by_hand = options.sky.is_some() || options.strict || mesh.is_lit(options);
    let (names, area) = if by_hand { Default::default() } else { mesh.lamps_by_name() };
    let mut options = options.clone();
    let mut first = None;
    if !names.is_empty() {
        // In squares of the file's unit, which cancels.
        let emittance = FLOOR * mesh.footprint(format, &options) / area;
        let emittance = if emittance > 0.0 && emittance.is_finite() { emittance } else { SKY };
        let entry = |name: &String| MaterialOverride {
            emittance: Some(emittance.into()),
            ..MaterialOverride::of(name)
        };
        options.materials.splice(0..0, names.iter().map(entry));
        first = Some(format!(
            "nothing in the file emits, so what is called a lamp does, as {:?} ({} in all), with {emittance:.0} lm/m²: {FLOOR} lm for each m² of floor; --light {}=1000lm or --sky={SKY} light it otherwise",
            names[0],
            names.len(),
            in_quotes(&names[0]),
        ));
    }
    let mut imported = mesh.into_scene(path, format, &options).map_err(Error::of_mesh)?;
    let mut sky = options.sky;
    let dark = first.is_none() && !by_hand;
    // A scene that cannot be looked at is refused when it is built, with its place.
    let around = if dark || has_open_lamps(&imported) { Around::of(&imported.spec).ok() } else { None };
    if let Some(around) = around.as_ref().filter(|_| dark) {
        let (note, above) = light(&mut imported, around);
        (first, sky) = (Some(note), above);
    } else if let Some(around) = around {
        aim_lamps(&mut imported, &around);
    }
    imported.luminous |= first.is_some();
    imported.notes.splice(0..0, first);
    Ok(Lit { imported, sky })
}

/// Lights a dark scene by lamps in its rooms or by a sky, in words and as the sky's emittance.
fn light(imported: &mut Imported, around: &Around) -> (String, Option<Spectrum>) {
    let name = imported.materials.first().map_or("wall", |&first| &imported.names[first as usize]);
    let by_hand = format!("--light {}=1000lm makes that material shine", in_quotes(name));
    match around.lightless(is_room(imported)) {
        Lightless::Rooms(rooms) => {
            let lamps: usize = rooms.iter().map(|room| room.lamps.len()).sum();
            let note = format!(
                "nothing in the file emits, so {} {} from below the ceiling, with {FLOOR} lm for each m² of floor; {by_hand} instead, --sky={SKY} gives a sky outside",
                lamps,
                if lamps == 1 { "assumed lamp shines" } else { "assumed lamps shine" },
            );
            rooms.iter().for_each(|room| add_lamps(imported, room));
            (note, None)
        }
        Lightless::Open(part) => {
            let place = match part {
                0.005.. => format!("to which {:.0} % of all directions lead", 100.0 * part),
                _ => "which lights the outside of what is closed".into(),
            };
            let note = format!(
                "nothing in the file emits, so a uniform sky of {SKY} lm/m² does, from all sides, {place}; {by_hand} instead, --sky=5000 sets the sky",
            );
            (note, Some(SKY.into()))
        }
    }
}

/// A text as an argument of a shell.
fn in_quotes(text: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | '-' | '.');
    if text.chars().all(plain) { text.into() } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// Whether the extent of a scene is that of rooms, in the unit that its file is likely to be written in, and floors, ceilings and
/// walls are much of it, whose backs reflect as well.
fn is_room(imported: &Imported) -> bool {
    let (low, high) = bounds(&imported.spec.surfaces);
    let [x, y, z] = ((high - low) * imported.likely_unit.map_or(1.0, |(_, length)| length)).to_array();
    let is_large = (1.9..12.0).contains(&z) && [x, y].iter().all(|extent| (1.5..60.0).contains(extent));
    let one_sided = imported.spec.surfaces.iter().filter(|surface| surface.sides == Sides::Front).count();
    is_large && built(&imported.spec.surfaces) > 0.4 && 2 * one_sided < imported.spec.surfaces.len()
}

/// The part of the area that lies or stands upright to 5°, which is 0.09 of a sphere.
fn built(surfaces: &[SurfaceSpec]) -> f64 {
    let (mut built, mut total) = (0.0, 0.0);
    for surface in surfaces {
        let (_, u, v) = surface.shape.edges();
        let tilt = u.cross(v).normalize_or_zero().z.abs();
        let area = surface.shape.area();
        total += area;
        built += if (0.087..0.996).contains(&tilt) { 0.0 } else { area };
    }
    built / total
}

/// The bounds of some surfaces [m].
pub(crate) fn bounds(surfaces: &[SurfaceSpec]) -> (DVec3, DVec3) {
    let corners = surfaces.iter().flat_map(|surface| surface.shape.corners());
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
}

/// Whether some faces emit, neither file nor options say to which side, and others do not emit.
fn has_open_lamps(imported: &Imported) -> bool {
    let surfaces = &imported.spec.surfaces;
    open_lamps(imported).next().is_some() && surfaces.iter().any(|surface| !surface.emittance.is_lit())
}

fn open_lamps(imported: &Imported) -> impl Iterator<Item = u32> {
    let is_open = |material: u32| imported.open_sides[material as usize].is_some();
    let lamps = imported.spec.surfaces.iter().zip(&imported.materials);
    let lamps = lamps
        .zip(0..)
        .filter(move |((surface, material), _)| surface.emittance.is_lit() && is_open(**material));
    lamps.map(|(_, number)| number)
}

/// Gives lamps without sides one that shines: that which looks into the room, else the front by the order of the corners.
fn aim_lamps(imported: &mut Imported, around: &Around) {
    let lamps: Vec<u32> = open_lamps(imported).collect();
    let materials = &imported.materials;
    let shine = around.shine(&lamps, |surface| {
        imported.spec.surfaces[surface as usize].emittance.is_lit()
            && imported.open_sides[materials[surface as usize] as usize].is_some()
    });
    let (mut by_room, mut turned) = (0, 0);
    for (&lamp, shine) in lamps.iter().zip(shine) {
        let surface = &mut imported.spec.surfaces[lamp as usize];
        let factor = imported.open_sides[imported.materials[lamp as usize] as usize].unwrap_or(1.0);
        surface.sides = Sides::Front;
        surface.emittance = Spectrum::rgb(surface.emittance.channels().map(|channel| channel * factor));
        by_room += u32::from(shine != Shine::Either);
        if shine == Shine::Back {
            turned += 1;
            match &mut surface.shape {
                Shape::Triangle { b, c, .. } => std::mem::swap(b, c),
                Shape::Parallelogram { corner_u, corner_v, cells, .. } => {
                    std::mem::swap(corner_u, corner_v);
                    cells.reverse();
                }
                Shape::Divided { .. } => {}
            }
        }
    }
    let name = &imported.names[imported.materials[lamps[0] as usize] as usize];
    imported.notes.push(format!(
        "lamps shine to one side: {} of their faces, {by_room} into the room ({turned} turned round), the others by their front; {} gives both sides",
        lamps.len(),
        setting(name, "sides", "2"),
    ));
}

/// Adds the assumed lamps of a room to an imported mesh.
fn add_lamps(imported: &mut Imported, room: &ClosedRoom) {
    let power = FLOOR * room.floor / room.lamps.len() as f64;
    room.lamps.iter().for_each(|&lamp| add_lamp(imported, lamp, power));
}

/// Adds an assumed lamp with this flux [lm].
fn add_lamp(imported: &mut Imported, [corner, corner_u, corner_v]: [DVec3; 3], power: f64) {
    let shape = Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] };
    let emittance = power / shape.area();
    if imported.names.last().is_none_or(|name| name != LAMP) {
        imported.names.push(LAMP.into());
        imported.textures.push(None);
        imported.open_sides.push(None);
    }
    // Light from above meets a housing of its own: the back of a lamp would swallow it.
    let housing = Shape::Parallelogram { corner, corner_u: corner_v, corner_v: corner_u, cells: [1, 1] };
    for (shape, reflectance, emittance) in [(shape, 0.0, emittance), (housing, HOUSING, 0.0)] {
        imported.materials.push(imported.names.len() as u32 - 1);
        imported.parts.push(u32::MAX);
        imported.spec.surfaces.push(SurfaceSpec {
            name: Some(LAMP.into()),
            sides: Sides::Front,
            emittance: emittance.into(),
            ..SurfaceSpec::new(shape, reflectance)
        });
    }
}
