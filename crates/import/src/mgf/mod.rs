//! MGF, the Materials and Geometry Format (Ward, version 2.0): all of its surfaces as triangles.

mod allowance;
mod colour;
mod context;
mod curved;
mod material;
mod statements;
mod surface;
mod transform;

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine3, DVec3};
use radiosity::Spectrum;

use self::allowance::Allowance;
use self::colour::Colour;
pub(crate) use self::colour::rgb_of_pairs;
use self::context::{Context, Vertex};
use self::material::{Optics, Tinted};
use self::statements::{Statement, Text};
use self::transform::Placements;
use crate::error::{Error, FileSpot, UnplacedError};
use crate::files::Files;
use crate::mesh::{Mesh, MeshParts, short};
use crate::tally::NoteCounts;
use crate::text::{name, number, numbers, rest, words};

/// The most nesting of transforms and includes, and of objects.
const MAX_DEPTH: usize = 64;

/// The steps of a statement beside those for its bytes: for a colour by its spectrum, and for a material that must be
/// looked up again.
const SPECTRUM_STEPS: u64 = 512;
const MATERIAL_STEPS: u64 = 8;

/// The bytes of a statement that are read in one step.
const BYTES_A_STEP: u64 = 16;

/// Reads an MGF file and those that it includes.
pub(crate) fn read(
    path: &Path,
    content: &[u8],
    curve_error: f64,
    files: &mut Files<'_>,
) -> Result<Mesh, Error> {
    let mut reader = MgfReader {
        files,
        stem: crate::stem(path),
        segments: curved::segments(curve_error),
        allowance: Allowance::of(content.len()),
        mesh: Mesh::default(),
        parts: MeshParts::default(),
        tally: NoteCounts::default(),
        vertices: Context::default(),
        colours: Context::default(),
        materials: Context::default(),
        numbers: HashMap::new(),
        material: None,
        objects: Vec::new(),
        place: DAffine3::IDENTITY,
        facets: 0,
    };
    let text = Text::new(path, content);
    reader.execute(&text, 0, text.statements.len())?;
    Ok(reader.finish(curve_error))
}

struct MgfReader<'a, 'f> {
    files: &'a mut Files<'f>,
    stem: String,
    /// The number of sides of the polygon that stands for a circle.
    segments: usize,
    allowance: Allowance,
    mesh: Mesh,
    parts: MeshParts,
    tally: NoteCounts,
    vertices: Context<Vertex>,
    colours: Context<Colour>,
    materials: Context<Optics>,
    /// The mesh's number of each material, by all of its properties.
    numbers: HashMap<String, u32>,
    /// The mesh's number of the current material; `None` after it changed.
    material: Option<u32>,
    objects: Vec<String>,
    place: DAffine3,
    /// The number of triangles of curved surfaces.
    facets: u64,
}

impl MgfReader<'_, '_> {
    fn execute(&mut self, text: &Text, start: usize, end: usize) -> Result<(), Error> {
        let mut i = start;
        while i < end {
            let statement = &text.statements[i];
            let bytes = text.of(statement);
            let at = |fault: UnplacedError| fault.at(&*text.path, FileSpot::Line(statement.line as usize));
            let arguments: Vec<&[u8]> = words(bytes).collect();
            let Some((&keyword, arguments)) = arguments.split_first() else {
                i += 1;
                continue;
            };
            self.allowance.steps(steps(keyword, bytes)).map_err(at)?;
            match keyword {
                b"xf" => i = self.transformed(text, i, arguments)?,
                b"i" => self.include(text, statement, arguments)?,
                _ => self.statement(keyword, arguments, bytes, statement.line).map_err(at)?,
            }
            i += 1;
        }
        Ok(())
    }

    /// Executes the statements that an `xf` encloses, once for each of its placements. Returns the index of the closing
    /// `xf`.
    fn transformed(&mut self, text: &Text, start: usize, arguments: &[&[u8]]) -> Result<usize, Error> {
        let statement = &text.statements[start];
        let at = |fault: UnplacedError| fault.at(&*text.path, FileSpot::Line(statement.line as usize));
        if arguments.is_empty() {
            return Err(at(UnplacedError::new("this `xf` ends no transform", "none is open", "remove it")));
        }
        let placements = Placements::parse(arguments).map_err(at)?;
        self.place_each(placements, text, statement, |reader| {
            reader.execute(text, start + 1, statement.end)
        })?;
        Ok(statement.end)
    }

    /// Executes the statements that a transform or include in `text` encloses, once for each of its placements.
    fn place_each(
        &mut self,
        placements: Placements,
        text: &Text,
        statement: &Statement,
        mut body: impl FnMut(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let at = |fault: UnplacedError| fault.at(&*text.path, FileSpot::Line(statement.line as usize));
        if self.allowance.depth() == MAX_DEPTH {
            let why = format!("more than {MAX_DEPTH} transforms or includes are inside each other");
            return Err(at(UnplacedError::new("this is nested too deep", why, "flatten the file")));
        }
        self.allowance.open(&text.path, statement.line, placements.copies());
        self.allowance.steps(placements.steps()).map_err(at)?;
        let above = self.place;
        for (copy, place) in placements.enumerate() {
            if copy > 0 {
                self.allowance.next_copy();
            }
            self.place = above * place;
            let objects = self.objects.len();
            body(self)?;
            self.close_objects(objects);
        }
        self.place = above;
        self.allowance.close();
        Ok(())
    }

    fn include(&mut self, text: &Text, statement: &Statement, arguments: &[&[u8]]) -> Result<(), Error> {
        let at = |fault: UnplacedError| fault.at(&*text.path, FileSpot::Line(statement.line as usize));
        let Some((file, transform)) = arguments.split_first() else {
            return Err(at(UnplacedError::new("no file is named", "`i` includes one", "write its name")));
        };
        let file = name(file);
        let (path, content) = self.files.beside(&text.path, &file).map_err(|error| {
            at(UnplacedError::new(
                format!("{file} cannot be included"),
                error.to_string(),
                "put it beside this file",
            ))
        })?;
        self.allowance.steps(content.len() as u64 / BYTES_A_STEP).map_err(at)?;
        let placements = Placements::parse(transform).map_err(at)?;
        let included = Text::new(&path, &content);
        self.place_each(placements, text, statement, |reader| {
            reader.execute(&included, 0, included.statements.len())
        })
    }

    fn statement(
        &mut self,
        keyword: &[u8],
        arguments: &[&[u8]],
        text: &[u8],
        line: u32,
    ) -> Result<(), UnplacedError> {
        match keyword {
            b"v" => self.vertices.enter("vertex", arguments),
            b"p" => three(arguments).map(|point| self.vertices.change().point = point),
            b"n" => three(arguments).map(|normal| self.vertices.change().normal = normal),
            b"c" | b"cxy" | b"cspec" | b"cct" | b"cmix" => self.colour(keyword, arguments),
            b"m" | b"sides" | b"rd" | b"td" | b"ed" | b"rs" | b"ts" | b"ir" => {
                self.material = None;
                self.optics(keyword, arguments)
            }
            b"o" => self.object(rest(text)),
            b"f" | b"fh" | b"prism" | b"sph" | b"cyl" | b"cone" | b"ring" | b"torus" => {
                self.surface(keyword, arguments, line)
            }
            b"ies" => {
                self.tally.count("luminaires (`ies`) left out");
                Ok(())
            }
            _ => {
                self.tally.count("statements of unknown kind, skipped");
                Ok(())
            }
        }
    }

    fn object(&mut self, name: String) -> Result<(), UnplacedError> {
        if name.is_empty() {
            self.objects.pop();
        } else if self.objects.len() == MAX_DEPTH {
            let why = format!("more than {MAX_DEPTH} objects are inside each other");
            return Err(UnplacedError::new(
                "this is nested too deep",
                why,
                "close objects by an `o` without a name",
            ));
        } else {
            self.objects.push(short(&name).into_owned());
        }
        self.enter_part();
        Ok(())
    }

    fn enter_part(&mut self) {
        let part = if self.objects.is_empty() { self.stem.clone() } else { self.objects.join("/") };
        self.parts.enter(&mut self.mesh, &part);
    }

    /// Closes all objects but the first `kept`: those that an array or include has opened and left open.
    fn close_objects(&mut self, kept: usize) {
        if self.objects.len() > kept {
            self.objects.truncate(kept);
            self.enter_part();
            self.tally.count("objects left open within a transform or include, which end with it");
        }
    }

    fn colour(&mut self, keyword: &[u8], arguments: &[&[u8]]) -> Result<(), UnplacedError> {
        let mut rest = arguments.iter().copied();
        let colour = match keyword {
            b"c" => return self.colours.enter("colour", arguments),
            b"cxy" => {
                let [x, y] = numbers(&mut rest)?;
                Some(Colour { x, y }).filter(|_| x >= 0.0 && y > 0.0 && x + y <= 1.0)
            }
            b"cct" => {
                Some(number(rest.next())?).filter(|&kelvin| kelvin > 0.0).and_then(colour::of_black_body)
            }
            b"cspec" => {
                let [low, high] = numbers(&mut rest)?;
                let values = rest.map(|word| number(Some(word))).collect::<Result<Vec<_>, _>>()?;
                (values.len() > 1 && high > low).then(|| colour::of_spectrum(low, high, &values)).flatten()
            }
            _ => {
                let parts = arguments.chunks(2).map(|part| {
                    let colour = self.colours.get("colour", part.get(1).copied().unwrap_or_default())?;
                    Ok((number(part.first().copied())?, colour))
                });
                colour::mix(&parts.collect::<Result<Vec<_>, UnplacedError>>()?)
            }
        };
        if colour.is_none() {
            self.tally.count("colours of a chromaticity that no light has, for which grey stands");
        }
        *self.colours.change() = colour.unwrap_or_default();
        Ok(())
    }

    fn optics(&mut self, keyword: &[u8], arguments: &[&[u8]]) -> Result<(), UnplacedError> {
        if keyword == b"m" {
            return self.materials.enter("material", arguments);
        }
        let amount = number(arguments.first().copied())?;
        if amount < 0.0 {
            return Err(UnplacedError::new(
                format!("{amount} is negative"),
                "no surface has such a property",
                "correct it",
            ));
        }
        let colour = self.colours.current();
        let optics = self.materials.change();
        match keyword {
            b"rd" => optics.rd = Tinted { amount, colour },
            b"ed" => optics.ed = Tinted { amount, colour },
            b"td" => optics.td = amount,
            b"rs" => optics.rs = amount,
            b"ts" => optics.ts = amount,
            b"sides" => optics.one_sided = amount == 1.0,
            // The index of refraction does not matter for diffuse light.
            _ => {}
        }
        Ok(())
    }

    /// The number of the current material in the mesh.
    fn material_number(&mut self) -> u32 {
        let number = self.material.unwrap_or_else(|| self.number_of(1.0));
        self.material = Some(number);
        number
    }

    /// The number of the current material with its emittance times a factor. A material that changes under its name becomes another one of
    /// that name.
    fn number_of(&mut self, factor: f64) -> u32 {
        let name = self.materials.name().map_or("default".into(), name);
        let mut material = self.materials.current().material(&short(&name));
        material.emittance = Spectrum::rgb(material.emittance.channels().map(|channel| channel * factor));
        // Rust writes different numbers differently, so the text tells materials apart.
        *self.numbers.entry(format!("{material:?}")).or_insert_with(|| {
            self.mesh.materials.push(material);
            self.mesh.materials.len() as u32 - 1
        })
    }

    fn finish(self, curve_error: f64) -> Mesh {
        let MgfReader { mut mesh, tally, facets, .. } = self;
        tally.report(&mut mesh);
        if facets > 0 {
            mesh.notes.push(format!(
                "curved surfaces are {facets} triangles, which lie inside them by at most {} % of the radius; --set import.curve_error={} halves that",
                100.0 * curve_error,
                0.5 * curve_error
            ));
        }
        mesh
    }
}

fn three(arguments: &[&[u8]]) -> Result<DVec3, UnplacedError> {
    Ok(DVec3::from_array(numbers(&mut arguments.iter().copied())?))
}

/// The work of a statement in steps, without that of triangles.
fn steps(keyword: &[u8], bytes: &[u8]) -> u64 {
    let more = match keyword {
        b"cspec" | b"cct" => SPECTRUM_STEPS,
        b"m" | b"sides" | b"rd" | b"td" | b"ed" | b"rs" | b"ts" | b"o" => MATERIAL_STEPS,
        _ => 1,
    };
    more + bytes.len() as u64 / BYTES_A_STEP
}
