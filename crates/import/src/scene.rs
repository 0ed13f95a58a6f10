//! The conversion of a mesh to the surfaces of a scene.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};

use crate::Format;
use crate::clean::FaultyTriangles;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::lamps::names_a_lamp;
use crate::mesh::{LostProperty, Material, Mesh, Triangle};
use crate::notes::{beyond, note_clear, note_losses};
use crate::options::{Faults, MaterialOverride, Options, SidesChoice, UpAxis, matches};
use crate::scale::{MeshPart, likely_unit};

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
    /// The textures of the materials, whose means are in their reflectances.
    pub textures: Vec<Option<String>>,
    /// Of each material: whether lamps of it may be found to shine to one side; `None` where the file or the options say which sides are active.
    pub open_sides: Vec<Option<OpenSides>>,
    /// Whether the light of the file is in lumens.
    pub luminous: bool,
    /// The unit that the file is likely to be written in, and its length [m], where that is not the one taken.
    pub likely_unit: Option<(&'static str, f64)>,
}

/// Sides of a lamp that surroundings may decide on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenSides {
    /// The factor by which its emittance grows where one side is found to be the only one that shines.
    pub factor: f64,
    /// Whether the file says both, as Blender writes of nearly everything: then a side is none that looks into a closed shell alone.
    pub both_said: bool,
}

/// The spots of surfaces in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Spots {
    /// The line of each surface, or 0.
    lines: Vec<u32>,
}

impl Spots {
    /// The spot of a surface in the file; `name` is the surface's.
    pub fn of(&self, surface: usize, name: Option<&str>) -> FileSpot {
        match (self.lines.get(surface), name) {
            (Some(&line), _) if line > 0 => FileSpot::Line(line as usize),
            (_, Some(name)) => FileSpot::Element(format!("face {name:?}")),
            _ => FileSpot::Element(format!("face {surface}")),
        }
    }
}

/// The most faults that a note lists one by one; a refusal lists all.
const LISTED: usize = 3;

/// The most names of materials in a message.
const NAMED: usize = 8;

/// The limit of reflectances where the options name none and the file has some of 1 and more.
const LIMIT: f64 = 0.95;

/// The most letters of a name in a message.
const LONGEST_NAME: usize = 60;

/// The most cells along an edge of a triangle.
const MAX_CELLS: u32 = u16::MAX as u32;

impl Mesh {
    /// Whether a pattern of `[import.material]` matches a material or, failing that, a part.
    pub fn has_material(&self, pattern: &str) -> bool {
        self.materials.iter().any(|material| matches(pattern, &material.name))
            || self.parts.iter().any(|part| matches(pattern, part))
    }

    /// Whether a material that some face has emits light after the overrides, or there is a lamp without area.
    pub fn is_lit(&self, options: &Options) -> bool {
        if !self.lamps.list.is_empty() {
            return true;
        }
        let mut used = vec![false; self.materials.len()];
        self.triangles.iter().for_each(|triangle| used[triangle.material as usize] = true);
        let names_no_material = |entry: &&MaterialOverride| {
            !self.materials.iter().any(|material| matches(&entry.pattern, &material.name))
        };
        let of_parts: Vec<&MaterialOverride> = options.materials.iter().filter(names_no_material).collect();
        // Later entries win.
        let part_emits = |part: &String| {
            let mut entries = of_parts.iter().rev().filter(|entry| matches(&entry.pattern, part));
            entries.find_map(|entry| entry.emittance.or(entry.power)).is_some_and(Spectrum::is_lit)
        };
        let emits = |material: &Material| {
            let finish = Finish::of(material, options);
            finish.emits() && !finish.is_left_out()
        };
        self.materials.iter().zip(used).any(|(material, used)| used && emits(material))
            || self.parts.iter().any(part_emits)
    }

    /// The names of materials that mean lamps; of parts, if none of materials does. Where they are a large part of the mesh, the name
    /// is taken to mean something else.
    pub fn lamps_by_name(&self) -> Vec<String> {
        // A part of the area: what is larger is hardly all lamps.
        const LARGE: f64 = 0.2;
        let mut areas = [vec![0.0; self.materials.len()], vec![0.0; self.parts.len()]];
        for triangle in &self.triangles {
            areas[0][triangle.material as usize] += self.area(triangle);
            areas[1][triangle.part as usize] += self.area(triangle);
        }
        let total: f64 = areas[0].iter().sum();
        let materials: Vec<&str> = self.materials.iter().map(|material| material.name.as_str()).collect();
        let parts: Vec<&str> = self.parts.iter().map(String::as_str).collect();
        for (names, areas) in [materials, parts].iter().zip(areas) {
            let named =
                |(name, area): &(&&str, f64)| *area > 0.0 && *area < LARGE * total && names_a_lamp(name);
            let lamps: Vec<(&&str, f64)> = names.iter().zip(areas).filter(named).collect();
            let area: f64 = lamps.iter().map(|(_, area)| area).sum();
            if !lamps.is_empty() && area < LARGE * total {
                return lamps.iter().map(|(name, _)| (**name).to_owned()).collect();
            }
        }
        Vec::new()
    }

    /// The area that the mesh covers seen from above, in squares of the file's unit.
    pub fn footprint(&self, format: Format, options: &Options) -> f64 {
        let up = options.up.unwrap_or(usual_up(format));
        let (low, high) = self.bounds(|position| up.turn(position));
        (high.x - low.x) * (high.y - low.y)
    }

    fn bounds(&self, place: impl Fn(DVec3) -> DVec3) -> (DVec3, DVec3) {
        let corners = self.triangles.iter().flat_map(|triangle| triangle.corners);
        let places = corners.map(|corner| place(self.positions[corner as usize]));
        places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), place| {
            (low.min(place), high.max(place))
        })
    }

    /// Turns the mesh into a scene.
    ///
    /// # Errors
    /// Faulty faces where those are to be refused, reflectances of 1 and more in strict reading, overrides that match nothing, and
    /// patch sizes that would cut a face into too many.
    pub fn into_scene(mut self, path: &Path, format: Format, options: &Options) -> Result<Imported, Error> {
        let at = |fault: UnplacedError| fault.at(path, FileSpot::File);
        self.place(format, options);
        self.split_parts(options);
        let mut notes = Vec::new();
        let mut finish = MeshFinishes::new(&self, options).map_err(at)?;
        self.leave_out(&mut finish, &mut notes).map_err(at)?;
        let likely_unit = self.likely_unit(format, options, &mut notes);
        notes.extend(self.likely_up(format, options, likely_unit.map_or(1.0, |(_, length)| length)));
        self.drop_faults(&finish, options, &mut notes).map_err(at)?;
        finish.spread_power(&self, options).map_err(at)?;
        let areas = self.material_areas();
        finish.limit(&self, &areas, options, &mut notes).map_err(at)?;
        note_losses(&self, &finish.of, &areas, &mut notes);
        notes.append(&mut self.notes);
        let faces = if options.join { self.join() } else { self.single() };
        let mut imported = Imported {
            spec: SceneSpec::new(Vec::with_capacity(faces.len())),
            spots: Spots { lines: Vec::with_capacity(faces.len()) },
            notes,
            materials: Vec::with_capacity(faces.len()),
            names: self.materials.iter().map(|material| material.name.clone()).collect(),
            parts: Vec::with_capacity(faces.len()),
            textures: self.materials.iter().map(|material| material.texture.clone()).collect(),
            open_sides: finish.of.iter().map(|finish| finish.open_sides(format)).collect(),
            luminous: self.luminous || format == Format::Mgf,
            likely_unit,
        };
        for face in &faces {
            let shape = face.cut(options).map_err(at)?;
            imported.spec.surfaces.push(self.surface(face, shape, &finish));
            imported.spots.lines.push(self.triangles[face.triangle].line);
            imported.materials.push(self.triangles[face.triangle].material);
            imported.parts.push(self.triangles[face.triangle].part);
        }
        imported.spec.lamps = self.lamps;
        Ok(imported)
    }

    /// Gives parts that an entry names, where it names no material, materials of their own, called as the part is.
    fn split_parts(&mut self, options: &Options) {
        let mut number_of = HashMap::new();
        // Materials that an entry made are called as parts are: they stop no later entry, which finds them by their names.
        let written = self.materials.len();
        for entry in &options.materials {
            if self.materials[..written].iter().any(|material| matches(&entry.pattern, &material.name)) {
                continue;
            }
            let meant: Vec<bool> = self.parts.iter().map(|part| matches(&entry.pattern, part)).collect();
            let is_meant = |triangle: &&mut Triangle| {
                meant[triangle.part as usize] && (triangle.material as usize) < written
            };
            for triangle in self.triangles.iter_mut().filter(is_meant) {
                triangle.material =
                    *number_of.entry((triangle.part, triangle.material)).or_insert_with(|| {
                        let material = self.materials[triangle.material as usize].clone();
                        let name = self.parts[triangle.part as usize].clone();
                        self.materials.push(Material { name, ..material });
                        self.materials.len() as u32 - 1
                    });
            }
        }
    }

    /// The area of the faces of each material [m²], once the mesh is placed.
    fn material_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.materials.len()];
        self.triangles.iter().for_each(|triangle| areas[triangle.material as usize] += self.area(triangle));
        areas
    }

    /// Takes out the faces of materials that are to be left out, and notes those that no option names.
    fn leave_out(
        &mut self,
        finishes: &mut MeshFinishes,
        notes: &mut Vec<String>,
    ) -> Result<(), UnplacedError> {
        let areas = self.material_areas();
        let is_out = |finish: &Finish, area: &f64| finish.is_left_out() || *area == 0.0;
        // A mesh of nothing but glass is one of surfaces.
        if finishes.of.iter().zip(&areas).all(|(finish, area)| is_out(finish, area)) {
            finishes.of.iter_mut().for_each(|finish| finish.is_clear = false);
        }
        note_clear(self, &finishes.of, &areas, notes);
        self.triangles.retain(|triangle| !finishes.of[triangle.material as usize].is_left_out());
        match self.triangles.is_empty() {
            true => Err(UnplacedError::new(
                "every face is left out",
                "light needs surfaces to meet",
                "leave fewer out",
            )),
            false => Ok(()),
        }
    }

    /// Converts vertices to metres, with z up.
    fn place(&mut self, format: Format, options: &Options) {
        let up = options.up.unwrap_or(usual_up(format));
        for position in &mut self.positions {
            // Adding 0 turns −0 into 0.
            *position = up.turn(*position) * options.unit + DVec3::ZERO;
        }
        // Intensities stay what they are: cd and lx do not depend on the unit.
        for lamp in &mut self.lamps.list {
            lamp.position = up.turn(lamp.position) * options.unit;
            lamp.axes = lamp.axes.map(|axis| up.turn(axis));
        }
    }

    /// The unit that the file is more likely to be written in than the one taken, where none is asked for, with a note.
    fn likely_unit(
        &self,
        format: Format,
        options: &Options,
        notes: &mut Vec<String>,
    ) -> Option<(&'static str, f64)> {
        if options.unit != 1.0 {
            return None;
        }
        let mut bounds = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); self.parts.len()];
        for triangle in &self.triangles {
            let (low, high) = &mut bounds[triangle.part as usize];
            for corner in self.corners(triangle) {
                (*low, *high) = (low.min(corner), high.max(corner));
            }
        }
        let parts: Vec<MeshPart<'_>> = self
            .parts
            .iter()
            .zip(bounds)
            .map(|(name, (low, high))| MeshPart { name, extent: high - low })
            .collect();
        let (low, high) = self.bounds(|position| position);
        let extent = high - low;
        let (name, length) = match self.unit {
            Some(said) => Some(said).filter(|(_, length)| *length != 1.0)?,
            None => likely_unit(extent, &parts, format == Format::Stl)?,
        };
        let why = if self.unit.is_some() { "what the file says" } else { "more likely" };
        let [taken, likely] = [1.0, length].map(|unit| {
            let [x, y, z] = extent.to_array().map(|extent| format!("{:.3}", extent * unit));
            format!("{x} × {y} × {z} m")
        });
        notes.push(format!(
            "the mesh measures {taken} if its unit is 1 m; {name} is {why}, which makes it {likely}; --set import.unit={length}"
        ));
        Some((name, length))
    }

    /// That a room seems to lie on its side, in a file that leaves open which axis points up: floors and ceilings are most of it. They are a storey apart, and
    /// lie as walls do. `unit` is the likely length of a unit [m].
    fn likely_up(&self, format: Format, options: &Options, unit: f64) -> Option<String> {
        // Parts of the area, sines of 5° from upright, and heights [m].
        const MOST: f64 = 0.4;
        const UPRIGHT: f64 = 0.996;
        const STOREY: std::ops::Range<f64> = 1.9..8.0;
        if options.up.is_some() || matches!(format, Format::Gltf | Format::Mitsuba) {
            return None;
        }
        let mut facing = [0.0; 3];
        let mut total = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = self.corners(triangle);
            let (area, normal) =
                (0.5 * (b - a).cross(c - a).length(), (b - a).cross(c - a).normalize_or_zero());
            total += area;
            let axis = normal.to_array().iter().position(|along| along.abs() > UPRIGHT);
            axis.into_iter().for_each(|axis| facing[axis] += area);
        }
        let (low, high) = self.bounds(|position| position);
        let [_, depth, height] = ((high - low) * unit).to_array();
        let lies = facing[1] > MOST * total && facing[1] > 1.5 * facing[2];
        let axis = if usual_up(format) == UpAxis::Y { "z" } else { "y" };
        (lies && STOREY.contains(&depth) && depth < 0.7 * height).then(|| {
            format!(
                "a room seems to lie on its side: most of the area faces along the file's {axis}, over {depth:.2} m; --set import.up={axis} stands it upright"
            )
        })
    }

    fn drop_faults(
        &mut self,
        finish: &MeshFinishes,
        options: &Options,
        notes: &mut Vec<String>,
    ) -> Result<(), UnplacedError> {
        let two_sided: Vec<bool> = finish.of.iter().map(|finish| finish.sides == Sides::Both).collect();
        let emits: Vec<bool> = finish.of.iter().map(Finish::emits).collect();
        let faulty = FaultyTriangles::find(self, &two_sided, &emits);
        if faulty.is_empty() {
            return Ok(());
        }
        let found = [(&faulty.degenerate, "have no area"), (&faulty.doubled, "cover another one")];
        let refused = options.faults == Faults::Refuse;
        let listed = if refused { usize::MAX } else { LISTED };
        let found = found.iter().filter(|(faces, _)| !faces.is_empty());
        let mut left_out: Vec<String> = found
            .map(|(faces, what)| format!("{} triangles {what}: {}", faces.len(), self.list(faces, listed)))
            .collect();
        let power = self.power(&faulty.doubled, finish);
        if power > 0.0 {
            left_out.push(format!("with them {power:.3} W or lm that they emit"));
        }
        if refused {
            return Err(UnplacedError::new(
                left_out.join("; "),
                "they neither reflect nor emit",
                "remove them, or set import.faults = \"report\"",
            ));
        }
        if !left_out.is_empty() {
            notes.push(format!(
                "left out: {}; --set import.faults=refuse lists them all",
                left_out.join("; ")
            ));
        }
        faulty.remove_from(self);
        match self.triangles.is_empty() {
            true => Err(UnplacedError::new(
                "no face has an area",
                "light needs surfaces to meet",
                "check import.unit",
            )),
            false => Ok(()),
        }
    }

    /// What some triangles emit, but for those that share out a power given for all of their faces.
    fn power(&self, triangles: &[usize], finishes: &MeshFinishes) -> f64 {
        let power = |&i: &usize| {
            let triangle = &self.triangles[i];
            let finish = &finishes.of[triangle.material as usize];
            let shares = finish.power.is_some();
            if shares { 0.0 } else { finish.emittance.max() * finish.sides.count() * self.area(triangle) }
        };
        triangles.iter().map(power).sum()
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

    /// The names of some used materials, and how many more there are.
    fn material_names(&self) -> String {
        let mut used = vec![false; self.materials.len()];
        self.triangles.iter().for_each(|triangle| used[triangle.material as usize] = true);
        let names =
            self.materials.iter().zip(used).filter(|(_, used)| *used).map(|(material, _)| &material.name);
        let names: BTreeSet<&String> = names.collect();
        let mut listed: Vec<String> =
            names.iter().take(NAMED).map(|name| format!("{:?}", shortened((*name).clone()))).collect();
        if names.len() > NAMED {
            listed.push(format!("and {} more, which `radwalk check` lists", names.len() - NAMED));
        }
        listed.join(", ")
    }

    /// The name of a triangle's face in outputs.
    fn name(&self, triangle: &Triangle) -> String {
        format!("{}:{}", self.parts[triangle.part as usize], triangle.face)
    }

    fn surface(&self, face: &MeshFace, shape: Shape, finishes: &MeshFinishes) -> SurfaceSpec {
        let triangle = &self.triangles[face.triangle];
        let finish = &finishes.of[triangle.material as usize];
        SurfaceSpec {
            name: Some(self.name(triangle).into()),
            shape,
            sides: finish.sides,
            reflectance: finish.reflectance,
            emittance: finish.emittance,
            cell_emittance: Vec::new(),
            transmittance: Default::default(),
        }
    }

    /// Makes a face of every triangle.
    fn single(&self) -> Vec<MeshFace> {
        let face = |triangle: usize| {
            let corners = self.corners(&self.triangles[triangle]);
            MeshFace { triangle, corners, parallelogram: false }
        };
        (0..self.triangles.len()).map(face).collect()
    }

    /// Makes a face of every triangle, but one of two that follow each other and form a parallelogram. Its fourth
    /// corner may be off by the slack of scenes, 2⁻⁴⁶ of the largest coordinate; no ray passes through that.
    fn join(&self) -> Vec<MeshFace> {
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
            faces.push(MeshFace {
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
struct MeshFace {
    /// The first triangle of the face.
    triangle: usize,
    /// The corners of a triangle, or a corner of a parallelogram and its neighbours.
    corners: [DVec3; 3],
    parallelogram: bool,
}

impl MeshFace {
    /// The outline, cut into as many cells as the options ask for.
    fn cut(&self, options: &Options) -> Result<Shape, UnplacedError> {
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
fn cells(length: f64, size: Option<f64>) -> Result<u32, UnplacedError> {
    size.map_or(Ok(1), |size| count(length / size, "patch_size"))
}

/// The factor by which cells of an area must be cut along both edges such that none is larger than `most` [m²].
fn finer(area: f64, most: Option<f64>) -> Result<u32, UnplacedError> {
    most.map_or(Ok(1), |most| count((area / most).sqrt(), "max_patch_area"))
}

/// A number of cells; a ratio that is an integer but for rounding stays that integer.
fn count(ratio: f64, key: &str) -> Result<u32, UnplacedError> {
    let count = (ratio * (1.0 - 1e-12)).ceil().max(1.0);
    if count <= f64::from(MAX_CELLS) {
        return Ok(count as u32);
    }
    Err(UnplacedError::new(
        format!("{key} cuts an edge into {count:e} pieces"),
        format!("a face has at most {MAX_CELLS} along each edge"),
        format!("choose a larger {key}, or check import.unit"),
    ))
}

/// A material after the overrides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Finish {
    pub(crate) reflectance: Spectrum,
    pub(crate) emittance: Spectrum,
    sides: Sides,
    /// Where its power is given, if it is.
    power: Option<PowerKey>,
    /// What an option says of whether its faces are left out.
    pub(crate) leave_out: Option<bool>,
    /// Whether most light passes it as if it were not there.
    is_clear: bool,
    /// Whether the reflectance is the file's, and whether the emittance is.
    pub(crate) own_reflectance: bool,
    pub(crate) own_emittance: bool,
    /// The sides that the file says, if it does; `None` where an option says them.
    said_sides: Option<Option<Sides>>,
}

/// Where the power of a material is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PowerKey {
    /// In the file.
    Own,
    /// In the override with this number.
    Entry(usize),
}

/// The finishes of all materials.
struct MeshFinishes {
    of: Vec<Finish>,
}

impl MeshFinishes {
    fn new(mesh: &Mesh, options: &Options) -> Result<Self, UnplacedError> {
        for entry in &options.materials {
            if !mesh.has_material(&entry.pattern) {
                return Err(UnplacedError::new(
                    format!("import.material.{:?} matches no material and no part", entry.pattern),
                    "it would change nothing",
                    format!("the file has {}", mesh.material_names()),
                ));
            }
        }
        Ok(MeshFinishes { of: mesh.materials.iter().map(|material| Finish::of(material, options)).collect() })
    }

    /// Gives materials with a power the emittance that makes it over their faces.
    fn spread_power(&mut self, mesh: &Mesh, options: &Options) -> Result<(), UnplacedError> {
        let mut areas = vec![0.0; self.of.len()];
        for triangle in &mesh.triangles {
            let number = triangle.material as usize;
            areas[number] += mesh.area(triangle) * self.of[number].sides.count();
        }
        for (number, entry) in options.materials.iter().enumerate() {
            let Some(power) = entry.power else { continue };
            let powered = |finish: &Finish| finish.power == Some(PowerKey::Entry(number));
            let area: f64 =
                self.of.iter().zip(&areas).filter(|(of, _)| powered(of)).map(|(_, area)| area).sum();
            if area <= 0.0 {
                return Err(UnplacedError::new(
                    format!("import.material.{:?}.power has no face to leave from", entry.pattern),
                    "no face has a material that it gives a power to",
                    "correct the name, or remove the entry",
                ));
            }
            let emittance = Spectrum::rgb(power.channels().map(|power| power / area));
            self.of.iter_mut().filter(|of| powered(of)).for_each(|of| of.emittance = emittance);
        }
        for ((finish, material), area) in self.of.iter_mut().zip(&mesh.materials).zip(areas) {
            if let Some(power) = material.power.filter(|_| finish.power == Some(PowerKey::Own) && area > 0.0)
            {
                finish.emittance = Spectrum::rgb(power.channels().map(|power| power / area));
            }
        }
        Ok(())
    }

    /// Clamps reflectances to the limit that is asked for, or to [`LIMIT`] where some are 1 and more. Strict reading refuses these.
    fn limit(
        &mut self,
        mesh: &Mesh,
        areas: &[f64],
        options: &Options,
        notes: &mut Vec<String>,
    ) -> Result<(), UnplacedError> {
        let asked = options.reflectance_limit;
        let bright = |reflectance: Spectrum| reflectance.max() > asked.unwrap_or(1.0_f64.next_down());
        let Some(text) = beyond(mesh, &self.of, areas, bright) else { return Ok(()) };
        if asked.is_none() && options.strict {
            return Err(UnplacedError::new(
                text,
                "walks would never end",
                format!("set import.reflectance_limit = {LIMIT} to clamp them, or read without --strict"),
            ));
        }
        let limit = asked.unwrap_or(LIMIT);
        notes.push(format!(
            "clamped to {limit}, as all are: {text}; --set import.reflectance_limit=0.9 sets another limit"
        ));
        for finish in &mut self.of {
            finish.reflectance =
                Spectrum::rgb(finish.reflectance.channels().map(|channel| channel.min(limit)));
        }
        Ok(())
    }
}

impl Finish {
    /// A material after the overrides that match it.
    fn of(material: &Material, options: &Options) -> Self {
        let mut finish = Finish {
            reflectance: material.reflectance,
            emittance: material.emittance,
            sides: sides(options.sides, material.sides),
            power: material.power.map(|_| PowerKey::Own),
            leave_out: None,
            is_clear: material.lost.contains(&LostProperty::Clearness),
            own_reflectance: true,
            own_emittance: true,
            said_sides: (options.sides == SidesChoice::File).then_some(material.sides),
        };
        let entries = options.materials.iter().enumerate();
        entries
            .filter(|(_, entry)| matches(&entry.pattern, &material.name))
            .for_each(|(number, entry)| finish.follow(number, entry, material.sides));
        finish
    }

    fn follow(&mut self, number: usize, entry: &MaterialOverride, written: Option<Sides>) {
        self.own_reflectance &= entry.reflectance.is_none();
        self.own_emittance &= entry.emittance.or(entry.power).is_none();
        self.reflectance = entry.reflectance.unwrap_or(self.reflectance);
        self.leave_out = entry.leave_out.or(self.leave_out);
        if let Some(emittance) = entry.emittance {
            (self.emittance, self.power) = (emittance, None);
        }
        if entry.power.is_some() {
            self.power = Some(PowerKey::Entry(number));
        }
        if let Some(choice) = entry.sides {
            self.sides = sides(choice, written);
            self.said_sides = (choice == SidesChoice::File).then_some(written);
        }
    }

    fn emits(&self) -> bool {
        self.emittance.is_lit() || self.power.is_some()
    }

    /// Whether its faces are left out: where an option asks for it, and those that light passes, unless an option makes a surface of them.
    pub(crate) fn is_left_out(&self) -> bool {
        self.leave_out.unwrap_or(self.is_clear && self.own_reflectance && !self.emits())
    }

    /// What surroundings may decide of its sides in a file of this format; `None` where they are given.
    fn open_sides(&self, format: Format) -> Option<OpenSides> {
        let factor = if self.power.is_some() { self.sides.count() } else { 1.0 };
        match self.said_sides? {
            None => Some(OpenSides { factor, both_said: false }),
            Some(Sides::Both) if format == Format::Gltf => Some(OpenSides { factor, both_said: true }),
            Some(_) => None,
        }
    }
}

/// The axis that is up in files of a format: exporters write glTF, OBJ and Mitsuba's scenes with y up.
fn usual_up(format: Format) -> UpAxis {
    if matches!(format, Format::Gltf | Format::Obj | Format::Mitsuba) { UpAxis::Y } else { UpAxis::Z }
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
