//! Times and memory of reading scenes of 10⁴, 10⁵ and 10⁶ triangles in every format, as a table of Markdown:
//! `radwalk-lab reading [TRIANGLES…]`.
//!
//! Each file is read in a process of its own, which is also how one file is measured: `… read FILE`. Times are
//! processor times, so that other work of the machine has little part in them.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::DVec3;
use job::to_toml;
use radiosity::{IndexChoice, SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};
use scenes::interior;

use super::Failure;
use crate::clock::process_seconds;

/// The fewest triangles of [`interior`]; smaller scenes are a part of it.
const LEAST: usize = 50_000;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    if let [command, file] = words
        && command == "read"
    {
        return Ok(read(Path::new(file))?);
    }
    let sizes: Vec<usize> = match words.is_empty() {
        true => vec![10_000, 100_000, 1_000_000],
        false => words.iter().map(|size| size.parse().expect("a number of triangles")).collect(),
    };
    println!("| triangles | file | MB | parse [s] | scene [s] | tree [s] | all [s] | memory [MB] |");
    println!("|---|---|---|---|---|---|---|---|");
    for size in sizes {
        let folder = tempfile::tempdir()?;
        for file in write_all(&part_of_interior(size), folder.path())? {
            let this = std::env::current_exe()?;
            let row = Command::new(this).args(["reading", "read"]).arg(&file).output()?;
            assert!(row.status.success(), "{}", String::from_utf8_lossy(&row.stderr));
            print!("{}", String::from_utf8_lossy(&row.stdout));
            io::stdout().flush()?;
        }
    }
    Ok(())
}

/// Reads one file as `radwalk run` does, and prints its row.
fn read(file: &Path) -> io::Result<()> {
    let began = process_seconds();
    let (parsed, spec) = match import::Format::of(file) {
        Some(format) => {
            let content = std::fs::read(file)?;
            let mut open = |path: &Path| std::fs::read(path);
            let mesh = import::read(file, &content, format, 0.0125, &mut import::Files::new(&mut open));
            let mesh = mesh.map_err(io::Error::other)?;
            drop(content);
            let parsed = process_seconds();
            let options = import::Options { reflectance_limit: Some(0.95), ..import::Options::default() };
            let options = match format {
                import::Format::Stl => import::Options { materials: vec![lamp()], ..options },
                import::Format::Ply => import::Options { materials: vec![lamp()], ..options },
                _ => options,
            };
            (parsed, mesh.into_scene(file, format, &options).map_err(io::Error::other)?.spec)
        }
        None => {
            let scene = job::load_scene(file).map_err(io::Error::other)?;
            (process_seconds(), scene.spec().clone())
        }
    };
    let made = process_seconds();
    let scene = radiosity::Scene::build(&spec, IndexChoice::Auto).map_err(io::Error::other)?;
    let built = process_seconds();
    let kind = file.extension().unwrap_or_default().to_string_lossy();
    let kind = if file.file_stem().is_some_and(|stem| stem == "ascii") {
        format!("{kind}, ASCII")
    } else {
        kind.into()
    };
    println!(
        "| {} | {kind} | {:.1} | {:.2} | {:.2} | {:.2} | {:.2} | {:.0} |",
        scene.surfaces().len(),
        std::fs::metadata(file)?.len() as f64 / 1e6,
        parsed - began,
        made - parsed,
        built - made,
        built - began,
        peak_memory() / 1e6
    );
    Ok(())
}

/// The material of all faces in STL and PLY, which have none: all faces emit.
fn lamp() -> import::MaterialOverride {
    import::MaterialOverride { emittance: Some(1.0.into()), ..import::MaterialOverride::of("*") }
}

/// The most memory that this process has held, in bytes; 0 if the system does not tell.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:").map(str::to_owned));
    line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| 1024.0 * kb)
}

/// Triangles of [`interior`] and all its lamps, evenly chosen if fewer are asked for than it has.
fn part_of_interior(triangles: usize) -> Vec<SurfaceSpec> {
    let surfaces = interior(triangles.max(LEAST)).surfaces;
    let every = (surfaces.len() / triangles).max(1);
    let kept = surfaces.into_iter().enumerate();
    kept.filter(|(number, surface)| number % every == 0 || surface.emittance.is_lit())
        .map(|(_, kept)| kept)
        .collect()
}

fn corners(surface: &SurfaceSpec) -> [DVec3; 3] {
    let Shape::Triangle { a, b, c, .. } = surface.shape else { panic!("interiors are of triangles") };
    [a, b, c]
}

/// A mesh as exporters write it: vertices that triangles share, and materials by number.
struct Indexed {
    vertices: Vec<DVec3>,
    triangles: Vec<([usize; 3], usize)>,
    materials: Vec<(Spectrum, Spectrum, Sides)>,
}

impl Indexed {
    fn of(surfaces: &[SurfaceSpec]) -> Self {
        let mut indexed = Indexed { vertices: vec![], triangles: vec![], materials: vec![] };
        let mut known: HashMap<[u64; 3], usize> = HashMap::new();
        for surface in surfaces {
            let material = (surface.reflectance, surface.emittance, surface.sides);
            let found = indexed.materials.iter().position(|known| *known == material);
            let material = found.unwrap_or_else(|| {
                indexed.materials.push(material);
                indexed.materials.len() - 1
            });
            let numbers = corners(surface).map(|corner| {
                *known.entry(corner.to_array().map(f64::to_bits)).or_insert_with(|| {
                    indexed.vertices.push(corner);
                    indexed.vertices.len() - 1
                })
            });
            indexed.triangles.push((numbers, material));
        }
        indexed
    }
}

/// Writes the scene in every format, and returns the files.
fn write_all(surfaces: &[SurfaceSpec], folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mesh = Indexed::of(surfaces);
    let (obj, mtl) = to_obj(&mesh);
    std::fs::write(folder.join("room.mtl"), mtl)?;
    let files: [(&str, Vec<u8>); 8] = [
        ("room.obj", obj.into_bytes()),
        ("room.glb", to_glb(&mesh)),
        ("room.stl", to_stl(surfaces)),
        ("ascii.stl", to_ascii_stl(surfaces).into_bytes()),
        ("room.ply", to_ply(&mesh, false)),
        ("ascii.ply", to_ply(&mesh, true)),
        ("room.mgf", to_mgf(&mesh).into_bytes()),
        ("room.toml", to_toml(&SceneSpec::new(surfaces.to_vec())).into_bytes()),
    ];
    let write = |(name, content): (&str, Vec<u8>)| {
        let path = folder.join(name);
        std::fs::write(&path, content).map(|()| path)
    };
    files.into_iter().map(write).collect()
}

fn rgb(spectrum: Spectrum) -> String {
    let [r, g, b] = spectrum.channels();
    format!("{r} {g} {b}")
}

fn to_obj(mesh: &Indexed) -> (String, String) {
    let (mut obj, mut mtl) = ("mtllib room.mtl\no Room\n".to_owned(), String::new());
    for (number, (reflectance, emittance, _)) in mesh.materials.iter().enumerate() {
        writeln!(mtl, "newmtl m{number}\nKd {}\nKe {}", rgb(*reflectance), rgb(*emittance)).unwrap();
    }
    mesh.vertices.iter().for_each(|v| writeln!(obj, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z).unwrap());
    let mut current = usize::MAX;
    for ([a, b, c], material) in &mesh.triangles {
        if *material != current {
            writeln!(obj, "usemtl m{material}").unwrap();
            current = *material;
        }
        writeln!(obj, "f {0}//{0} {1}//{1} {2}//{2}", a + 1, b + 1, c + 1).unwrap();
    }
    (obj, mtl)
}

/// The mesh as a binary glTF file, with one primitive for each material.
fn to_glb(mesh: &Indexed) -> Vec<u8> {
    let mut binary: Vec<u8> =
        mesh.vertices.iter().flat_map(|v| v.to_array().map(|x| (x as f32).to_le_bytes())).flatten().collect();
    let (mut views, mut accessors, mut primitives) = (String::new(), String::new(), String::new());
    write!(views, r#"{{"buffer":0,"byteLength":{}}}"#, binary.len()).unwrap();
    let count = mesh.vertices.len();
    write!(accessors, r#"{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}"#).unwrap();
    let mut materials = Vec::new();
    for (number, (reflectance, emittance, sides)) in mesh.materials.iter().enumerate() {
        let indices: Vec<u8> = mesh
            .triangles
            .iter()
            .filter(|(_, material)| *material == number)
            .flat_map(|(corners, _)| corners.map(|corner| (corner as u32).to_le_bytes()))
            .flatten()
            .collect();
        let (start, length) = (binary.len(), indices.len());
        write!(views, r#",{{"buffer":0,"byteOffset":{start},"byteLength":{length}}}"#).unwrap();
        let (view, count) = (number + 1, length / 4);
        write!(accessors, r#",{{"bufferView":{view},"componentType":5125,"count":{count},"type":"SCALAR"}}"#)
            .unwrap();
        let comma = if number > 0 { "," } else { "" };
        write!(
            primitives,
            r#"{comma}{{"attributes":{{"POSITION":0}},"indices":{view},"material":{number}}}"#
        )
        .unwrap();
        let [r, g, b] = reflectance.channels();
        let (e, two) = (emittance.max(), *sides == Sides::Both);
        materials.push(format!(
            r#"{{"name":"m{number}","doubleSided":{two},"pbrMetallicRoughness":{{"metallicFactor":0,"baseColorFactor":[{r},{g},{b},1]}},"emissiveFactor":[1,1,1],"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":{e}}}}}}}"#
        ));
        binary.extend(indices);
    }
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"Room","mesh":0}}],"meshes":[{{"primitives":[{primitives}]}}],"materials":[{}],"accessors":[{accessors}],"bufferViews":[{views}],"buffers":[{{"byteLength":{}}}]}}"#,
        materials.join(","),
        binary.len()
    );
    json.extend(std::iter::repeat_n(' ', json.len().wrapping_neg() % 4));
    let chunk =
        |kind: &[u8; 4], content: &[u8]| [&(content.len() as u32).to_le_bytes()[..], kind, content].concat();
    let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &binary)].concat();
    [b"glTF\x02\0\0\0", &(12 + chunks.len() as u32).to_le_bytes()[..], &chunks].concat()
}

fn to_stl(surfaces: &[SurfaceSpec]) -> Vec<u8> {
    let mut stl = vec![0; 80];
    stl.extend((surfaces.len() as u32).to_le_bytes());
    for surface in surfaces {
        stl.extend([0; 12]);
        stl.extend(
            corners(surface).iter().flat_map(|v| v.to_array().map(|x| (x as f32).to_le_bytes())).flatten(),
        );
        stl.extend([0; 2]);
    }
    stl
}

fn to_ascii_stl(surfaces: &[SurfaceSpec]) -> String {
    let mut stl = "solid room\n".to_owned();
    for surface in surfaces {
        stl.push_str("facet normal 0 0 0\nouter loop\n");
        corners(surface)
            .iter()
            .for_each(|v| writeln!(stl, "vertex {:.6} {:.6} {:.6}", v.x, v.y, v.z).unwrap());
        stl.push_str("endloop\nendfacet\n");
    }
    stl + "endsolid room\n"
}

fn to_ply(mesh: &Indexed, ascii: bool) -> Vec<u8> {
    let format = if ascii { "ascii" } else { "binary_little_endian" };
    let mut ply = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for v in &mesh.vertices {
        match ascii {
            true => writeln!(ply, "{:.6} {:.6} {:.6}", v.x, v.y, v.z).unwrap(),
            false => ply.extend(v.to_array().map(|x| (x as f32).to_le_bytes()).into_iter().flatten()),
        }
    }
    for ([a, b, c], _) in &mesh.triangles {
        match ascii {
            true => writeln!(ply, "3 {a} {b} {c}").unwrap(),
            false => {
                ply.push(3);
                ply.extend([a, b, c].into_iter().flat_map(|corner| (*corner as i32).to_le_bytes()));
            }
        }
    }
    ply
}

fn to_mgf(mesh: &Indexed) -> String {
    let mut mgf = String::new();
    for (number, (reflectance, emittance, sides)) in mesh.materials.iter().enumerate() {
        let (sides, r, e) = (sides.count(), reflectance.max(), emittance.max());
        writeln!(mgf, "m m{number} =\n\tsides {sides}\n\trd {r}\n\ted {e}").unwrap();
    }
    for (number, v) in mesh.vertices.iter().enumerate() {
        writeln!(mgf, "v v{number} =\n\tp {:.6} {:.6} {:.6}", v.x, v.y, v.z).unwrap();
    }
    let mut current = usize::MAX;
    for ([a, b, c], material) in &mesh.triangles {
        if *material != current {
            writeln!(mgf, "m m{material}").unwrap();
            current = *material;
        }
        writeln!(mgf, "f v{a} v{b} v{c}").unwrap();
    }
    mgf
}
