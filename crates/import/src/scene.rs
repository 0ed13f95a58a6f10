//! The conversion of a mesh to the surfaces of a scene.

use std::path::Path;

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};

use crate::clean::Faulty;
use crate::error::{Error, Fault, Spot};
use crate::mesh::{Mesh, Triangle};
use crate::options::{Axis, Faults, MaterialOverride, Options, SidesChoice, matches};
use crate::{Format, in_words};

/// A scene that was made from a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The surfaces, in the order of the file's faces.
    pub spec: SceneSpec,
    /// The spots of the surfaces in the file, for messages.
    pub spots: Spots,
    /// The parts that were left out, changed or assumed, a sentence each.
    pub notes: Vec<String>,
    /// The material of each surface, by its number.
    pub materials: Vec<u32>,
    /// The names of the materials.
    pub names: Vec<String>,
    /// The object, group or node of each surface, by its number.
    pub parts: Vec<u32>,
}

/// The spots of surfaces in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Spots {
    /// The line of each surface, or 0.
    lines: Vec<u32>,
}

impl Spots {
    /// The spot of a surface in the file; `name` is the surface's.
    pub fn of(&self, surface: usize, name: Option<&str>) -> Spot {
        match (self.lines.get(surface), name) {
            (Some(&line), _) if line > 0 => Spot::Line(line as usize),
            (_, Some(name)) => Spot::Element(format!("face {name:?}")),
            _ => Spot::Element(format!("face {surface}")),
        }
    }
}

/// The most faults that a note lists one by one; a refusal lists all.
const LISTED: usize = 20;

/// The most letters of a name in a message.
const LONGEST_NAME: usize = 60;

/// The extent above which a note asks whether the mesh's unit is a metre [m].
const VAST: f64 = 1000.0;

/// The most cells along an edge of a triangle.
const MAX_CELLS: u32 = u16::MAX as u32;

impl Mesh {
    /// Whether a pattern of `[import.material]` matches a material.
    pub fn has_material(&self, pattern: &str) -> bool {
        self.materials.iter().any(|material| matches(pattern, &material.name))
    }

    /// Turns the mesh into a scene.
    ///
    /// # Errors
    /// Reflectances of 1 and more, faulty faces where those are to be refused, overrides that match nothing, and patch
    /// sizes that would cut a face into too many.
    pub fn into_scene(mut self, path: &Path, format: Format, options: &Options) -> Result<Imported, Error> {
        let at = |fault: Fault| fault.at(path, Spot::File);
        self.place(format, options);
        let mut notes = std::mem::take(&mut self.notes);
        notes.extend(self.note_size());
        let mut finish = Finishes::new(&self, options).map_err(at)?;
        self.drop_faults(&finish, options, &mut notes).map_err(at)?;
        finish.spread_power(&self, options).map_err(at)?;
        finish.limit(&self, options, &mut notes).map_err(at)?;
        finish.note_dropped(&self, &mut notes);
        let faces = if options.join { self.join() } else { self.single() };
        let mut imported = Imported {
            spec: SceneSpec::new(Vec::with_capacity(faces.len())),
            spots: Spots { lines: Vec::with_capacity(faces.len()) },
            notes,
            materials: Vec::with_capacity(faces.len()),
            names: self.materials.iter().map(|material| material.name.clone()).collect(),
            parts: Vec::with_capacity(faces.len()),
        };
        for face in &faces {
            let shape = face.cut(options).map_err(at)?;
            imported.spec.surfaces.push(self.surface(face, shape, &finish));
            imported.spots.lines.push(self.triangles[face.triangle].line);
            imported.materials.push(self.triangles[face.triangle].material);
            imported.parts.push(self.triangles[face.triangle].part);
        }
        Ok(imported)
    }

    /// Converts vertices to metres, with z up.
    fn place(&mut self, format: Format, options: &Options) {
        let default = if matches!(format, Format::Gltf | Format::Obj) { Axis::Y } else { Axis::Z };
        let up = options.up.unwrap_or(default);
        for position in &mut self.positions {
            // Adding 0 turns −0 into 0.
            *position = up.turn(*position) * options.unit + DVec3::ZERO;
        }
    }

    /// The note about a mesh so large that it was hardly meant in metres.
    fn note_size(&self) -> Option<String> {
        let corners = || {
            let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
            corners.map(|corner| self.positions[corner as usize])
        };
        let extent =
            corners().fold(DVec3::NEG_INFINITY, DVec3::max) - corners().fold(DVec3::INFINITY, DVec3::min);
        let extent = extent.max_element();
        (extent > VAST).then(|| {
            format!("the mesh extends over {extent} m: where a unit of the file is no metre, set import.unit (millimetres: 0.001)")
        })
    }

    fn drop_faults(
        &mut self,
        finish: &Finishes,
        options: &Options,
        notes: &mut Vec<String>,
    ) -> Result<(), Fault> {
        let two_sided: Vec<bool> = finish.of.iter().map(|finish| finish.sides == Sides::Both).collect();
        let faulty = Faulty::find(self, &two_sided);
        if faulty.is_empty() {
            return Ok(());
        }
        let found = [(&faulty.degenerate, "have no area"), (&faulty.doubled, "cover another one")];
        let refused = options.faults == Faults::Refuse;
        let listed = if refused { usize::MAX } else { LISTED };
        let found = found.iter().filter(|(faces, _)| !faces.is_empty());
        let told: Vec<String> = found
            .map(|(faces, what)| format!("{} triangles {what}: {}", faces.len(), self.list(faces, listed)))
            .collect();
        if refused {
            return Err(Fault::new(
                told.join("; "),
                "they neither reflect nor emit",
                "remove them, or set import.faults = \"report\"",
            ));
        }
        notes.extend(told.into_iter().map(|told| format!("left out: {told}")));
        faulty.remove_from(self);
        match self.triangles.is_empty() {
            true => {
                Err(Fault::new("no face has an area", "light needs surfaces to meet", "check import.unit"))
            }
            false => Ok(()),
        }
    }

    /// The names of some triangles, at most `listed` of them.
    fn list(&self, triangles: &[usize], listed: usize) -> String {
        let mut names: Vec<String> =
            triangles.iter().take(listed).map(|&i| shortened(self.name(&self.triangles[i]))).collect();
        if triangles.len() > listed {
            names.push(format!("and {} more", triangles.len() - listed));
        }
        names.join(", ")
    }

    /// The name of a triangle's face in outputs.
    fn name(&self, triangle: &Triangle) -> String {
        format!("{}:{}", self.parts[triangle.part as usize], triangle.face)
    }

    fn surface(&self, face: &Face, shape: Shape, finishes: &Finishes) -> SurfaceSpec {
        let triangle = &self.triangles[face.triangle];
        let finish = &finishes.of[triangle.material as usize];
        SurfaceSpec {
            name: Some(self.name(triangle)),
            shape,
            sides: finish.sides,
            reflectance: finish.reflectance,
            emittance: finish.emittance,
            cell_emittance: Vec::new(),
        }
    }

    fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.corners.map(|corner| self.positions[corner as usize])
    }

    /// Makes a face of every triangle.
    fn single(&self) -> Vec<Face> {
        let face = |triangle: usize| {
            let corners = self.corners(&self.triangles[triangle]);
            Face { triangle, corners, parallelogram: false }
        };
        (0..self.triangles.len()).map(face).collect()
    }

    /// Makes a face of every triangle, but one of two that follow each other and form a parallelogram. Its fourth
    /// corner may be off by the slack of scenes, 2⁻⁴⁶ of the largest coordinate; no ray passes through that.
    fn join(&self) -> Vec<Face> {
        let largest = self.positions.iter().fold(0.0_f64, |max, p| max.max(p.abs().max_element()));
        let slack = largest / (1_u64 << 46) as f64;
        let mut faces = Vec::with_capacity(self.triangles.len());
        let mut next = 0;
        while let Some(first) = self.triangles.get(next) {
            let second = self
                .triangles
                .get(next + 1)
                .filter(|second| (second.part, second.material) == (first.part, first.material));
            let corners = self.corners(first);
            let joined = second.and_then(|second| parallelogram(corners, self.corners(second), slack));
            faces.push(Face {
                triangle: next,
                corners: joined.unwrap_or(corners),
                parallelogram: joined.is_some(),
            });
            next += 1 + usize::from(joined.is_some());
        }
        faces
    }
}

/// The corner of a parallelogram and its two neighbours, if two triangles form one: they share the edge opposite the
/// corner, and face the same way.
fn parallelogram(first: [DVec3; 3], second: [DVec3; 3], slack: f64) -> Option<[DVec3; 3]> {
    let turned = |[a, b, c]: [DVec3; 3]| [[a, b, c], [b, c, a], [c, a, b]];
    turned(first).into_iter().find(|&[a, b, c]| {
        turned(second).into_iter().any(|[d, e, f]| {
            // The shared edge runs from b to c in the first, from c to b in the second.
            e == c && f == b && ((b - a) + (c - a) + a - d).abs().max_element() <= slack
        })
    })
}

/// A face on its way to a surface.
struct Face {
    /// The first triangle of the face.
    triangle: usize,
    /// The corners of a triangle, or a corner of a parallelogram and its neighbours.
    corners: [DVec3; 3],
    parallelogram: bool,
}

impl Face {
    /// The outline, cut into as many cells as the options ask for.
    fn cut(&self, options: &Options) -> Result<Shape, Fault> {
        let [a, b, c] = self.corners;
        let (u, v) = ((b - a).length(), (c - a).length());
        if self.parallelogram {
            let cells = [cells(u, options.patch_size)?, cells(v, options.patch_size)?];
            let area = (b - a).cross(c - a).length();
            let fine = finer(area / f64::from(cells[0]) / f64::from(cells[1]), options.max_patch_area)?;
            let cells = cells.map(|n| n.saturating_mul(fine));
            return Ok(Shape::Parallelogram { corner: a, corner_u: b, corner_v: c, cells });
        }
        let rows = cells(u.max(v).max(b.distance(c)), options.patch_size)?;
        let area = 0.5 * (b - a).cross(c - a).length();
        let fine = finer(area / f64::from(rows).powi(2), options.max_patch_area)?;
        Ok(Shape::Triangle { a, b, c, rows: rows.saturating_mul(fine) })
    }
}

/// The number of cells of an edge such that none is longer than `size` [m].
fn cells(length: f64, size: Option<f64>) -> Result<u32, Fault> {
    size.map_or(Ok(1), |size| count(length / size, "patch_size"))
}

/// The factor by which cells of an area must be cut along both edges such that none is larger than `most` [m²].
fn finer(area: f64, most: Option<f64>) -> Result<u32, Fault> {
    most.map_or(Ok(1), |most| count((area / most).sqrt(), "max_patch_area"))
}

/// A number of cells; a ratio that is an integer but for rounding stays that integer.
fn count(ratio: f64, key: &str) -> Result<u32, Fault> {
    let count = (ratio * (1.0 - 1e-12)).ceil().max(1.0);
    if count <= f64::from(MAX_CELLS) {
        return Ok(count as u32);
    }
    Err(Fault::new(
        format!("{key} cuts an edge into {count:e} pieces"),
        format!("a face has at most {MAX_CELLS} along each edge"),
        format!("choose a larger {key}, or check import.unit"),
    ))
}

/// A material after the overrides.
#[derive(Clone, Copy, Debug)]
struct Finish {
    reflectance: Spectrum,
    emittance: Spectrum,
    sides: Sides,
    /// The number of the override that gives its power.
    power: Option<usize>,
}

/// The finishes of all materials.
struct Finishes {
    of: Vec<Finish>,
}

impl Finishes {
    fn new(mesh: &Mesh, options: &Options) -> Result<Self, Fault> {
        for entry in &options.materials {
            if !mesh.has_material(&entry.pattern) {
                let names: Vec<&str> = mesh.materials.iter().map(|material| material.name.as_str()).collect();
                return Err(Fault::new(
                    format!("import.material.{:?} matches no material", entry.pattern),
                    "it would change nothing",
                    format!("the file has {}", names.join(", ")),
                ));
            }
        }
        let finish = |material: &crate::Material| {
            let mut finish = Finish {
                reflectance: material.reflectance,
                emittance: material.emittance,
                sides: sides(options.sides, material.sides),
                power: None,
            };
            let entries = options.materials.iter().enumerate();
            entries
                .filter(|(_, entry)| matches(&entry.pattern, &material.name))
                .for_each(|(number, entry)| finish.follow(number, entry, material.sides));
            finish
        };
        Ok(Finishes { of: mesh.materials.iter().map(finish).collect() })
    }

    /// Gives materials with a power the emittance that makes it over their faces.
    fn spread_power(&mut self, mesh: &Mesh, options: &Options) -> Result<(), Fault> {
        for (number, entry) in options.materials.iter().enumerate() {
            let Some(power) = entry.power else { continue };
            let powered = |triangle: &&Triangle| self.of[triangle.material as usize].power == Some(number);
            let area = |triangle: &Triangle| {
                let [a, b, c] = mesh.corners(triangle);
                0.5 * (b - a).cross(c - a).length() * self.of[triangle.material as usize].sides.count()
            };
            let area: f64 = mesh.triangles.iter().filter(powered).map(area).sum();
            if area <= 0.0 {
                return Err(Fault::new(
                    format!("import.material.{:?}.power has no face to leave from", entry.pattern),
                    "no face has a material that it gives a power to",
                    "correct the name, or remove the entry",
                ));
            }
            let emittance = Spectrum::rgb(power.channels().map(|power| power / area));
            self.of.iter_mut().filter(|f| f.power == Some(number)).for_each(|f| f.emittance = emittance);
        }
        Ok(())
    }

    /// Clamps reflectances to the limit, or refuses those of 1 and more, all in one message.
    fn limit(&mut self, mesh: &Mesh, options: &Options, notes: &mut Vec<String>) -> Result<(), Fault> {
        let mut used = vec![false; self.of.len()];
        mesh.triangles.iter().for_each(|triangle| used[triangle.material as usize] = true);
        let limit = options.reflectance_limit;
        let beyond = |finish: &Finish| finish.reflectance.max() > limit.unwrap_or(1.0_f64.next_down());
        let told: Vec<String> = (0..self.of.len())
            .filter(|&i| used[i] && beyond(&self.of[i]))
            .map(|i| format!("{:?} has {}", mesh.materials[i].name, in_words(self.of[i].reflectance)))
            .collect();
        if told.is_empty() {
            return Ok(());
        }
        let Some(limit) = limit else {
            return Err(Fault::new(
                format!("reflectances of 1 and more: {}", told.join(", ")),
                "walks would never end",
                "set import.reflectance_limit = 0.95 to clamp them, or correct them in [import.material.\"NAME\"]",
            ));
        };
        notes.push(format!("reflectances were clamped to {limit}: {}", told.join(", ")));
        for finish in &mut self.of {
            finish.reflectance =
                Spectrum::rgb(finish.reflectance.channels().map(|channel| channel.min(limit)));
        }
        Ok(())
    }

    /// Adds a note for each used material that lost a part of it.
    fn note_dropped(&self, mesh: &Mesh, notes: &mut Vec<String>) {
        let mut used = vec![false; self.of.len()];
        mesh.triangles.iter().for_each(|triangle| used[triangle.material as usize] = true);
        let dropped =
            mesh.materials.iter().zip(used).filter(|(material, used)| *used && !material.dropped.is_empty());
        notes.extend(dropped.map(|(material, _)| {
            format!("material {:?}: not modelled: {}", material.name, material.dropped.join("; "))
        }));
    }
}

impl Finish {
    fn follow(&mut self, number: usize, entry: &MaterialOverride, written: Option<Sides>) {
        self.reflectance = entry.reflectance.unwrap_or(self.reflectance);
        if let Some(emittance) = entry.emittance {
            (self.emittance, self.power) = (emittance, None);
        }
        if entry.power.is_some() {
            self.power = Some(number);
        }
        if let Some(choice) = entry.sides {
            self.sides = sides(choice, written);
        }
    }
}

fn sides(choice: SidesChoice, written: Option<Sides>) -> Sides {
    match choice {
        SidesChoice::File => written.unwrap_or(Sides::Both),
        SidesChoice::One => Sides::Front,
        SidesChoice::Two => Sides::Both,
    }
}

/// A name of at most [`LONGEST_NAME`] letters; a longer one keeps its beginning and its end.
fn shortened(name: String) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= LONGEST_NAME {
        return name;
    }
    let half = LONGEST_NAME / 2;
    let end = &letters[letters.len() - half + 1..];
    letters[..half].iter().chain(&['…']).chain(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_both_ends() {
        assert_eq!(shortened("room/table:12".into()), "room/table:12");
        let long = shortened(format!("room/{}:12", "inner/".repeat(50)));
        assert_eq!(long.chars().count(), LONGEST_NAME);
        assert!(long.starts_with("room/inner/") && long.ends_with("inner/:12"), "{long}");
    }
}
