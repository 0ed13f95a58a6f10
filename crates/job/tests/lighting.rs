//! Meshes without light, and what is typed to have it otherwise: each remedy of a note is tried.

use crate::common::Folder;
use job::{Job, Light, load};
use radiosity::Sides;

/// A box of an OBJ file, y up, fronts inwards: floor, ceiling and walls, in units of which `scale` is a metre.
fn room(scale: f64) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let [x, y, z] = [(i & 1, 5.0), (i >> 1 & 1, 2.5), (i >> 2 & 1, 4.0)]
            .map(|(on, size)| f64::from(on) * size * scale);
        text += &format!("v {x} {y} {z}\n");
    }
    // The ceiling alone has a group, so that messages can name a part.
    text + "o Walls\nf 5 6 2 1\nf 1 2 4 3\nf 7 8 6 5\nf 3 7 5 1\nf 6 8 4 2\no Ceiling\nf 3 4 8 7\n"
}

fn read(folder: &Folder, overrides: &[&str]) -> Job {
    load(&folder.path().join("room.obj"), &overrides.iter().map(|&text| text.to_owned()).collect::<Vec<_>>())
        .unwrap()
}

fn power(job: &Job) -> f64 {
    let power = |surface: &radiosity::SurfaceSpec| {
        surface.emittance[0] * surface.shape.area() * surface.sides.count()
    };
    job.scene.spec().surfaces.iter().map(power).sum()
}

#[test]
fn a_closed_room_gets_a_lamp_of_500_lm_for_each_square_metre_in_any_unit() {
    let folder = Folder::new("closed");
    for scale in [1.0, 100.0, 1000.0] {
        folder.write("room.obj", room(scale));
        let job = read(&folder, &[]);
        assert_eq!(job.light, Light::Luminous);
        let floor = 20.0 * scale * scale;
        assert!((0.95..1.05).contains(&(power(&job) / (500.0 * floor))), "{}", power(&job));
        let note = &job.scene.notes()[0];
        assert!(note.contains(": nothing in the file emits, so 1 assumed lamp shines"), "{note}");
        job.build_scene().unwrap();
        // Each remedy, as it is typed by `--light default=1000lm`, `--sky=10000` and `--set import.unit`.
        let by_hand = read(&folder, &["light=luminous", "import.material.default.power=1000"]);
        assert!(
            (power(&by_hand) - 1000.0).abs() < 1e-9
                && !by_hand.scene.notes().iter().any(|note| note.contains("nothing"))
        );
        let sky = read(&folder, &["import.sky=10000"]);
        assert_eq!(sky.scene.spec().surfaces.last().unwrap().emittance, 10_000.0.into());
        let unit = job.scene.likely_unit().unwrap_or(1.0);
        assert_eq!(unit, 1.0 / scale);
        let metres = read(&folder, &[&format!("import.unit={unit}")]);
        let [low, high] = metres.scene.bounds();
        assert!((high[2] - low[2] - 2.5).abs() < 1e-9 && metres.scene.likely_unit().is_none());
    }
}

#[test]
fn what_opens_to_a_sky_is_lit_by_it() {
    let folder = Folder::new("open");
    folder.write("room.obj", room(1.0).replace("f 3 4 8 7\n", "f 3 4 4\n"));
    let job = read(&folder, &[]);
    assert!(job.scene.notes()[0].contains("a uniform sky of 10000 lm/m² does"), "{:?}", job.scene.notes());
    assert_eq!(job.scene.spec().surfaces.last().unwrap().name.as_deref(), Some("sky"));
    // Strict reading assumes nothing: then no walk could start.
    let strict = read(&folder, &["import.strict=true"]);
    assert!(strict.build_scene().unwrap_err().to_string().contains("no emitter"));
}

/// A lamp hangs within the sky wherever it is; light from far away comes through it, as bright on the plane across its aim as is written.
#[test]
fn lamps_are_below_the_sky() {
    let folder = Folder::new("below");
    let sun = "[[lamp]]\nilluminance = 900.0\ndiameter = 120\naim = [0, 0, -1]\n";
    let scene = "[material.a]\nreflectance = 0.5\n[[surface]]\nmaterial = \"a\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\n\
                 [[lamp]]\nposition = [0.5, 0.5, 5]\nintensity = 10.0\n[sky]\nemittance = 1.0\n";
    folder.write("scene.toml", format!("{scene}{sun}"));
    let scene = job::load_scene(&folder.path().join("scene.toml")).unwrap();
    let sky = scene.spec().surfaces.iter().filter(|surface| surface.name.as_deref() == Some("sky"));
    let top = sky.flat_map(|side| side.shape.corners()).map(|corner| corner.z).fold(0.0, f64::max);
    assert!(top > 5.0, "{top}");
    let strength = scene.spec().lamps.list[1].strength[0];
    assert!((strength - 900.0 / 0.75).abs() < 1e-9, "{strength}");
}

#[test]
fn names_of_lamps_shine_and_parts_can_be_named() {
    let folder = Folder::new("named");
    let lamp = "v 2 2.49 2\nv 2.5 2.49 2\nv 2.5 2.49 2.5\nusemtl Ceiling_Light.001\nf 9 10 11\n";
    folder.write("room.obj", format!("{}{lamp}", room(1.0)));
    let job = read(&folder, &[]);
    assert!((power(&job) / (500.0 * 20.0) - 1.0).abs() < 1e-9, "{}", power(&job));
    let last = job.scene.spec().surfaces.last().unwrap();
    // Its front faces the ceiling or the room: the sheet shines into the room.
    let (_, u, v) = last.shape.edges();
    assert!(last.sides == Sides::Front && u.cross(v).z < 0.0 && last.emittance.is_lit());
    let notes = job.scene.notes().join("\n");
    assert!(
        notes.contains("\"Ceiling_Light.001\"")
            && notes.contains("lamps shine to one side: 1 of their faces, 1 into the room"),
        "{notes}"
    );
    // The remedies: both sides, another power, and a part in place of a material.
    let both = read(&folder, &["import.material.\"Ceiling_Light.001\".sides=2"]);
    assert_eq!(both.scene.spec().surfaces.last().unwrap().sides, Sides::Both);
    let part = read(&folder, &["light=luminous", "import.material.\"Ceiling\".power=1000"]);
    assert!((power(&part) - 1000.0).abs() < 1e-9);
    // A power is of the one side that is found.
    let typed = read(&folder, &["import.material.\"Ceiling_Light.001\".power=700"]);
    assert!((power(&typed) - 700.0).abs() < 1e-9, "{}", power(&typed));
}

/// Lamps by name send 500 lm for each square metre of floor in any unit, from one side or two, also of faces that are written front and
/// back.
#[test]
fn lamps_by_name_send_what_the_note_says() {
    let folder = Folder::new("named-power");
    let corners = "v 2 2.49 2\nv 2.5 2.49 2\nv 2.5 2.49 2.5\nusemtl Ceiling_Light.001\n";
    for scale in [1.0, 100.0] {
        folder.write("room.obj", format!("{}{}f 9 10 11\nf 9 11 10\n", room(1.0), corners));
        let unit = format!("import.unit={}", 1.0 / scale);
        for set in [&[&*unit][..], &[&*unit, "import.material.\"Ceiling_Light.001\".sides=2"]] {
            let job = read(&folder, set);
            let floor = 20.0 / (scale * scale);
            assert!((power(&job) / (500.0 * floor) - 1.0).abs() < 1e-9, "{set:?}: {}", power(&job));
            let notes = job.scene.notes().join("\n");
            let area = 0.125 / (scale * scale);
            let sides = job.scene.spec().surfaces.last().unwrap().sides.count();
            assert!(notes.contains(&format!("with {:.0} lm/m²", 500.0 * floor / area / sides)), "{notes}");
        }
    }
}

#[test]
fn keys_of_import_are_refused_where_there_is_no_mesh() {
    let folder = Folder::new("no-mesh");
    let scene =
        "[material.m]\nemittance = 1\n[[surface]]\nmaterial = \"m\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\n";
    let path = folder.write("s.toml", scene);
    let refused = load(&path, &["import.unit=0.01".into()]).unwrap_err().to_string();
    assert!(refused.contains("import.unit: the scene has no mesh"), "{refused}");
    load(&path, &["import.repair=true".into()]).unwrap();
}

#[test]
fn a_table_of_materials_has_all_areas() {
    let folder = Folder::new("table");
    folder.write("room.obj", room(1.0));
    let rows = read(&folder, &["import.material.Ceiling.reflectance=0.8"]).scene.materials();
    let emitters: Vec<(&str, f64, f64)> =
        rows.iter().map(|row| (&*row.name, row.area, row.reflectance[0])).collect();
    assert_eq!(emitters[0], ("default", 65.0, 0.5));
    assert_eq!(emitters[1], ("Ceiling", 20.0, 0.8));
}

/// A lamp of an OBJ file shines to one side where a scene names the file, too; a material that no mesh has is refused.
#[test]
fn lamps_of_meshes_in_scenes_shine_to_one_side() {
    let folder = Folder::new("named-mesh");
    let lamp = "v 2 2.49 2\nv 2.5 2.49 2\nv 2.5 2.49 2.5\nusemtl lamp\nf 9 10 11\n";
    folder.write("room.obj", format!("mtllib room.mtl\n{}{lamp}", room(1.0)));
    folder.write("room.mtl", "newmtl lamp\nKd 0 0 0\nKe 5 5 5\n");
    folder.write("scene.toml", "[[mesh]]\nfile = \"room.obj\"\n");
    let scene = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
        load(&folder.path().join("scene.toml"), &set)
    };
    let [alone, named] = [read(&folder, &[]), scene(&[]).unwrap()];
    assert_eq!(named.scene.spec().surfaces.last().unwrap().sides, Sides::Front);
    assert_eq!(power(&alone), power(&named));
    let both = scene(&["import.material.lamp.sides=2"]).unwrap();
    assert_eq!(power(&both), 2.0 * power(&named));
    let unknown = scene(&["import.material.lump.sides=2"]).unwrap_err().to_string();
    assert!(unknown.contains("import.material.\"lump\": no mesh has such a material"), "{unknown}");
}

/// The corners of a box from `low` to `high` and its 12 triangles, whose fronts look outwards.
fn cuboid(low: [f32; 3], high: [f32; 3]) -> (Vec<[f32; 3]>, Vec<[u16; 3]>) {
    let corner =
        |i: usize| std::array::from_fn(|axis| if i >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

/// A glTF file of a room, which emits nothing, and of what is in it: a lamp of faces of which the file says that they are two-sided.
fn gltf(folder: &Folder, lamp: (Vec<[f32; 3]>, Vec<[u16; 3]>)) -> Job {
    let room = cuboid([0.0; 3], [4.0, 3.0, 5.0]);
    let (mut bytes, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    for (corners, triangles) in [room, lamp] {
        for (content, kind, component, count) in [
            (
                corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>(),
                "VEC3",
                5126,
                corners.len(),
            ),
            (
                triangles.iter().flatten().flat_map(|x| x.to_le_bytes()).collect(),
                "SCALAR",
                5123,
                3 * triangles.len(),
            ),
        ] {
            views.push(format!(
                r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
                bytes.len(),
                content.len()
            ));
            let bounds = if kind == "VEC3" { r#","min":[0,0,0],"max":[5,5,5]"# } else { "" };
            accessors.push(format!(
                r#"{{"bufferView":{},"componentType":{component},"count":{count},"type":"{kind}"{bounds}}}"#,
                views.len() - 1
            ));
            bytes.extend(content);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        }
    }
    let mesh = |i: usize| {
        format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{}}},"indices":{},"material":{i}}}]}}"#,
            2 * i,
            2 * i + 1
        )
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0}},{{"mesh":1}}],
        "meshes":[{},{}],"materials":[{{"name":"wall","doubleSided":true}},
        {{"name":"bulb","doubleSided":true,"emissiveFactor":[1,1,1]}}],
        "buffers":[{{"uri":"a.bin","byteLength":{}}}],"bufferViews":[{}],"accessors":[{}]}}"#,
        mesh(0),
        mesh(1),
        bytes.len(),
        views.join(","),
        accessors.join(",")
    );
    folder.write("a.bin", bytes);
    load(&folder.write("a.gltf", json), &[]).unwrap()
}

/// Exporters say of nearly every material that both sides are active. The inside of a closed lamp keeps its light to itself: its outside shines alone, whichever way
/// its faces are turned. A sheet of such a material shines to both sides.
#[test]
fn closed_lamps_of_two_sided_faces_shine_outwards() {
    let folder = Folder::new("shells");
    let (corners, triangles) = cuboid([2.0, 1.5, 2.5], [2.2, 1.7, 2.7]);
    let inside_out = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect::<Vec<_>>();
    for (number, triangles) in [triangles.clone(), inside_out].into_iter().enumerate() {
        let job = gltf(&folder, (corners.clone(), triangles));
        let lamps: Vec<_> =
            job.scene.spec().surfaces.iter().filter(|surface| surface.emittance.is_lit()).collect();
        assert_eq!(lamps.len(), 6, "two triangles a side");
        // Of the file's axes, y is up: x, −z, y.
        let middle = glam::DVec3::new(2.1, -2.6, 1.6);
        for lamp in lamps {
            let (corner, u, v) = lamp.shape.edges();
            assert!(
                lamp.sides == Sides::Front && u.cross(v).dot(corner - middle) > 0.0,
                "{number}: {lamp:?}"
            );
        }
        let notes = job.scene.notes().join("\n");
        assert!(notes.contains("lamps shine to one side: 6 of their faces, 6 into the room"), "{notes}");
    }
    let sheet = gltf(&folder, (corners, vec![triangles[0]]));
    assert_eq!(sheet.scene.spec().surfaces.last().unwrap().sides, Sides::Both);
}
