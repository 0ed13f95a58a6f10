//! MGF, the Materials and Geometry Format (Ward, version 2.0): all of its surfaces as triangles.

mod colour;
mod context;
mod curved;
mod material;
mod transform;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};

use self::colour::Colour;
use self::context::Context;
use self::curved::Facets;
use self::material::{Optics, Tinted};
use self::transform::Placements;
use crate::error::{Error, Fault, Spot};
use crate::files::Files;
use crate::mesh::{Material, Mesh, Parts, Triangle};
use crate::tally::{Tally, room};
use crate::text::{Lines, name, number, numbers, rest, words};

/// How deep transforms and includes may be nested.
const MAX_DEPTH: usize = 64;

/// The most statements that are executed, those of copies counted each time.
const MAX_STATEMENTS: u64 = 1 << 27;

/// Reads an MGF file and those that it includes.
pub(crate) fn read(
    path: &Path,
    content: &[u8],
    curve_error: f64,
    files: &mut Files<'_>,
) -> Result<Mesh, Error> {
    let mut reader = Reader {
        files,
        stem: crate::stem(path),
        segments: curved::segments(curve_error),
        mesh: Mesh::default(),
        parts: Parts::default(),
        tally: Tally::default(),
        vertices: Context::default(),
        colours: Context::default(),
        materials: Context::default(),
        material: None,
        objects: Vec::new(),
        place: DAffine3::IDENTITY,
        depth: 0,
        executed: 0,
        facets: 0,
    };
    reader.file(path, content)?;
    Ok(reader.finish(curve_error))
}

/// A statement and its line.
struct Statement {
    line: u32,
    text: Vec<u8>,
}

/// A text that is read, for messages.
struct Text {
    path: PathBuf,
    statements: Vec<Statement>,
}

impl Text {
    fn new(path: &Path, content: &[u8]) -> Self {
        let mut lines = Lines::new(content);
        let mut statements = Vec::new();
        while let Some((line, text)) = lines.next() {
            statements.push(Statement { line: line as u32, text: text.to_vec() });
        }
        Text { path: path.into(), statements }
    }

    /// The statement that ends the transform of statement `start`: that many `xf` without arguments later.
    fn end_of(&self, start: usize) -> usize {
        let mut open = 0;
        for (i, statement) in self.statements.iter().enumerate().skip(start) {
            let mut words = words(&statement.text);
            if words.next() == Some(b"xf") {
                if words.next().is_some() {
                    open += 1;
                } else {
                    open -= 1;
                }
            }
            if open == 0 {
                return i;
            }
        }
        self.statements.len()
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Vertex {
    point: DVec3,
    normal: DVec3,
}

struct Reader<'a, 'f> {
    files: &'a mut Files<'f>,
    stem: String,
    /// Sides of the polygon that stands for a circle.
    segments: usize,
    mesh: Mesh,
    parts: Parts,
    tally: Tally,
    vertices: Context<Vertex>,
    colours: Context<Colour>,
    materials: Context<Optics>,
    /// The mesh's number of the current material; `None` since it changed.
    material: Option<u32>,
    objects: Vec<String>,
    place: DAffine3,
    depth: usize,
    executed: u64,
    /// Triangles of curved surfaces.
    facets: u64,
}

impl Reader<'_, '_> {
    fn file(&mut self, path: &Path, content: &[u8]) -> Result<(), Error> {
        let text = Text::new(path, content);
        self.execute(&text, 0, text.statements.len())
    }

    fn execute(&mut self, text: &Text, start: usize, end: usize) -> Result<(), Error> {
        let mut i = start;
        while i < end {
            let Statement { line, text: words_of } = &text.statements[i];
            let at = |fault: Fault| fault.at(&text.path, Spot::Line(*line as usize));
            let arguments: Vec<&[u8]> = words(words_of).collect();
            let Some((&keyword, arguments)) = arguments.split_first() else {
                i += 1;
                continue;
            };
            self.count().map_err(at)?;
            match keyword {
                b"xf" => i = self.transformed(text, i, arguments)?,
                b"i" => self.include(text, *line, arguments)?,
                _ => self.statement(keyword, arguments, words_of, *line).map_err(at)?,
            }
            i += 1;
        }
        Ok(())
    }

    fn count(&mut self) -> Result<(), Fault> {
        self.executed += 1;
        if self.executed <= MAX_STATEMENTS {
            return Ok(());
        }
        Err(Fault::new(
            "the file has too many copies",
            "reading it would take hours",
            "make its arrays smaller",
        ))
    }

    /// Executes what an `xf` encloses, once for each of its placements; returns the index of the closing `xf`.
    fn transformed(&mut self, text: &Text, start: usize, arguments: &[&[u8]]) -> Result<usize, Error> {
        let at = |fault: Fault| fault.at(&text.path, Spot::Line(text.statements[start].line as usize));
        if arguments.is_empty() {
            return Err(at(Fault::new("this `xf` ends no transform", "none is open", "remove it")));
        }
        let end = text.end_of(start);
        let placements = Placements::parse(arguments).map_err(at)?;
        self.place_each(placements, at, |reader| reader.execute(text, start + 1, end))?;
        Ok(end)
    }

    fn place_each(
        &mut self,
        placements: Placements,
        at: impl Fn(Fault) -> Error,
        mut body: impl FnMut(&mut Self) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if self.depth == MAX_DEPTH {
            let why = format!("more than {MAX_DEPTH} transforms or includes are inside each other");
            return Err(at(Fault::new("this is nested too deep", why, "flatten the file")));
        }
        self.depth += 1;
        let above = self.place;
        for place in placements {
            self.count().map_err(&at)?;
            self.place = above * place;
            body(self)?;
        }
        self.place = above;
        self.depth -= 1;
        Ok(())
    }

    fn include(&mut self, text: &Text, line: u32, arguments: &[&[u8]]) -> Result<(), Error> {
        let at = |fault: Fault| fault.at(&text.path, Spot::Line(line as usize));
        let Some((file, transform)) = arguments.split_first() else {
            return Err(at(Fault::new("no file is named", "`i` includes one", "write its name")));
        };
        let file = name(file);
        let (path, content) = self.files.beside(&text.path, &file).map_err(|error| {
            at(Fault::new(format!("{file} cannot be included"), error.to_string(), "put it beside this file"))
        })?;
        let placements = Placements::parse(transform).map_err(at)?;
        let included = Text::new(&path, &content);
        self.place_each(placements, at, |reader| reader.execute(&included, 0, included.statements.len()))
    }

    fn statement(
        &mut self,
        keyword: &[u8],
        arguments: &[&[u8]],
        text: &[u8],
        line: u32,
    ) -> Result<(), Fault> {
        match keyword {
            b"v" => self.vertices.enter("vertex", arguments),
            b"p" => three(arguments).map(|point| self.vertices.change().point = point),
            b"n" => three(arguments).map(|normal| self.vertices.change().normal = normal),
            b"c" | b"cxy" | b"cspec" | b"cct" | b"cmix" => self.colour(keyword, arguments),
            b"m" | b"sides" | b"rd" | b"td" | b"ed" | b"rs" | b"ts" | b"ir" => {
                self.material = None;
                self.optics(keyword, arguments)
            }
            b"o" => {
                self.object(rest(text));
                Ok(())
            }
            b"f" | b"fh" | b"prism" | b"sph" | b"cyl" | b"cone" | b"ring" | b"torus" => {
                self.surface(keyword, arguments, line)
            }
            b"ies" => {
                self.tally.count("luminaires (`ies`) were left out: their light is not modelled");
                Ok(())
            }
            _ => {
                self.tally.count("statements of unknown kind were skipped");
                Ok(())
            }
        }
    }

    fn object(&mut self, name: String) {
        if name.is_empty() {
            self.objects.pop();
        } else {
            self.objects.push(name);
        }
        let part = if self.objects.is_empty() { self.stem.clone() } else { self.objects.join("/") };
        self.parts.enter(&mut self.mesh, &part);
    }

    fn colour(&mut self, keyword: &[u8], arguments: &[&[u8]]) -> Result<(), Fault> {
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
                colour::mix(&parts.collect::<Result<Vec<_>, Fault>>()?)
            }
        };
        *self.colours.change() = colour.ok_or_else(|| {
            Fault::new("these numbers are no colour", "no light has their chromaticity", "correct them")
        })?;
        Ok(())
    }

    fn optics(&mut self, keyword: &[u8], arguments: &[&[u8]]) -> Result<(), Fault> {
        if keyword == b"m" {
            return self.materials.enter("material", arguments);
        }
        let amount = number(arguments.first().copied())?;
        if amount < 0.0 {
            return Err(Fault::new(
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
            // The index of refraction says nothing of diffuse light.
            _ => {}
        }
        Ok(())
    }

    fn surface(&mut self, keyword: &[u8], arguments: &[&[u8]], line: u32) -> Result<(), Fault> {
        let (part, face) = self.parts.next_face(&mut self.mesh, &self.stem);
        let material = self.material_number();
        let triangle = |corners| Triangle { corners, part, face, material, line };
        match keyword {
            b"f" | b"fh" => self.polygon(arguments, &triangle),
            b"prism" => self.prism(arguments, &triangle),
            _ => self.curved(keyword, arguments, &triangle),
        }
    }

    /// The number of the current material in the mesh. A material that changes under its name becomes another one
    /// of that name.
    fn material_number(&mut self) -> u32 {
        if let Some(number) = self.material {
            return number;
        }
        let name = self.materials.name().map_or("default".into(), name);
        let material: Material = self.materials.current().material(&name);
        let number = self.mesh.materials.iter().position(|known| *known == material).unwrap_or_else(|| {
            self.mesh.materials.push(material);
            self.mesh.materials.len() - 1
        });
        self.material = Some(number as u32);
        number as u32
    }

    /// A polygon; `-` stands before the outline of each hole.
    fn polygon(
        &mut self,
        arguments: &[&[u8]],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), Fault> {
        let (mut points, mut holes) = (Vec::new(), Vec::new());
        for &argument in arguments {
            match argument {
                b"-" => holes.push(points.len()),
                name => points.push(self.vertices.get("vertex", name)?.point),
            }
        }
        self.outline(&points, &holes, triangle)
    }

    /// Adds the triangles of a polygon in the coordinates of its statement.
    fn outline(
        &mut self,
        points: &[DVec3],
        holes: &[usize],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), Fault> {
        let outer = holes.first().copied().unwrap_or(points.len());
        let rings = holes.iter().zip(holes.iter().skip(1).copied().chain([points.len()]));
        if outer < 3 || rings.clone().any(|(&start, end)| end < start + 3) {
            return Err(Fault::new(
                "an outline of less than three corners",
                "it has no area",
                "complete the line",
            ));
        }
        let first = self.place_points(points)?;
        let corners: Vec<u32> = (first..first + points.len() as u32).collect();
        let start = self.mesh.triangles.len();
        self.tally.polygon(&mut self.mesh, &corners, holes, triangle)?;
        self.turn_mirrored(start);
        Ok(())
    }

    /// Adds points where the open transforms put them; returns the number of the first.
    fn place_points(&mut self, points: &[DVec3]) -> Result<u32, Fault> {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(points.iter().map(|&point| self.place.transform_point3(point)));
        if self.mesh.positions[first as usize..].iter().all(|position| position.is_finite()) {
            return Ok(first);
        }
        Err(Fault::new("a point is not a finite number", "the transforms put it nowhere", "correct them"))
    }

    /// Turns triangles round where the open transforms mirror them, so that fronts stay fronts.
    fn turn_mirrored(&mut self, start: usize) {
        if self.place.matrix3.determinant() < 0.0 {
            self.mesh.triangles[start..].iter_mut().for_each(|triangle| triangle.corners.swap(1, 2));
        }
    }

    /// A closed right prism: the polygon, its copy moved against its normal by the length, and the sides between. All
    /// faces point outwards, or inwards where the length is negative.
    fn prism(&mut self, arguments: &[&[u8]], triangle: &impl Fn([u32; 3]) -> Triangle) -> Result<(), Fault> {
        let Some((length, names)) = arguments.split_last() else {
            return Err(Fault::new("a prism of nothing", "it has a base and a length", "complete the line"));
        };
        let length = number(Some(length))?;
        let mut base = Vec::new();
        for name in names {
            base.push(self.vertices.get("vertex", name)?.point);
        }
        let Some(normal) = crate::polygon::normal(&base).filter(|_| base.len() >= 3 && length != 0.0) else {
            return Err(Fault::new("the prism has no volume", "its base or its length is 0", "correct it"));
        };
        let moved: Vec<DVec3> = base.iter().map(|&point| point - normal * length).collect();
        self.outline(&base, &[], triangle)?;
        let reversed: Vec<DVec3> = moved.iter().rev().copied().collect();
        self.outline(&reversed, &[], triangle)?;
        for (i, next) in (0..base.len()).map(|i| (i, (i + 1) % base.len())) {
            self.outline(&[base[next], base[i], moved[i], moved[next]], &[], triangle)?;
        }
        Ok(())
    }

    fn curved(
        &mut self,
        keyword: &[u8],
        arguments: &[&[u8]],
        triangle: &impl Fn([u32; 3]) -> Triangle,
    ) -> Result<(), Fault> {
        let n = self.segments;
        let vertex = |i: usize| self.vertices.get("vertex", arguments.get(i).copied().unwrap_or_default());
        let radius = |i: usize| number(arguments.get(i).copied());
        let (facets, inwards) = match keyword {
            b"sph" => {
                let radius = radius(1)?;
                (Facets::sphere(vertex(0)?.point, radius.abs(), n), radius < 0.0)
            }
            b"cyl" => cone(vertex(0)?, radius(1)?, vertex(2)?, radius(1)?, n)?,
            b"cone" => cone(vertex(0)?, radius(1)?, vertex(2)?, radius(3)?, n)?,
            b"ring" => {
                let [inner, outer] = in_order(radius(1)?, radius(2)?)?;
                let vertex = vertex(0)?;
                (Facets::ring(vertex.point, axis(vertex.normal)?, inner.abs(), outer.abs(), n), outer < 0.0)
            }
            _ => {
                let [inner, outer] = in_order(radius(1)?, radius(2)?)?;
                let vertex = vertex(0)?;
                (Facets::torus(vertex.point, axis(vertex.normal)?, inner.abs(), outer.abs(), n), outer < 0.0)
            }
        };
        let first = self.place_points(&facets.points)?;
        let start = self.mesh.triangles.len();
        self.mesh.triangles.extend(facets.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| first + corner);
            triangle(if inwards { [a, c, b] } else { [a, b, c] })
        }));
        self.facets += facets.triangles.len() as u64;
        self.turn_mirrored(start);
        room(&self.mesh)
    }

    fn finish(self, curve_error: f64) -> Mesh {
        let Reader { mut mesh, tally, facets, .. } = self;
        tally.report(&mut mesh);
        if facets > 0 {
            mesh.notes.push(format!(
                "curved surfaces became {facets} triangles, which lie inside them by at most {} % of the radius",
                100.0 * curve_error
            ));
        }
        mesh
    }
}

fn three(arguments: &[&[u8]]) -> Result<DVec3, Fault> {
    Ok(DVec3::from_array(numbers(&mut arguments.iter().copied())?))
}

/// The direction of a normal.
fn axis(normal: DVec3) -> Result<DVec3, Fault> {
    normal.try_normalize().ok_or_else(|| {
        Fault::new("the vertex has no normal", "the surface turns about it", "give it one with `n`")
    })
}

/// Two radii of one sign, the inner one first.
fn in_order(inner: f64, outer: f64) -> Result<[f64; 2], Fault> {
    if inner * outer >= 0.0 && inner.abs() < outer.abs() {
        return Ok([inner, outer]);
    }
    Err(Fault::new(
        format!("radii {inner} and {outer}"),
        "the second is the larger one, of the same sign",
        "correct them",
    ))
}

/// A cone with its sign: negative radii face inwards.
fn cone(
    low: Vertex,
    low_radius: f64,
    high: Vertex,
    high_radius: f64,
    n: usize,
) -> Result<(Facets, bool), Fault> {
    let length = low.point.distance(high.point);
    let some = low_radius != 0.0 || high_radius != 0.0;
    if !(length > 0.0 && length.is_finite() && some && low_radius * high_radius >= 0.0) {
        return Err(Fault::new(
            "the cone has no side",
            "its ends coincide, its radii are 0 or of different sign",
            "correct it",
        ));
    }
    let facets = Facets::cone(low.point, low_radius.abs(), high.point, high_radius.abs(), n);
    Ok((facets, low_radius + high_radius < 0.0))
}
