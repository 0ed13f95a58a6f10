//! Light for a mesh whose file has none, and the sides to which its lamps shine.

use std::collections::BTreeMap;
use std::path::Path;

use doctor::{Around, ClosedRoom, Lightless, Shine};
use glam::DVec3;
use import::{Format, Imported, MaterialOverride, OpenSides, Options, setting};
use radiosity::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};

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
    let names = if by_hand { Vec::new() } else { mesh.lamps_by_name() };
    let flux = FLOOR * mesh.footprint(format, options) * options.unit * options.unit;
    let mut options = options.clone();
    let entry =
        |name: &String| MaterialOverride { emittance: Some(SKY.into()), ..MaterialOverride::of(name) };
    options.materials.splice(0..0, names.iter().map(entry));
    let mut imported = mesh.into_scene(path, format, &options).map_err(Error::of_mesh)?;
    let mut sky = options.sky;
    let dark = names.is_empty() && !by_hand;
    let mut first = None;
    // A scene that cannot be looked at is refused when it is built, with its place.
    if dark && let Ok(around) = Around::of(&imported.spec) {
        let (note, above) = light(&mut imported, &around);
        (first, sky) = (Some(note), above);
    } else if !dark {
        let mut lamps = OpenLamps::default();
        lamps.add(&imported, 0);
        imported.notes.extend(lamps.aim(&mut imported.spec));
    }
    if let Some(name) = names.first() {
        let emittance = share_out(flux, &mut imported.spec.surfaces);
        first = Some(format!(
            "nothing in the file emits, so what is called a lamp does, as {name:?} ({} in all), with {emittance:.0} lm/m²: {FLOOR} lm for each m² of floor; --light {}=1000lm or --sky={SKY} light it otherwise",
            names.len(),
            in_quotes(name),
        ));
    }
    imported.luminous |= first.is_some();
    imported.notes.splice(0..0, first);
    Ok(Lit { imported, sky })
}

/// Gives surfaces that emit the emittance with which they send a flux [lm] from all of their sides, and returns it [lm/m²]. A flux of 0 leaves
/// them as they are.
fn share_out(flux: f64, surfaces: &mut [SurfaceSpec]) -> f64 {
    let lit = || surfaces.iter().filter(|surface| surface.emittance.is_lit());
    let area: f64 = lit().map(|surface| surface.shape.area() * surface.sides.count()).sum();
    let emittance = flux / area;
    if !(emittance > 0.0 && emittance.is_finite()) {
        return SKY;
    }
    let lit = surfaces.iter_mut().filter(|surface| surface.emittance.is_lit());
    lit.for_each(|surface| surface.emittance = emittance.into());
    emittance
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

/// Lamps of which neither the file nor options say for certain to which side they shine.
#[derive(Default)]
pub(crate) struct OpenLamps {
    /// The surfaces of which no sides are said. One side alone is brighter by the factor.
    sheets: Vec<(u32, f64)>,
    /// Those of which the file says both sides, part by part.
    shells: Vec<Vec<(u32, f64)>>,
    /// The material of the first.
    name: Option<String>,
}

impl OpenLamps {
    /// Adds those of a mesh whose surfaces are numbered from `first` on.
    pub(crate) fn add(&mut self, imported: &Imported, first: usize) {
        let mut shells: BTreeMap<u32, Vec<(u32, f64)>> = BTreeMap::new();
        let lit = |surface: usize| imported.spec.surfaces[surface].emittance.is_lit();
        for (surface, &material) in imported.materials.iter().enumerate().filter(|(surface, _)| lit(*surface))
        {
            let Some(OpenSides { factor, both_said }) = imported.open_sides[material as usize] else {
                continue;
            };
            self.name.get_or_insert_with(|| imported.names[material as usize].clone());
            let lamp = ((first + surface) as u32, factor);
            match both_said {
                true => shells.entry(imported.parts[surface]).or_default().push(lamp),
                false => self.sheets.push(lamp),
            }
        }
        self.shells.extend(shells.into_values());
    }

    /// Gives them one side that shines, where other surfaces do not emit: that which looks into the room, else the front by the order of the
    /// corners; where the file says both sides, that which looks out of a shell, else both. Says so.
    pub(crate) fn aim(&self, spec: &mut SceneSpec) -> Option<String> {
        let name =
            self.name.as_ref().filter(|_| spec.surfaces.iter().any(|surface| !surface.emittance.is_lit()))?;
        // A scene that cannot be looked at is refused when it is built, with its place.
        let around = Around::of(spec).ok()?;
        let mut own = vec![false; spec.surfaces.len()];
        self.sheets
            .iter()
            .chain(self.shells.iter().flatten())
            .for_each(|&(lamp, _)| own[lamp as usize] = true);
        let is_own = |surface: u32| own[surface as usize];
        let numbers = |lamps: &Vec<(u32, f64)>| lamps.iter().map(|&(lamp, _)| lamp).collect::<Vec<u32>>();
        let sheets = self.sheets.iter().zip(around.shine(&numbers(&self.sheets), is_own));
        let shells = around.shells(&self.shells.iter().map(numbers).collect::<Vec<_>>(), is_own);
        let shells = self.shells.iter().zip(shells).filter(|(_, shine)| *shine != Shine::Either);
        let shells = shells.flat_map(|(lamps, shine)| lamps.iter().map(move |lamp| (lamp, shine)));
        let (mut faces, mut by_room, mut turned) = (0, 0, 0);
        for (&(lamp, factor), shine) in sheets.chain(shells) {
            let surface = &mut spec.surfaces[lamp as usize];
            surface.sides = Sides::Front;
            surface.emittance = Spectrum::rgb(surface.emittance.channels().map(|channel| channel * factor));
            faces += 1;
            by_room += u32::from(shine != Shine::Either);
            if shine == Shine::Back {
                turned += 1;
                turn_round(&mut surface.shape);
            }
        }
        (faces > 0).then(|| {
            format!(
                "lamps shine to one side: {faces} of their faces, {by_room} into the room ({turned} turned round), the others by their front; {} gives both sides",
                setting(name, "sides", "2"),
            )
        })
    }
}

/// Makes the back of a shape its front.
fn turn_round(shape: &mut Shape) {
    match shape {
        Shape::Triangle { b, c, .. } => std::mem::swap(b, c),
        Shape::Parallelogram { corner_u, corner_v, cells, .. } => {
            std::mem::swap(corner_u, corner_v);
            cells.reverse();
        }
        Shape::Divided { .. } => {}
    }
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
