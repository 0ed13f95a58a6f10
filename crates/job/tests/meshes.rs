//! Scenes from files: the same room in every format, every key of `[import]`, meshes within a scene, and the integrating
//! sphere.

use std::fmt::Write;

use crate::common::Folder;
use glam::DVec3;
use job::{Job, Light, load, load_as_written};
use radiosity::{Estimates, Experiment, IndexChoice, SceneSpec, Sequence, Sides};

/// A triangle of a material.
type Face = ([DVec3; 3], &'static str);

/// (name, reflectance, emittance [W/m²])
const MATERIALS: [(&str, f64, f64); 3] = [("white", 0.73, 0.0), ("dark", 0.37, 0.0), ("lamp", 0.0, 12.5)];

/// The inner sides of a box, a lamp below its lid and a block on its floor. Coordinates fit 32-bit floats.
fn cornell() -> Vec<Face> {
    let mut faces = Vec::new();
    let mut quad = |corner: [f64; 3], u: [f64; 3], v: [f64; 3], material| {
        let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
        faces.push(([corner, corner + u, corner + u + v], material));
        faces.push(([corner, corner + u + v, corner + v], material));
    };
    quad([0., 0., 0.], [1., 0., 0.], [0., 1., 0.], "white");
    quad([0., 0., 1.], [0., 1., 0.], [1., 0., 0.], "white");
    quad([0., 0., 0.], [0., 0., 1.], [1., 0., 0.], "white");
    quad([0., 1., 0.], [1., 0., 0.], [0., 0., 1.], "white");
    quad([0., 0., 0.], [0., 1., 0.], [0., 0., 1.], "dark");
    quad([1., 0., 0.], [0., 0., 1.], [0., 1., 0.], "dark");
    quad([0.375, 0.375, 0.984375], [0., 0.25, 0.], [0.25, 0., 0.], "lamp");
    quad([0.25, 0.25, 0.5], [0.25, 0.125, 0.], [-0.125, 0.25, 0.], "white");
    faces
}

fn to_toml(faces: &[Face]) -> String {
    let mut text = String::new();
    for (name, reflectance, emittance) in MATERIALS {
        writeln!(text, "[material.{name}]\nreflectance = {reflectance}\nemittance = {emittance}").unwrap();
    }
    for (corners, material) in faces {
        let corners = corners.map(|corner| corner.to_array());
        writeln!(text, "[[surface]]\nmaterial = \"{material}\"\ntriangle = {corners:?}").unwrap();
    }
    text
}

fn to_obj(faces: &[Face]) -> (String, String) {
    let (mut obj, mut mtl) = ("mtllib room.mtl\no Room\n".to_owned(), String::new());
    for (name, reflectance, emittance) in MATERIALS {
        let three = |x: f64| format!("{x} {x} {x}");
        writeln!(mtl, "newmtl {name}\nKd {}\nKe {}", three(reflectance), three(emittance)).unwrap();
    }
    for (corners, material) in faces {
        corners.iter().for_each(|corner| writeln!(obj, "v {} {} {}", corner.x, corner.y, corner.z).unwrap());
        writeln!(obj, "usemtl {material}\nf -3 -2 -1").unwrap();
    }
    (obj, mtl)
}

fn to_mgf(faces: &[Face]) -> String {
    let mut mgf = String::new();
    for (name, reflectance, emittance) in MATERIALS {
        writeln!(mgf, "m {name} =\n\tsides 1\n\trd {reflectance}\n\ted {emittance}").unwrap();
    }
    for (corners, material) in faces {
        for (name, corner) in ["a", "b", "c"].iter().zip(corners) {
            writeln!(mgf, "v {name} =\n\tp {} {} {}", corner.x, corner.y, corner.z).unwrap();
        }
        writeln!(mgf, "m {material}\nf a b c").unwrap();
    }
    mgf
}

/// A primitive for each triangle, so that faces keep their order.
fn to_glb(faces: &[Face]) -> Vec<u8> {
    let number = |material: &str| MATERIALS.iter().position(|(name, ..)| *name == material).unwrap();
    let materials: Vec<_> = MATERIALS
        .iter()
        .map(|&(name, r, e)| {
            serde_json::json!({
                "name": name,
                "emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": e}},
                "pbrMetallicRoughness": {"baseColorFactor": [r, r, r, 1], "metallicFactor": 0},
            })
        })
        .collect();
    let primitive = |(i, (_, material)): (usize, &Face)| serde_json::json!({"attributes": {"POSITION": i}, "material": number(material)});
    let primitives: Vec<_> = faces.iter().enumerate().map(primitive).collect();
    let accessor = |i: usize| serde_json::json!({"bufferView": 0, "byteOffset": 36 * i, "componentType": 5126, "count": 3, "type": "VEC3"});
    let accessors: Vec<_> = (0..faces.len()).map(accessor).collect();
    let numbers = faces.iter().flat_map(|(corners, _)| corners.iter().flat_map(|corner| corner.to_array()));
    let binary: Vec<u8> = numbers.flat_map(|x| (x as f32).to_le_bytes()).collect();
    let mut json = serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "Room", "mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteLength": binary.len()}],
        "buffers": [{"byteLength": binary.len()}],
    })
    .to_string();
    json.extend(std::iter::repeat_n(' ', json.len().wrapping_neg() % 4));
    let chunk =
        |kind: &[u8; 4], content: &[u8]| [&(content.len() as u32).to_le_bytes()[..], kind, content].concat();
    let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &binary)].concat();
    [b"glTF\x02\0\0\0", &(12 + chunks.len() as u32).to_le_bytes()[..], &chunks].concat()
}

/// Binary: a record for each triangle. STL has no materials.
fn to_stl(faces: &[Face]) -> Vec<u8> {
    let mut stl = vec![0; 80];
    stl.extend((faces.len() as u32).to_le_bytes());
    for (corners, _) in faces {
        let numbers = corners.iter().flat_map(|corner| corner.to_array());
        stl.extend([0; 12].into_iter().chain(numbers.flat_map(|x| (x as f32).to_le_bytes())).chain([0; 2]));
    }
    stl
}

/// ASCII, three vertices for each triangle. PLY has no materials.
fn to_ply(faces: &[Face]) -> String {
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * faces.len(),
        faces.len()
    );
    let corners = faces.iter().flat_map(|(corners, _)| corners);
    corners.for_each(|corner| writeln!(ply, "{} {} {}", corner.x, corner.y, corner.z).unwrap());
    (0..faces.len()).for_each(|i| writeln!(ply, "3 {} {} {}", 3 * i, 3 * i + 1, 3 * i + 2).unwrap());
    ply
}

fn loaded(folder: &Folder, file: &str, overrides: &[&str]) -> Job {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    load_as_written(&folder.path().join(file), &overrides).unwrap()
}

fn nameless(spec: &SceneSpec) -> SceneSpec {
    let mut spec = spec.clone();
    spec.surfaces.iter_mut().for_each(|surface| surface.name = None);
    spec
}

/// A room in every format, in a folder.
fn write_formats(name: &str) -> Folder {
    let folder = Folder::new(name);
    let faces = cornell();
    let (obj, mtl) = to_obj(&faces);
    folder.write("room.toml", to_toml(&faces));
    folder.write("room.obj", obj);
    folder.write("room.mtl", mtl);
    folder.write("room.mgf", to_mgf(&faces));
    folder.write("room.glb", to_glb(&faces));
    folder.write("room.stl", to_stl(&faces));
    folder.write("room.ply", to_ply(&faces));
    folder
}

#[test]
fn one_room_is_the_same_scene_in_every_format() {
    let folder = write_formats("formats");
    let toml = loaded(&folder, "room.toml", &[]);
    let hash = toml.build_scene().unwrap().hash();
    for file in ["room.obj", "room.glb", "room.mgf"] {
        let job = loaded(&folder, file, &["import.up=z", "import.sides=1"]);
        assert_eq!(nameless(job.scene.spec()), nameless(toml.scene.spec()), "{file}");
        assert_eq!(job.build_scene().unwrap().hash(), hash, "{file}");
        let name = job.scene.spec().surfaces[3].name.clone().unwrap();
        assert!(name.starts_with(if file == "room.mgf" { "room:" } else { "Room:" }), "{name}");
    }
}

#[test]
fn formats_without_materials_have_the_same_triangles() {
    let folder = write_formats("bare-triangles");
    let toml = loaded(&folder, "room.toml", &[]);
    for file in ["room.stl", "room.ply"] {
        let job = loaded(&folder, file, &["import.sides=1", "import.material.default.emittance=2"]);
        let expected = toml.scene.spec().surfaces.iter().map(|surface| surface.shape.clone());
        assert!(job.scene.spec().surfaces.iter().map(|surface| surface.shape.clone()).eq(expected), "{file}");
        let finish = &job.scene.spec().surfaces[0];
        assert_eq!((finish.reflectance, finish.emittance), (0.5.into(), 2.0.into()), "{file}");
    }
}

/// A sheet of two triangles of the material `Sheet`, the lower one doubled, and one without area; and a file in which its
/// front shows to the file's x.
const SHEET: &str = "v 0 0 0\nv 0 2 0\nv 0 2 2\nv 0 0 2\nusemtl Sheet\nf 1 2 3\nf 1 3 4\nf 1 3 4\nf 1 1 2\n";

/// What a key of `[import]` makes of the sheet's surfaces, by number: corner, sides, reflectance, emittance, cells.
#[test]
fn every_key_of_import_does_what_it_says() {
    let folder = Folder::new("import-keys");
    folder.write("sheet.obj", SHEET);
    folder.write("sheet.mgf", "m Sheet =\n\tsides 1\n\trd 0.25\n\ted 1\nv a =\n\tp 0 0 0\nv b =\n\tp 0 2 0\nv c =\n\tp 0 2 2\nm Sheet\nf a b c\n");
    let read = |file: &str, more: &[&str]| {
        let mut keys = vec!["import.material.Sheet.emittance=1"];
        keys.extend(more);
        loaded(&folder, file, &keys).scene.spec().surfaces.clone()
    };
    let obj = |more: &[&str]| read("sheet.obj", more);
    let normal = |surfaces: &[radiosity::SurfaceSpec]| {
        let (_, u, v) = surfaces[0].shape.edges();
        u.cross(v).normalize()
    };
    let default = obj(&[]);
    assert_eq!((default.len(), default[0].sides, default[0].reflectance), (2, Sides::Both, 0.5.into()));

    // up: OBJ is turned from y to z; MGF is taken as written.
    let corner = |surfaces: &[radiosity::SurfaceSpec]| surfaces[0].shape.corners()[2];
    assert_eq!(corner(&default), DVec3::new(0.0, -2.0, 2.0));
    assert_eq!(corner(&obj(&["import.up=y"])), corner(&default));
    assert_eq!(corner(&obj(&["import.up=z"])), DVec3::new(0.0, 2.0, 2.0));
    assert_eq!(corner(&obj(&["import.up=x"])), DVec3::new(2.0, 2.0, 0.0));
    assert_eq!(normal(&obj(&["import.up=x"])), DVec3::Z, "the file's x is up");
    assert_eq!(corner(&read("sheet.mgf", &[])), DVec3::new(0.0, 2.0, 2.0));

    // unit, sides
    assert_eq!(corner(&obj(&["import.unit=0.5"])), DVec3::new(0.0, -1.0, 1.0));
    assert_eq!(obj(&["import.sides=1"])[0].sides, Sides::Front);
    assert_eq!(obj(&["import.sides=2"])[0].sides, Sides::Both);
    let mgf = |more: &[&str]| read("sheet.mgf", more)[0].sides;
    assert_eq!((mgf(&["import.sides=file"]), mgf(&["import.sides=2"])), (Sides::Front, Sides::Both));

    // patch_size: the diagonal is 2.83 m. join: the square is one surface.
    assert_eq!(obj(&["import.patch_size=1"])[0].shape.cell_count(), 9);
    let joined = obj(&["import.join=true", "import.patch_size=1"]);
    assert_eq!((joined.len(), joined[0].shape.cell_count()), (1, 4));

    // reflectance_limit, curve_error, materials
    assert_eq!(obj(&["import.reflectance_limit=0.25"])[0].reflectance, 0.25.into());
    let emitted = |more: &[&str]| obj(more)[0].emittance;
    assert_eq!(emitted(&["import.material.Sheet={ power = 8 }"]), 1.0.into(), "over both sides of 4 m²");
    assert_eq!(emitted(&["import.material.Sheet={ power = 8, sides = 1 }"]), 2.0.into());
    assert_eq!(obj(&["import.material.S*t.reflectance=0.75"])[0].reflectance, 0.75.into());
    assert_eq!(obj(&["import.material.Sheet.emittance=[1, 2, 3]"])[0].emittance.channels(), [1.0, 2.0, 3.0]);
    folder.write("ball.mgf", "m Sheet =\n\trd 0.25\n\ted 1\nv a =\n\tp 0 0 0\nm Sheet\nsph a 1\n");
    let count = |error: &str| read("ball.mgf", &[&format!("import.curve_error={error}")]).len();
    assert!(count("0.001") > 4 * count("0.0125"), "{} {}", count("0.001"), count("0.0125"));

    // faults: what is dropped is reported, or refused in one message.
    let job = loaded(&folder, "sheet.obj", &["import.material.Sheet.emittance=1"]);
    let notes = job.scene.notes().join("; ");
    assert!(
        notes.contains("1 triangles have no area") && notes.contains("1 triangles cover another one"),
        "{notes}"
    );
    let refuse = ["import.material.Sheet.emittance=1", "import.faults=refuse"].map(str::to_owned);
    let refused = load(&folder.path().join("sheet.obj"), &refuse).unwrap_err().to_string();
    assert!(refused.contains("have no area") && refused.contains("cover another one"), "{refused}");
}

/// Lumens in, lux out: a word that changes no number. MGF gives lm/m², whose results are luminous unless the job says
/// otherwise.
#[test]
fn light_is_luminous_where_the_format_says_so() {
    let folder = write_formats("light");
    let light = |file: &str, more: &[&str]| loaded(&folder, file, more).light;
    assert_eq!((light("room.mgf", &[]), light("room.obj", &[])), (Light::Luminous, Light::Radiant));
    assert_eq!(light("room.mgf", &["light=radiant"]), Light::Radiant);
    assert_eq!(light("room.toml", &["light=luminous"]), Light::Luminous);
}

#[test]
fn a_scene_in_place_of_a_job_has_every_default() {
    let folder = write_formats("bare");
    let job = loaded(&folder, "room.glb", &["seed=7", "method.walk=gathering"]);
    assert_eq!((&job.name[..], job.budget.paths, job.seed), ("room", job::DEFAULT_PATHS, 7));
    assert_eq!(job.scene.spec().surfaces[0].sides, Sides::Front, "glTF says what is double-sided");
    assert_eq!(loaded(&folder, "room.obj", &[]).scene.spec().surfaces[0].sides, Sides::Both);
    assert_eq!(loaded(&folder, "room.toml", &[]).budget.paths, job::DEFAULT_PATHS);
    // Rectangles are whole where the program cuts the mesh.
    let faces = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|&set| set.into()).collect();
        let job = load(&folder.path().join("room.obj"), &set).unwrap();
        (job.scene.spec().surfaces.len(), job.auto.map_or(0, |auto| auto.surfaces.len()))
    };
    assert_eq!((faces(&[]), faces(&["import.join=false"])), ((8, 8), (16, 16)));
    assert_eq!((faces(&["scene.patches=given"]), faces(&["import.patch_size=0.5"])), ((16, 0), (16, 0)));
    assert_eq!(faces(&["method.walk=shooting"]), (16, 16));
}

#[test]
fn meshes_follow_all_surfaces_of_a_scene() {
    let folder = write_formats("placed");
    let scene = "[[mesh]]\nfile = \"room.obj\"\nmaterial = \"red\"\nmax_patch_area = 0.125\n\
        [material.red]\nreflectance = [0.5, 0.1, 0.1]\nemittance = 1\n\
        [[surface]]\nmaterial = \"red\"\nquad = [[0,0,5],[1,0,5],[0,1,5]]\n";
    folder.write("placed.toml", scene);
    let job = loaded(&folder, "placed.toml", &["import.up=z"]);
    let surfaces = &job.scene.spec().surfaces;
    assert_eq!(surfaces.len(), 1 + cornell().len());
    assert_eq!(surfaces[1].name.as_deref(), Some("Room:0"));
    assert_eq!(surfaces[1].shape.cell_count(), 4);
    assert!(surfaces.iter().all(|surface| surface.reflectance.channels() == [0.5, 0.1, 0.1]));
}

#[test]
fn text_that_looks_like_a_table_is_no_table() {
    let folder = Folder::new("looks-like");
    let one = "[[surface]]\nname = \"a\"\nmaterial = \"m\"\ntriangle = [[0,0,0],[1,0,0],[0,1,0]]\n\
        emit = [\n  { cell = [0, 0], emittance = 2 },\n]\n";
    let other = "[[surface]]\nmaterial = \"m\"\ntriangle = [\n [0,0,1],\n [1,0,1],\n [0,1,1],\n]\n\
        [[surface.emit]]\ncell = [0, 0]\nemittance = 3\n";
    let material = "[material.m]\nreflectance = 0.5\n";
    // Many more than are parsed at a time, with the material in their midst.
    let text = format!("{}{material}{}", one.repeat(700), other.repeat(700));
    folder.write("s.toml", &text);
    let scene = job::load_scene(&folder.path().join("s.toml")).unwrap();
    let emitted = |i: usize| scene.spec().surfaces[i].cell_emittance[0].1[0];
    assert_eq!(
        (scene.spec().surfaces.len(), emitted(699), emitted(700), emitted(1399)),
        (1400, 2.0, 3.0, 3.0)
    );
    folder.write("s.toml", text.replacen("emittance = 3", "emittance = -3", 700).replacen("-3", "3", 699));
    let last = job::load_scene(&folder.path().join("s.toml")).unwrap().build(IndexChoice::Auto).unwrap_err();
    let line = 1 + text[..text.rfind("[[surface.emit]]").unwrap()].matches('\n').count();
    assert!(last.to_string().contains(&format!("s.toml:{line}: surface 1399: emit")), "{last}");
}

/// An icosahedron whose triangles are cut into k² and whose corners are put on the unit sphere, fronts inwards. The
/// first 20 facets are a lamp, the others wall.
fn icosphere(cuts: u32) -> String {
    let t = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corners = [
        [-1., t, 0.],
        [1., t, 0.],
        [-1., -t, 0.],
        [1., -t, 0.],
        [0., -1., t],
        [0., 1., t],
        [0., -1., -t],
        [0., 1., -t],
        [t, 0., -1.],
        [t, 0., 1.],
        [-t, 0., -1.],
        [-t, 0., 1.],
    ]
    .map(DVec3::from_array);
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let (mut obj, mut count, k) = ("usemtl lamp\n".to_owned(), 0, f64::from(cuts));
    for [a, b, c] in faces.map(|face| face.map(|i: usize| corners[i])) {
        let point =
            |i: u32, j: u32| (a + (b - a) * (f64::from(i) / k) + (c - a) * (f64::from(j) / k)).normalize();
        let mut triangle = |corners: [DVec3; 3]| {
            corners.iter().for_each(|p| writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap());
            obj.push_str("f -1 -2 -3\n");
            count += 1;
            if count == 20 {
                obj.push_str("usemtl wall\n");
            }
        };
        for i in 0..cuts {
            for j in 0..cuts - i {
                triangle([point(i, j), point(i + 1, j), point(i, j + 1)]);
                if i + j + 1 < cuts {
                    triangle([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
        }
    }
    obj
}

/// In a sphere every point sees every patch alike: the mean irradiance is Φ_T/(A_T·(1 − R)). Facets do not see
/// themselves, which is a part of 1/(their number); the rest is the error of the walks.
#[test]
fn icospheres_integrate() {
    const WALKS: u64 = 1 << 17;
    let folder = Folder::new("icosphere");
    folder.write("ball.obj", icosphere(8));
    let job = loaded(
        &folder,
        "ball.obj",
        &["import.sides=1", "import.material.lamp.power=10", "import.material.*.reflectance=0.6"],
    );
    let experiment = Experiment::new(job.build_scene().unwrap(), job.method.walks()).unwrap();
    let area: f64 = experiment.scene().faces().iter().map(|patch| patch.area).sum();
    let (mut tally, mut board) = (experiment.tally(), experiment.board());
    experiment.walk(&Sequence::new(11), 0..WALKS, &mut board);
    board.add_to(&mut tally).unwrap();
    assert_eq!((tally.counts.escaped, tally.counts.absorbed_back), (0, 0), "the sphere is closed");
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let arriving: f64 = estimates
        .iter()
        .map(|(_, patch, known)| known.and_then(|k| k[0].irradiance).unwrap_or(0.0) * patch.area)
        .sum();
    let expected = 10.0 / (area * (1.0 - 0.6));
    // Hits of a walk are geometric, of mean 1/(1 − R) and variance R/(1 − R)².
    let error = expected * (0.6 / WALKS as f64).sqrt();
    let facets = experiment.scene().surfaces().len() as f64;
    let found = arriving / area;
    assert!((found - expected).abs() < 4.0 * error + expected / facets, "{found} for {expected} ± {error}");
}
