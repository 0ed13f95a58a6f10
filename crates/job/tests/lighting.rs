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
