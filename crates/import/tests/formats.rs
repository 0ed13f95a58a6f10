//! Tests of the readers of each format.

use std::io;
use std::path::Path;

use glam::DVec3;
use import::{
    Error, Files, Format, Imported, LostProperty, MaterialOverride, Mesh, Options, SidesChoice, UpAxis,
};
use radiosity::{Shape, Sides, Spectrum, lamps::Emission};

fn read(path: &str, content: &[u8]) -> Result<Mesh, Error> {
    let mut none = |_: &Path| Err(io::Error::from(io::ErrorKind::NotFound));
    let format = Format::of(Path::new(path)).unwrap();
    import::read(Path::new(path), content, format, 0.0125, &mut Files::new(&mut none))
}

fn scene(path: &str, content: &[u8], options: &Options) -> Result<Imported, Error> {
    read(path, content)?.into_scene(Path::new(path), Format::of(Path::new(path)).unwrap(), options)
}

fn corpus(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(path)).unwrap()
}

fn area(scene: &Imported) -> f64 {
    scene.spec.surfaces.iter().map(|surface| surface.shape.area()).sum()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// A square of two triangles of the material `white`, a degenerate one, and the first triangle again.
fn faulty() -> String {
    format!("{SQUARE}usemtl white\no square\nf 1 2 3\nf 1 3 4\nf 1 2 2\nf 3 1 2\n")
}

#[test]
fn every_kept_file_is_read() {
    for (path, triangles) in [
        ("stl/ascii.stl", 1),
        ("stl/binary.stl", 2),
        ("ply/ascii.ply", 3),
        ("ply/little.ply", 3),
        ("ply/big.ply", 3),
        ("gltf/two.glb", 4),
        ("gltf/two.gltf", 4),
        ("gltf/exported.gltf", 12),
        ("gltf/packed.glb", 12),
        ("gltf/packed-in-sequence.glb", 12),
    ] {
        assert_eq!(read(path, &corpus(path)).unwrap().triangles.len(), triangles, "{path}");
    }
    let mesh = read("all.mgf", &corpus("mgf/all.mgf")).unwrap();
    assert_eq!(
        mesh.materials.iter().map(|material| &material.name[..]).collect::<Vec<_>>(),
        ["wall", "lamp"]
    );
    assert!(mesh.parts.contains(&"room/inner".to_owned()), "{:?}", mesh.parts);
}

#[test]
fn ply_of_all_encodings_says_the_same() {
    let [ascii, little, big] =
        ["ply/ascii.ply", "ply/little.ply", "ply/big.ply"].map(|path| read("a.ply", &corpus(path)).unwrap());
    assert_eq!(little, big);
    assert_eq!(ascii.positions, little.positions);
    assert_eq!(ascii.triangles, little.triangles);
}

/// Squares are two triangles of one part; emissivities are what reflectances leave, and one is one material.
#[test]
fn view3d_has_surfaces_with_emissivities() {
    let mesh = read("a.vs3", &corpus("vs3/obstructed.vs3")).unwrap();
    assert_eq!(mesh.parts, ["floor", "roof", "tip", "back"]);
    let faces: Vec<(u32, u32)> = mesh.triangles.iter().map(|face| (face.part, face.material)).collect();
    assert_eq!(faces, [(0, 0), (0, 0), (1, 1), (1, 1), (2, 0), (3, 2)]);
    assert_eq!(mesh.triangles[1].corners, [0, 2, 3]);
    assert_eq!(mesh.positions[10].to_array(), [0.5, 0.5, 0.5]);
    let emissivities = mesh.materials.iter().map(|material| 1.0 - material.reflectance.channels()[0]);
    for (found, written) in emissivities.zip([0.5, 0.9, 0.999]) {
        assert!((found - written).abs() < 1e-15);
    }
    assert!(mesh.materials.iter().all(|material| material.sides == Some(radiosity::Sides::Front)));
}

/// A surface that is combined with another is of its face, whose emissivities may differ; one without a name is called by its number.
#[test]
fn view3d_combines_surfaces() {
    let vertices = "V 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\n";
    let surfaces = "S 1 1 2 3 0 0 0 0.5 wall\nS 2 1 3 4 0 0 1 0.9 other\nS 3 4 3 2 1 0 0 0.5\nS 4 1 2 3 0 0 2 0.5 third\n";
    let mesh = read("a.vs3", format!("{vertices}{surfaces}").as_bytes()).unwrap();
    assert_eq!(mesh.parts, ["wall", "surface 3"]);
    let faces = mesh.triangles.iter().map(|face| (face.part, face.face, face.material));
    assert_eq!(faces.collect::<Vec<_>>(), [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 0), (0, 0, 0)]);
}

/// The first letter tells what a line is, what follows the end is not read, and what obstructs needs no more than corners.
#[test]
fn view3d_lines_are_told_by_their_first_letter() {
    let vertices = "V 1 0 0 0\nVertex 2 1 0 0\nV 3 1 1 0\nV 4 .8 .2 0\n! a remark \\\n";
    let surfaces = "Srf 1 1 2 3 0 0 0 0.0 ! no name\nO 2 1 2 3 4\n*\nS 3 1 2 3 0 0 0 0.5 late\n";
    let mesh = read("a.vs3", format!("{vertices}{surfaces}").as_bytes()).unwrap();
    assert_eq!(mesh.parts, ["surface 1", "obstruction 2"]);
    let emissivities = mesh.materials.iter().map(|material| 1.0 - material.reflectance.channels()[0]);
    emissivities.zip([0.001, 1.0]).for_each(|(found, told)| assert!((found - told).abs() < 1e-15));
    // The arrowhead's triangles all look the same way.
    let scene = mesh.into_scene(Path::new("a.vs3"), Format::View3d, &Options::default()).unwrap();
    assert!((area(&scene) - (0.5 + 0.2)).abs() < 1e-12, "{}", area(&scene));
}

/// Grids and polygons as VTK 9.7 and meshio 5.3 write them, in every encoding: a pentagon of the facet 12, a square of facet 3, a line, and
/// a rectangle of facet 7 as two triangles or as a strip. Coordinates that were written as text or as f32 are those of the mesh.
#[test]
fn vtk_of_all_encodings_says_the_same() {
    let facets = [(3, 2), (7, 2), (12, 3)];
    let mut points = None;
    for file in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/vtk")).unwrap() {
        let path = file.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let mesh = read(name, &std::fs::read(&path).unwrap()).unwrap();
        let mut found = std::collections::BTreeMap::new();
        mesh.triangles.iter().for_each(|face| *found.entry(face.face).or_insert(0) += 1);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), facets, "{name}");
        assert_eq!(&mesh.positions, points.get_or_insert(mesh.positions.clone()), "{name}");
        assert!(mesh.triangles.is_sorted_by_key(|face| face.face), "{name}");
        let scene = mesh.into_scene(&path, Format::Vtk, &Options::default()).unwrap();
        assert!((area(&scene) - (2.5 + 2.0 + 6.0)).abs() < 1e-12, "{name}");
        assert!(scene.notes.iter().any(|note| note.contains("Facet_ID")), "{name}: {:?}", scene.notes);
        assert!(scene.notes.iter().any(|note| note.contains("points or lines, left out: 1")), "{name}");
        // The square faces up and the rectangle away from y, however the file lists their corners.
        for surface in &scene.spec.surfaces {
            let (_, u, v) = surface.shape.edges();
            let facet = surface.name.as_deref().unwrap().split(':').next_back().unwrap();
            let up = u.cross(v).normalize();
            assert!(
                (up - if facet == "7" { DVec3::NEG_Y } else { DVec3::Z }).length() < 1e-12,
                "{name}: {facet}"
            );
        }
    }
}

#[test]
fn a_glb_is_its_gltf() {
    let [glb, gltf] = ["gltf/two.glb", "gltf/two.gltf"].map(|path| read("a.glb", &corpus(path)).unwrap());
    assert_eq!(glb, gltf);
}

#[test]
fn nodes_transform_and_mirrors_keep_fronts() {
    let scene = scene(
        "a.glb",
        &corpus("gltf/two.glb"),
        &Options { up: Some(import::UpAxis::Z), ..Options::default() },
    );
    let scene = scene.unwrap();
    assert_eq!(scene.spec.surfaces[0].name.as_deref(), Some("Floor:0"));
    assert_eq!(scene.spec.surfaces[2].name.as_deref(), Some("Lamp:0"));
    for surface in &scene.spec.surfaces[2..] {
        let (corner, u, v) = surface.shape.edges();
        assert!(u.cross(v).z > 0.0 && (corner.z - 3.0).abs() < 1e-12);
    }
    // Seen from above, a mirrored node turns the other way; its front stays where it was.
    let (_, u, v) = scene.spec.surfaces[1].shape.edges();
    assert!(u.cross(v).z > 0.0);
    let grey = scene.spec.surfaces[0].reflectance.channels();
    assert_eq!(grey, [0.5, 0.4, 0.3].map(|channel| channel * 0.75));
    assert_eq!(scene.spec.surfaces[2].emittance, 12.5.into());
    assert_eq!([0, 2].map(|i| scene.spec.surfaces[i].sides), [Sides::Both, Sides::Front]);
}

#[test]
fn sides_are_two_where_the_file_does_not_say() {
    let obj = format!("{SQUARE}f 1 2 3 4\n");
    let sides = |sides| scene("a.obj", obj.as_bytes(), &Options { sides, ..Options::default() }).unwrap();
    assert_eq!(sides(SidesChoice::File).spec.surfaces[0].sides, Sides::Both);
    assert_eq!(sides(SidesChoice::One).spec.surfaces[0].sides, Sides::Front);
}

#[test]
fn faulty_faces_are_left_out_and_reported_or_refused() {
    let report = scene("a.obj", faulty().as_bytes(), &Options::default()).unwrap();
    assert_eq!(report.spec.surfaces.len(), 2);
    assert!(
        report.notes.iter().any(|note| note.contains("1 triangles have no area: square:2")),
        "{report:?}"
    );
    assert!(report.notes.iter().any(|note| note.contains("1 triangles cover another one: square:3")));
    let options = Options { faults: import::Faults::Refuse, ..Options::default() };
    let refused = scene("a.obj", faulty().as_bytes(), &options).unwrap_err().to_string();
    assert!(refused.contains("square:2") && refused.contains("square:3"), "{refused}");
}

#[test]
fn one_sided_faces_back_to_back_are_no_doubles() {
    let obj = format!("{SQUARE}f 1 2 3\nf 3 2 1\n");
    let count = |sides| {
        let options = Options { sides, ..Options::default() };
        scene("a.obj", obj.as_bytes(), &options).unwrap().spec.surfaces.len()
    };
    assert_eq!((count(SidesChoice::One), count(SidesChoice::Two)), (2, 1));
}

/// A triangle is a double where earlier ones have all of its sides, whatever the numbers of their vertices and the order of their
/// corners. Materials: `front` has one side, `sheet` two.
#[test]
fn doubles_have_all_of_their_sides_already() {
    let vertices = "v a =\np 0 0 0\nv b =\np 1 0 0\nv c =\np 0 1 0\nm front =\nsides 1\nm sheet =\nsides 2\n";
    let kept = |faces: &[&str]| {
        let faces: String = faces.iter().map(|face| format!("m {face}\n")).collect();
        scene("a.mgf", format!("{vertices}{faces}").as_bytes(), &Options::default())
            .unwrap()
            .spec
            .surfaces
            .len()
    };
    for front in ["front\nf a b c", "front\nf a c b", "front\nf c b a", "front\nf b c a"] {
        for sheet in ["sheet\nf a b c", "sheet\nf c b a"] {
            assert_eq!((kept(&[front, sheet]), kept(&[sheet, front])), (2, 1), "{front:?} {sheet:?}");
            assert_eq!(kept(&["front\nf a b c", "front\nf c b a", sheet, front]), 2, "{front:?} {sheet:?}");
        }
    }
}

/// Of faces at one place the one that emits is kept, wherever the file has it; what is left out with a double is told.
#[test]
fn lamps_are_kept_before_what_covers_them() {
    let vertices = "v a =\np 0 0 0\nv b =\np 2 0 0\nv c =\np 0 1 0\nm wall =\nrd .5\nsides 2\n";
    let lamp = |name: &str, emitted: u32| format!("m {name} =\ned {emitted}\nsides 1\nm {name}\nf a b c\n");
    let read =
        |faces: &str| scene("a.mgf", format!("{vertices}{faces}").as_bytes(), &Options::default()).unwrap();
    let wall = "m wall\nf a b c\n";
    let sheet = lamp("lamp", 7).replace("sides 1", "sides 2");
    for faces in [format!("{wall}{sheet}"), format!("{sheet}{wall}")] {
        let kept = read(&faces);
        assert_eq!(kept.spec.surfaces.len(), 1, "{:?}", kept.notes);
        assert!(kept.spec.surfaces[0].emittance.is_lit(), "{:?}", kept.notes);
        assert!(!kept.notes.iter().any(|note| note.contains("that they emit")), "{:?}", kept.notes);
    }
    let both = read(&format!("{wall}{}{}", lamp("lamp", 7), lamp("second", 5)));
    assert!(
        both.notes.iter().any(|note| note.contains("1 triangles cover another one")
            && note.contains("with them 5.000 W or lm that they emit")),
        "{:?}",
        both.notes
    );
}

#[test]
fn patch_sizes_and_joining() {
    let obj = format!("{SQUARE}f 1 2 3 4\n");
    let cut = |options| scene("a.obj", obj.as_bytes(), &options).unwrap().spec.surfaces;
    let halves = cut(Options { patch_size: Some(0.5), ..Options::default() });
    assert!(halves.iter().all(|surface| surface.shape.cell_count() == 9), "the diagonal is 1.41 m");
    let joined = cut(Options { join: true, patch_size: Some(0.5), ..Options::default() });
    assert!(matches!(joined[0].shape, Shape::Parallelogram { cells: [2, 2], .. }) && joined.len() == 1);
    assert!((joined[0].shape.area() - 1.0).abs() < 1e-15);
    let small = cut(Options { max_patch_area: Some(0.02), ..Options::default() });
    assert!(small.iter().all(|surface| surface.shape.cell_count() == 25));
}

/// A square whose vertices are red, or between red and yellow: their mean multiplies what the material reflects.
#[test]
fn colours_of_vertices_multiply_those_of_materials() {
    let mesh = read("gltf/colours.gltf", &corpus("gltf/colours.gltf")).unwrap();
    let [red, green, blue] = mesh.materials[0].reflectance.channels();
    assert!((red - 0.8).abs() < 1e-12 && blue == 0.0, "{:?}", mesh.materials);
    assert!((green - 0.5 * 64.0 / 255.0).abs() < 1e-12, "{:?}", mesh.materials);
    assert_eq!(mesh.materials[0].texture.as_deref(), Some("colours of vertices"));
}

/// Names of cells beside the geometry, as lines and as counted bytes, one of them longer than a byte counts.
#[test]
fn strings_of_vtk_are_passed_over() {
    let head =
        |kind: &str| format!("# vtk DataFile Version 5.1\nnames\n{kind}\nDATASET POLYDATA\nPOINTS 3 float\n");
    let rest = "POLYGONS 1 4\n";
    let fields = "CELL_DATA 1\nFIELD FieldData 2\nnames 1 2 string\n";
    let text =
        format!("{}0 0 0 1 0 0 0 1 0\n{rest}3 0 1 2\n{fields}sky\n\nfacet_id 1 1 int\n7\n", head("ASCII"));
    let mut bytes = head("BINARY").into_bytes();
    bytes.extend([0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_be_bytes()));
    bytes.extend(format!("\n{rest}").bytes());
    bytes.extend([3_u32, 0, 1, 2].iter().flat_map(|x| x.to_be_bytes()));
    bytes.extend(format!("\n{fields}").bytes());
    bytes.extend(b"\xC3sky\x80\x46".iter().chain(&[b'x'; 70]));
    bytes.extend(b"\nfacet_id 1 1 int\n\0\0\0\x07\n");
    for content in [text.into_bytes(), bytes] {
        assert_eq!(read("a.vtk", &content).unwrap().triangles.len(), 1);
    }
}

/// A room in millimetres is four kilometres long: a note says so and offers the unit, unless one is set.
#[test]
fn the_likely_unit_is_reported_and_offered() {
    let obj = "v 0 0 0\nv 4000 0 0\nv 0 3000 0\nf 1 2 3\n";
    let is_noted = |unit: f64| {
        let options = Options { unit, ..Options::default() };
        let imported = scene("a.obj", obj.as_bytes(), &options).unwrap();
        let note = imported.notes.iter().any(|note| note.ends_with("; --set import.unit=0.001"));
        assert_eq!(imported.likely_unit.is_some(), note, "{:?}", imported.notes);
        note
    };
    assert!(is_noted(1.0) && !is_noted(0.001));
}

/// Floor and ceiling of an OBJ room whose third axis points up face sideways where the second one is taken for it: a note says so, unless an axis is set.
#[test]
fn a_room_on_its_side_is_noted() {
    let noted = |name: &str, [x, y, z]: [f64; 3], up: Option<UpAxis>| {
        let corner =
            |i: usize| [(i & 1, x), (i >> 1 & 1, y), (i >> 2 & 1, z)].map(|(on, size)| on as f64 * size);
        let corners: String = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        let obj = corners + "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
        let imported = scene(name, obj.as_bytes(), &Options { up, ..Options::default() }).unwrap();
        imported.notes.iter().any(|note| note.contains("; --set import.up=z stands it upright"))
    };
    assert!(noted("lying.obj", [6.0, 5.0, 2.7], None));
    assert!(!noted("lying.obj", [6.0, 5.0, 2.7], Some(UpAxis::Y)));
    assert!(!noted("upright.obj", [6.0, 2.7, 5.0], None) && !noted("wall.obj", [6.0, 3.0, 0.2], None));
}

/// Editors on Windows put a byte order mark before the first statement.
#[test]
fn marks_of_byte_order_are_no_part_of_the_text() {
    let marked = |content: &[u8]| [b"\xEF\xBB\xBF", content].concat();
    let kept = ["obj/room.obj", "mgf/all.mgf", "stl/ascii.stl", "ply/ascii.ply", "gltf/two.gltf"];
    for path in kept {
        assert_eq!(read(path, &marked(&corpus(path))), read(path, &corpus(path)), "{path}");
    }
}

#[test]
fn units_and_axes() {
    let options = Options { unit: 0.01, ..Options::default() };
    let scene = scene("a.obj", format!("{SQUARE}f 1 2 3 4\n").as_bytes(), &options).unwrap();
    assert!((area(&scene) - 1e-4).abs() < 1e-18);
    let (_, u, v) = scene.spec.surfaces[0].shape.edges();
    assert!(u.cross(v).y < 0.0, "OBJ's y is up: its z points to −y");
}

#[test]
fn overrides_apply_in_order_and_power_spreads() {
    let over = |pattern: &str| MaterialOverride::of(pattern);
    let materials = vec![
        MaterialOverride { reflectance: Some(0.1.into()), ..over("*") },
        MaterialOverride { reflectance: Some(0.2.into()), power: Some(6.0.into()), ..over("wh*") },
    ];
    let obj = format!("{SQUARE}usemtl white\nf 1 2 3 4\n");
    let options = Options { materials, ..Options::default() };
    let lit = scene("a.obj", obj.as_bytes(), &options).unwrap();
    // 6 W leave both sides of 1 m².
    assert_eq!((lit.spec.surfaces[0].reflectance, lit.spec.surfaces[1].emittance), (0.2.into(), 3.0.into()));
    let options = Options { materials: vec![over("lamp")], ..Options::default() };
    let refused = scene("a.obj", obj.as_bytes(), &options).unwrap_err().to_string();
    assert!(refused.contains("matches no material") && refused.contains("white"), "{refused}");
}

/// An entry that names no material may name an object, which gets a material of its own; one may leave faces out.
#[test]
fn overrides_reach_parts_and_leave_out() {
    let obj = format!("{SQUARE}usemtl white\no wall\nf 1 2 3\no Lamp.001\nf 1 3 4\n");
    let with = |entry: MaterialOverride| {
        let options = Options { materials: vec![entry], ..Options::default() };
        scene("a.obj", obj.as_bytes(), &options)
    };
    let lit =
        with(MaterialOverride { emittance: Some(7.0.into()), ..MaterialOverride::of("Lamp*") }).unwrap();
    let emitted: Vec<f64> = lit.spec.surfaces.iter().map(|surface| surface.emittance[0]).collect();
    assert_eq!((emitted, &lit.names[lit.materials[1] as usize][..]), (vec![0.0, 7.0], "Lamp.001"));
    let without = with(MaterialOverride { leave_out: Some(true), ..MaterialOverride::of("wall") }).unwrap();
    assert_eq!(without.spec.surfaces.len(), 1);
    let none = with(MaterialOverride { leave_out: Some(true), ..MaterialOverride::of("white") });
    assert!(none.unwrap_err().to_string().contains("every face is left out"));
}

/// An entry for one object leaves it to later entries for several, which win; what they say of light counts as well.
#[test]
fn overrides_of_parts_apply_in_order() {
    let obj = format!("{SQUARE}usemtl white\no Desk1\nf 1 2 3\no Desk2\nf 1 3 4\n");
    let options = |last: f64| {
        let of_one = MaterialOverride {
            emittance: Some(7.0.into()),
            sides: Some(SidesChoice::One),
            ..MaterialOverride::of("Desk1")
        };
        let of_all = MaterialOverride { emittance: Some(last.into()), ..MaterialOverride::of("Desk*") };
        Options { materials: vec![of_one, of_all], ..Options::default() }
    };
    let imported = scene("a.obj", obj.as_bytes(), &options(3.0)).unwrap();
    let found: Vec<(Sides, f64)> =
        imported.spec.surfaces.iter().map(|surface| (surface.sides, surface.emittance[0])).collect();
    assert_eq!(found, [(Sides::Front, 3.0), (Sides::Both, 3.0)]);
    let mesh = read("a.obj", obj.as_bytes()).unwrap();
    assert!(mesh.is_lit(&options(3.0)) && !mesh.is_lit(&options(0.0)));
}

/// Light passes clear faces: they are left out with a note, unless an option makes surfaces of them or nothing else is there.
#[test]
fn light_passes_clear_faces() {
    let points = "v a =\np 0 0 0\nv b =\np 1 0 0\nv c =\np 0 1 0\nv d =\np 0 0 1\n";
    let wall = "m wall =\nrd .5\nf a b c\n";
    let pane = |part: &str| format!("m pane =\nrd .1\nts {part} 0\nf a b d\n");
    let faces = |text: &str, entry: Option<MaterialOverride>| {
        let options = Options { materials: entry.into_iter().collect(), ..Options::default() };
        let read = scene("a.mgf", format!("{points}{text}").as_bytes(), &options).unwrap();
        (read.spec.surfaces.len(), read.notes.join("; "))
    };
    let both = |part| format!("{wall}{}", pane(part));
    let (count, notes) = faces(&both(".9"), None);
    let remedy = "--set 'import.material.\"pane\".leave_out=false' makes it a surface";
    assert!(count == 1 && notes.contains("clear, so that light passes") && notes.contains(remedy), "{notes}");
    let (count, notes) = faces(&both(".4"), None);
    assert!(count == 2 && notes.contains("transparent, and modelled as solid"), "{notes}");
    let of_pane = || MaterialOverride::of("pane");
    for kept in [
        MaterialOverride { leave_out: Some(false), ..of_pane() },
        MaterialOverride { reflectance: Some(0.3.into()), ..of_pane() },
        MaterialOverride { emittance: Some(3.0.into()), ..of_pane() },
    ] {
        let (count, notes) = faces(&both(".9"), Some(kept));
        assert!(count == 2 && !notes.contains("clear, so"), "{notes}");
    }
    assert_eq!(faces(&pane(".9"), None).0, 1, "nothing but glass");
}

/// A file of a thousand materials is refused in a message that people can read.
#[test]
fn a_pattern_that_matches_nothing_names_a_few_materials() {
    let uses: String = (0..1000).map(|i| format!("usemtl material.{i}\nf 1 2 3\n")).collect();
    let options = Options { materials: vec![MaterialOverride::of("no such")], ..Options::default() };
    let refused = scene("a.obj", format!("{SQUARE}{uses}").as_bytes(), &options).unwrap_err().to_string();
    assert!(refused.contains("and 992 more") && refused.len() < 400, "{refused}");
}

/// A PNG image of 2 × 1 texels: levels 188 and 0, in linear light 0.5029 and 0.
fn image_of_two() -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    let image = image::GrayImage::from_raw(2, 1, vec![188, 0]).unwrap();
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

/// A square whose left three quarters show the light texel: two quads, of which the second shows the border between the two.
const TEXTURED: &str = "mtllib a.mtl\nusemtl wood\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
    vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0\nvt 1 1\nvt 0.25 0\nvt 0.25 1\nvt 0.75 0\nvt 0.75 1\n\
    f 1/1 2/2 3/3 4/4\nf 2/7 5/9 6/10 3/8\n";

#[test]
fn textures_give_the_mean_of_what_faces_show_of_them() {
    let material = |mtl: &str, png: bool| {
        let mut files = |path: &Path| match path.to_str() {
            Some("rooms/a.mtl") => Ok(format!("newmtl wood\n{mtl}").into_bytes()),
            Some("rooms/my wood.png") if png => Ok(image_of_two()),
            _ => Err(io::Error::from(io::ErrorKind::NotFound)),
        };
        let path = Path::new("rooms/a.obj");
        let mesh = import::read(path, TEXTURED.as_bytes(), Format::Obj, 0.0125, &mut Files::new(&mut files));
        mesh.unwrap().materials[0].clone()
    };
    let light = ((188.0_f64 / 255.0 + 0.055) / 1.055).powf(2.4);
    let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 2e-3;
    // The path is of another machine: the image is found beside the library. Half of the first quad's part is seen twice.
    let white = material("Kd 1 1 1\nmap_Kd -s 1 1 1 C:\\tex\\my wood.png\n", true);
    assert!(near(white.reflectance[0], 0.75 * light), "{white:?}");
    assert_eq!(white.texture.as_deref(), Some("C:\\tex\\my wood.png"));
    let tinted = material("Kd 0.5 0.25 1\nmap_Kd my wood.png\n", true);
    assert!(near(tinted.reflectance[1], 0.25 * 0.75 * light), "{tinted:?}");
    let black = material("Kd 0 0 0\nmap_Kd my wood.png\n", true);
    assert!(near(black.reflectance[0], 0.75 * light), "a black colour stands for its texture: {black:?}");
    // Beyond its edges the image repeats, or its last texel goes on.
    for (options, lit) in
        [("-o 0.5", 0.25), ("-o 0.5 -clamp off", 0.25), ("-o 0.5 -clamp on", 0.0), ("-s 2 1 -clamp on", 0.25)]
    {
        let placed = material(&format!("Kd 1 1 1\nmap_Kd {options} my wood.png\n"), true);
        assert!((placed.reflectance[0] - lit * light).abs() < 1e-3, "{options}: {placed:?}");
    }
    let lamp = material("Ke 8 8 8\nmap_Ke my wood.png\n", true);
    assert!(near(lamp.emittance[0], 8.0 * 0.75 * light), "{lamp:?}");
    let missing = material("Kd 0.5 0.5 0.5\nmap_Kd my wood.png\n", false);
    assert_eq!((missing.reflectance, &missing.lost[..]), (0.5.into(), &[LostProperty::Texture][..]));
}

/// The channels of glTF's material and what it loses. Of the image `a.png`, texture 0, one texel has the levels 255, 188 and 51, in linear
/// light 1, 0.5029 and 0.0331; the other one is black. The image of texture 1 is not there. The samplers of textures 2 and 3 clamp and mirror.
fn gltf_paint(material: &str) -> ([f64; 3], Vec<LostProperty>) {
    let textures = r#""images":[{"uri":"a.png"},{"uri":"b.png"}],"samplers":[{"wrapS":33071},{"wrapS":33648}],
        "textures":[{"source":0},{"source":1},{"source":0,"sampler":0},{"source":0,"sampler":1}]"#;
    let gltf = triangle_gltf(
        r#","material":0"#,
        r#","bufferView":0"#,
        &format!(
            r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}],{textures},"materials":[{{{material}}}]"#
        ),
    );
    let mut files = |path: &Path| match path.to_str() {
        Some("a.png") => {
            let mut png = std::io::Cursor::new(Vec::new());
            let image = image::RgbImage::from_raw(2, 1, vec![255, 188, 51, 0, 0, 0]).unwrap();
            image.write_to(&mut png, image::ImageFormat::Png).unwrap();
            Ok(png.into_inner())
        }
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let path = Path::new("a.gltf");
    let mesh = import::read(path, gltf.as_bytes(), Format::Gltf, 0.0125, &mut Files::new(&mut files));
    let paint = mesh.unwrap().materials.swap_remove(0);
    (paint.reflectance.channels(), paint.lost)
}

fn assert_paint(material: &str, red: f64, lost: &[LostProperty]) {
    let (found, lost_there) = gltf_paint(material);
    assert!((found[0] - red).abs() < 1e-3 && lost_there == lost, "{material}: {found:?} {lost_there:?}");
}

/// Metal reflects nothing like paint: neither that of a factor nor that of a texture, whose blue channel is no colour. A black colour stays black.
#[test]
fn metals_keep_no_light_of_their_textures() {
    use LostProperty::{Mirror, Texture};
    let pbr = |json: &str| format!(r#""pbrMetallicRoughness":{{{json}}}"#);
    let colour = r#""baseColorTexture":{"index":0}"#;
    assert_paint(&pbr(&format!(r#""metallicFactor":1,{colour}"#)), 0.0, &[Mirror]);
    assert_paint(&pbr(&format!(r#""metallicFactor":0.25,{colour}"#)), 0.375, &[Mirror]);
    assert_paint(&pbr(&format!(r#""baseColorFactor":[0,0,0,1],{colour}"#)), 0.0, &[]);
    let metal = |n: u32| format!(r#""metallicRoughnessTexture":{{"index":{n}}}"#);
    assert_paint(&pbr(&metal(0)), 0.9, &[Mirror]);
    assert_paint(&pbr(&format!(r#""metallicFactor":0.5,{}"#, metal(0))), 0.95, &[Mirror]);
    assert_paint(&pbr(&format!(r#""metallicFactor":0,{}"#, metal(0))), 1.0, &[]);
    assert_paint(&pbr(&metal(1)), 1.0, &[Mirror]);
    assert_paint(&pbr(r#""baseColorTexture":{"index":1}"#), 1.0, &[Texture]);
}

/// What the specular colour takes is no paint's: the largest channel, times the mean of its texture.
#[test]
fn specular_colours_take_from_diffuse_ones() {
    let lost = [LostProperty::Mirror];
    let paint = |json: &str| {
        format!(
            r#""extensions":{{"KHR_materials_pbrSpecularGlossiness":{{"diffuseFactor":[0.8,0.8,0.8,1]{json}}}}}"#
        )
    };
    let texture = |n: u32| format!(r#","specularGlossinessTexture":{{"index":{n}}}"#);
    assert_paint(&paint(r#","specularFactor":[0.25,0.5,0.125]"#), 0.4, &lost);
    assert_paint(&paint(""), 0.0, &lost);
    assert_paint(&paint(&texture(0)), 0.4, &lost);
    assert_paint(&paint(&format!(r#","specularFactor":[0.5,0,0]{}"#, texture(0))), 0.6, &lost);
    assert_paint(&paint(&texture(1)), 0.8, &lost);
}

/// Of a texture, the red channel passes; one that cannot be read makes nothing clear. Coats, leaves and unlit colours are told.
#[test]
fn what_gltf_lets_through_or_leaves_unlit_is_told() {
    use LostProperty::{Clearness, Mirror, Transparency, Unlit};
    let with = |name: &str, json: &str| format!(r#""extensions":{{"KHR_materials_{name}":{{{json}}}}}"#);
    let glass = |json: &str| with("transmission", &format!(r#""transmissionFactor":0.9{json}"#));
    assert_paint(&glass(""), 1.0, &[Clearness]);
    assert_paint(&glass(r#","transmissionTexture":{"index":0}"#), 1.0, &[Transparency]);
    assert_paint(&glass(r#","transmissionTexture":{"index":1}"#), 1.0, &[Transparency]);
    assert_paint(&with("clearcoat", r#""clearcoatFactor":0.5"#), 1.0, &[Mirror]);
    assert_paint(&with("clearcoat", ""), 1.0, &[]);
    assert_paint(&with("diffuse_transmission", r#""diffuseTransmissionFactor":0.5"#), 1.0, &[Transparency]);
    assert_paint(&with("unlit", ""), 1.0, &[Unlit]);
}

/// From the middle of the image to the middle of the next one, of which the first half is dark.
#[test]
fn gltf_samplers_say_what_images_show_beyond_their_edges() {
    for (texture, scale, red) in
        [(0, 1, 0.5), (2, 1, 0.0), (3, 1, 0.0), (0, 2, 0.5), (2, 2, 0.0), (3, 2, 0.5)]
    {
        let transform = format!(r#"{{"KHR_texture_transform":{{"offset":[0.5,0],"scale":[{scale},1]}}}}"#);
        let shown = format!(r#"{{"index":{texture},"extensions":{transform}}}"#);
        let pbr = format!(r#""pbrMetallicRoughness":{{"metallicFactor":0,"baseColorTexture":{shown}}}"#);
        assert_paint(&pbr, red, &[]);
    }
}

/// A file of one triangle, with these lights and profiles, each of them at a node of its own.
fn lit_gltf(lights: &str, profiles: &str, nodes: &str) -> String {
    let extensions = format!(
        r#"{{"KHR_lights_punctual":{{"lights":[{lights}]}},"EXT_lights_ies":{{"lights":[{profiles}]}}}}"#
    );
    let gltf = triangle_gltf(
        "",
        r#","bufferView":0"#,
        &format!(r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}],"extensions":{extensions}"#),
    );
    gltf.replace(r#""nodes":[0]"#, r#""nodes":[0,1,2,3]"#)
        .replace(r#"[{"mesh":0}]"#, &format!(r#"[{{"mesh":0}},{nodes}]"#))
}

fn node(placing: &str, extension: &str, values: &str) -> String {
    format!(
        r#"{{"name":"Node","translation":[0.2,0.5,0.3],{placing}"extensions":{{"{extension}":{{{values}}}}}}}"#
    )
}

/// A lamp of 100 cd that shines all around, a red spot of 50 cd that is turned to −x, and a sun.
#[test]
fn lights_without_area_are_lamps() {
    let gltf = lit_gltf(
        r#"{"type":"point","name":"Bulb","intensity":100},
           {"type":"spot","intensity":50,"color":[1,0,0.5],"spot":{"innerConeAngle":0.2,"outerConeAngle":0.5}},
           {"type":"directional","intensity":1000}"#,
        "",
        &[
            node(r#""scale":[2,3,-4],"#, "KHR_lights_punctual", r#""light":0"#),
            node(
                r#""rotation":[0,0.7071067811865476,0,0.7071067811865476],"#,
                "KHR_lights_punctual",
                r#""light":1"#,
            ),
            node("", "KHR_lights_punctual", r#""light":2"#),
        ]
        .join(","),
    );
    // The unit changes places, and no intensity.
    for unit in [1.0, 0.01] {
        let imported = scene("a.gltf", gltf.as_bytes(), &Options { unit, ..Options::default() }).unwrap();
        assert_eq!(imported.spec.surfaces.len(), 1);
        assert!(imported.luminous);
        let [bulb, spot, sun] = &imported.spec.lamps.list[..] else { panic!("three lamps are there") };
        assert_eq!((&*bulb.name, &*spot.name), ("Bulb", "Node"));
        // y of the file is up: (x, y, z) becomes (x, −z, y).
        let place = DVec3::new(0.2, -0.3, 0.5) * unit;
        assert!(bulb.position.distance(place) < 1e-12 && spot.position.distance(place) < 1e-12);
        assert_eq!((bulb.emission, bulb.strength), (Emission::Uniform, 100.0.into()));
        let Emission::Spot { inner, outer } = spot.emission else { panic!("it is a spot") };
        assert_eq!([inner, outer], [0.2_f64.cos(), 0.5_f64.cos()]);
        assert_eq!(spot.strength, Spectrum::rgb([50.0, 0.0, 25.0]));
        assert!((-spot.axes[2]).distance(DVec3::NEG_X) < 1e-12, "{:?}", spot.axes);
        assert_eq!((sun.emission, sun.strength), (Emission::Distant { rim: 1.0 }, 1000.0.into()));
        assert!((-sun.axes[2]).distance(DVec3::Y) < 1e-12, "{:?}", sun.axes);
        let words = "lights without area, which are lamps in cd, or in lx from far away: 3";
        assert!(imported.notes.iter().any(|note| note.starts_with(words)), "{:?}", imported.notes);
    }
}

/// The emission of materials is in cd/m² beside lamps in cd, so that the exitance is π times it; alone it is taken as written.
#[test]
fn emission_beside_lamps_is_a_luminance() {
    let lit = lit_gltf(
        r#"{"type":"point"}"#,
        "",
        &vec![node("", "KHR_lights_punctual", r#""light":0"#); 3].join(","),
    )
    .replace(r#""POSITION":0}"#, r#""POSITION":0},"material":0"#)
    .replace(r#""accessors""#, r#""materials":[{"emissiveFactor":[1,0.5,0]}],"accessors""#);
    let emitted = |text: &str| read("a.gltf", text.as_bytes()).unwrap().materials[0].emittance.channels();
    let pi = std::f64::consts::PI;
    assert_eq!(emitted(&lit), [pi, 0.5 * pi, 0.0]);
    assert_eq!(emitted(&lit.replace(r#""KHR_lights_punctual":{"light":0}"#, "")), [1.0, 0.5, 0.0]);
}

/// What a mask cuts off is clear, and what it keeps is solid, whatever its alpha.
#[test]
fn masks_have_a_cutoff() {
    let lost = |cutoff: &str| {
        let gltf = triangle_gltf(
            r#","material":0"#,
            r#","bufferView":0"#,
            &format!(
                r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}],"materials":[{{"alphaMode":"MASK"{cutoff},
                "pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,0.45]}}}}]"#
            ),
        );
        read("a.gltf", gltf.as_bytes()).unwrap().materials.swap_remove(0).lost
    };
    assert_eq!(lost(r#","alphaCutoff":0.3"#), []);
    assert_eq!(lost(""), [LostProperty::Clearness], "the default is 0.5");
}

/// Of vertices that primitives share, each takes the colours of its own triangles, by area.
#[test]
fn colours_of_shared_vertices_are_those_of_the_faces() {
    // Two triangles, the second of four times the area: (0,0,0) (1,0,0) (0,1,0), red, and (0,0,2) (2,0,2) (0,2,2), white.
    let data = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAABAAAAAQAAAAAAAAABAAAAAAAAAAEAAAABA/wAA//8AAP//AAD/////////////////AAABAAIAAwAEAAUA";
    let mesh = |materials: [u32; 2]| {
        let primitive = |n: usize| {
            format!(
                r#"{{"attributes":{{"POSITION":0,"COLOR_0":1}},"indices":{},"material":{}}}"#,
                n + 2,
                materials[n]
            )
        };
        let gltf = format!(
            r#"{{"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{},{}]}}],"materials":[{{}},{{}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":6,"type":"VEC3"}},
            {{"bufferView":0,"byteOffset":72,"componentType":5121,"normalized":true,"count":6,"type":"VEC4"}},
            {{"bufferView":0,"byteOffset":96,"componentType":5123,"count":3,"type":"SCALAR"}},
            {{"bufferView":0,"byteOffset":102,"componentType":5123,"count":3,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":108}}],"buffers":[{{"byteLength":108,"uri":"{data}"}}]}}"#,
            primitive(0),
            primitive(1)
        );
        read("a.gltf", gltf.as_bytes()).unwrap()
    };
    let colours = |materials| mesh(materials).materials.into_iter().map(|of| of.reflectance.channels());
    let close = |found: [f64; 3], expected: [f64; 3]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
    };
    let apart: Vec<[f64; 3]> = colours([0, 1]).collect();
    close(apart[0], [1.0, 0.0, 0.0]);
    close(apart[1], [1.0; 3]);
    close(colours([0, 0]).next().unwrap(), [1.0, 0.8, 0.8]);
}

/// EXT_lights_ies: γ = 0 along −z of the node, C = 0 along its x; a profile that two nodes use is read once. One that is missing or
/// malformed is refused with its line.
#[test]
fn profiles_are_lamps_with_tables() {
    // "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 4 1 2 0 0 0\n1 1 10\n0 90\n0 90 180 270\n100 40\n100 10\n100 20\n100 30\n"
    let profile = "data:application/x-ies-lm-63;base64,SUVTTkE6TE0tNjMtMjAwMgpUSUxUPU5PTkUKMSAtMSAxIDIgNCAxIDIgMCAwIDAKMSAxIDEwCjAgOTAKMCA5MCAxODAgMjcwCjEwMCA0MAoxMDAgMTAKMTAwIDIwCjEwMCAzMAo=";
    let profiles = |uri: &str| format!(r#"{{"uri":"{uri}"}}"#);
    let nodes = [
        node("", "EXT_lights_ies", r#""light":0"#),
        node("", "EXT_lights_ies", r#""light":0,"multiplier":2,"color":[1,0.5,0]"#),
        node("", "KHR_lights_punctual", r#""light":0"#),
    ]
    .join(",");
    let light = r#"{"type":"point"}"#;
    let read =
        |uri: &str| scene("a.gltf", lit_gltf(light, &profiles(uri), &nodes).as_bytes(), &Options::default());
    let lamps = read(profile).unwrap().spec.lamps;
    assert_eq!((lamps.tables.len(), lamps.list.len()), (1, 3));
    let [lamp, tinted, _] = &lamps.list[..] else { unreachable!() };
    assert_eq!((lamp.emission, lamp.strength), (Emission::Table(0), 1.0.into()));
    assert_eq!((tinted.emission, tinted.strength), (Emission::Table(0), Spectrum::rgb([2.0, 1.0, 0.0])));
    let towards = |d: DVec3| lamps.tables[0].intensity(DVec3::from_array(lamp.axes.map(|axis| axis.dot(d))));
    // −z of the file is y of the scene, x stays, y is up.
    for (d, candela) in [(DVec3::Y, 100.0), (DVec3::X, 40.0), (DVec3::Z, 10.0), (DVec3::NEG_X, 20.0)] {
        assert!((towards(d) - candela).abs() < 1e-9, "{d}: {}", towards(d));
    }
    let missing = read("lamp.ies").unwrap_err().to_string();
    assert!(
        missing.contains(r#"EXT_lights_ies.lights[0]: the profile "lamp.ies" cannot be read"#),
        "{missing}"
    );
    let malformed = read("data:;base64,SUVTTkE6TE0tNjMtMjAwMgo=").unwrap_err().to_string();
    assert!(malformed.contains("the profile is malformed at line 1: there is no line TILT="), "{malformed}");
}

/// Copies of a mesh by EXT_mesh_gpu_instancing: three translations, of which the accessor is the triangle's own.
#[test]
fn instances_are_copies() {
    let gltf = triangle_gltf(
        "",
        r#","bufferView":0"#,
        &format!(r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}]"#),
    );
    let gltf = gltf.replace(
        r#"[{"mesh":0}]"#,
        r#"[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}]"#,
    );
    let mesh = read("a.gltf", gltf.as_bytes()).unwrap();
    assert_eq!(mesh.triangles.len(), 3);
    let corner = |i: usize| mesh.positions[mesh.triangles[i].corners[0] as usize].to_array();
    assert_eq!([corner(0), corner(1), corner(2)], [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn colours_of_vertices_give_their_mean() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 255 0 0\n1 0 0 0 0 255\n0 1 0 255 0 255\n3 0 1 2\n";
    // A vertex of no face changes nothing, and a second face counts by its area.
    let more = ply.replace("vertex 3", "vertex 7").replace("face 1", "face 2").replace(
        "3 0 1 2\n",
        "5 5 5 255 255 255\n0 0 1 0 255 0\n3 0 1 0 255 0\n0 1 1 0 255 0\n3 0 1 2\n3 4 5 6\n",
    );
    let third = 2.0 / 3.0;
    for (ply, expected) in [(ply.to_owned(), [third, 0.0, third]), (more, [third / 4.0, 0.75, third / 4.0])] {
        let channels = read("a.ply", ply.as_bytes()).unwrap().materials[0].reflectance.channels();
        assert!(
            channels.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12),
            "{channels:?}"
        );
    }
}

/// Colours of vertices count before those of faces, and those of other elements not at all.
#[test]
fn ply_takes_colours_of_vertices_then_faces() {
    let colour = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let found = |of_vertices: bool| {
        let (properties, values) = if of_vertices { (colour, " 255 0 0") } else { ("", "") };
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{properties}\
            element face 1\nproperty list uchar int vertex_indices\n{colour}element edge 1\nproperty int vertex1\n{colour}\
            end_header\n0 0 0{values}\n1 0 0{values}\n0 1 0{values}\n3 0 1 2 0 255 0\n0 0 0 255\n"
        );
        read("a.ply", ply.as_bytes()).unwrap().materials[0].reflectance.channels()
    };
    assert_eq!((found(true), found(false)), ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
}

/// Faces count by their areas, and colours of 16 bits have 65,535 levels.
#[test]
fn ply_weighs_colours_of_faces_by_area() {
    let channel = |kind: &str, most: u32| {
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 3\n\
            property list uchar int vertex_indices\nproperty {kind} red\nproperty {kind} green\nproperty {kind} blue\n\
            end_header\n0 0 0\n3 0 0\n0 1 0\n0 -1 0\n3 0 1 2 {most} {most} {most}\n3 0 3 2 0 0 0\n3 0 3 1 0 0 0\n"
        );
        read("a.ply", ply.as_bytes()).unwrap().materials[0].reflectance[0]
    };
    for found in [channel("uchar", 255), channel("ushort", 65_535), channel("float", 1)] {
        assert!((found - 0.5).abs() < 1e-12, "the second face has no area: {found}");
    }
    assert!((channel("ushort", 32_768) - 0.5 * texture_light(0.5)).abs() < 1e-4);
}

/// The light of a value of sRGB.
fn texture_light(value: f64) -> f64 {
    ((value + 0.055) / 1.055).powf(2.4)
}

#[test]
fn bright_materials_are_clamped_and_refused_in_strict_reading() {
    let glb = br#"{"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"nodes":[{"mesh":0}],
        "materials":[{"name":"Snow","pbrMetallicRoughness":{"metallicFactor":0}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let strict = Options { strict: true, ..Options::default() };
    let refused = scene("a.gltf", glb, &strict).unwrap_err().to_string();
    assert!(
        refused.contains("\"Snow\"")
            && refused.contains("such as 1")
            && refused.contains("reflectance_limit = 0.95"),
        "{refused}"
    );
    let clamped = |reflectance_limit| {
        let imported = scene("a.gltf", glb, &Options { reflectance_limit, ..Options::default() }).unwrap();
        assert!(imported.notes.iter().any(|note| note.starts_with("clamped to 0.")), "{:?}", imported.notes);
        imported.spec.surfaces[0].reflectance
    };
    assert_eq!([clamped(None), clamped(Some(0.875))], [Spectrum::from(0.95), 0.875.into()]);
}

#[test]
fn mgf_surfaces_have_their_areas() {
    let area_of = |statements: &str| {
        let text = format!("m grey =\n\trd 0.5\nv a =\n\tp 0 0 0\n\tn 0 0 1\nv b =\n\tp 0 0 2\n{statements}");
        let mut none = |_: &Path| Err(io::Error::from(io::ErrorKind::NotFound));
        let path = Path::new("a.mgf");
        let mesh =
            import::read(path, text.as_bytes(), Format::Mgf, 1e-5, &mut Files::new(&mut none)).unwrap();
        area(&mesh.into_scene(path, Format::Mgf, &Options::default()).unwrap())
    };
    let pi = std::f64::consts::PI;
    for (statements, expected) in [
        ("sph a 0.5\n", pi),
        ("cyl a 0.5 b\n", 2.0 * pi),
        ("cone a 0.5 b 0\n", pi * 0.5 * 4.25_f64.sqrt()),
        ("ring a 0.5 1\n", 0.75 * pi),
        ("torus a 1 3\n", 4.0 * pi * pi * 2.0),
        ("xf -a 3 -t 1 0 0 -s 2\nsph a 0.5\nxf\n", pi * (1.0 + 4.0 + 16.0)),
    ] {
        assert!((area_of(statements) / expected - 1.0).abs() < 1e-3, "{statements}");
    }
}

/// Facets of curved surfaces send what the surfaces do; flat surfaces of the same material keep its emittance.
#[test]
fn mgf_surfaces_have_their_power() {
    let head =
        "m lamp =\n\trd 0.5\n\ted 3\nv a =\n\tp 0 0 0\n\tn 0 0 1\nv b =\n\tp 0 0 2\nv c =\n\tp 9 0 0\n";
    let pi = std::f64::consts::PI;
    for (statement, area) in [
        ("sph a 0.5", pi),
        ("cyl a 0.5 b", 2.0 * pi),
        ("cone a 0.5 b 0", pi * 0.5 * 4.25_f64.sqrt()),
        ("ring a 0.5 1", 0.75 * pi),
        ("torus a 1 3", 4.0 * pi * pi * 2.0),
    ] {
        let text = format!("{head}{statement}\nf a b c\n");
        let surfaces = scene("a.mgf", text.as_bytes(), &Options::default()).unwrap().spec.surfaces;
        let (flat, curved) = surfaces.split_last().unwrap();
        let sent: f64 = curved.iter().map(|facet| facet.emittance[0] * facet.shape.area()).sum();
        assert!((sent / (flat.emittance[0] * area) - 1.0).abs() < 1e-6, "{statement}: {sent}");
    }
}

/// A triangle whose positions have the JSON `extra`.
fn triangle_gltf(primitive: &str, accessor: &str, extra: &str) -> String {
    format!(
        r#"{{"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}{primitive}}}]}}],
        "accessors":[{{"componentType":5126,"count":3,"type":"VEC3"{accessor}}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}]{extra}}}"#
    )
}

const TRIANGLE: &str = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

/// A square of 1 m² whose vertices have the level 51 of 255, compressed by another program.
#[test]
fn colours_of_vertices_are_unpacked() {
    let packed = "RFJBQ08CAgEAAAACBAEAAQIAAgMBAgICAwEAAAkDAAEBAgABAQEBAQFAAQAzAAAAMwAAAAABAQADAwEwARADADSCYEAAAAAA/z8AAAAAAAAAAAAAAAAAAAAAgD8O";
    let primitive = r#","material":0,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":1,"COLOR_0":0}}}"#;
    let rest = format!(
        r#","materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.5,1,1]}}}}],"buffers":[{{"byteLength":93,"uri":"data:;base64,{packed}"}}]"#
    );
    let gltf = triangle_gltf(primitive, "", &rest)
        .replace(r#""POSITION":0}"#, r#""POSITION":0,"COLOR_0":1}"#)
        .replace(r#""byteLength":36}]"#, r#""byteLength":93}]"#);
    let paint = read("a.gltf", gltf.as_bytes()).unwrap().materials.swap_remove(0);
    let channels = paint.reflectance.channels();
    assert!(channels.iter().zip([0.1, 0.1, 0.2]).all(|(a, b)| (a - b).abs() < 1e-12), "{channels:?}");
    assert_eq!(paint.texture.as_deref(), Some("colours of vertices"));
}

/// A room of 4 × 3 × 2.5 m that another program has compressed: 14 bits stand for a coordinate.
#[test]
fn draco_is_unpacked() {
    for path in ["gltf/packed.glb", "gltf/packed-in-sequence.glb"] {
        let scene = scene(path, &corpus(path), &Options::default()).unwrap();
        assert!((area(&scene) - 59.0).abs() < 0.01, "{}", area(&scene));
        let colour = scene.spec.surfaces[0].reflectance.channels();
        assert!(colour.iter().zip([0.5, 0.4, 0.3]).all(|(found, given)| (found - given).abs() < 1e-6));
        // All fronts look into the room, whose middle is (2, −1.5, 1.25).
        for surface in &scene.spec.surfaces {
            let (corner, u, v) = surface.shape.edges();
            let inwards = (glam::DVec3::new(2.0, -1.5, 1.25) - corner).dot(u.cross(v));
            assert!(inwards > 0.0, "{:?}", surface.shape);
        }
        // What is cut short is refused and no panic.
        let packed = corpus(path);
        (20..packed.len()).step_by(7).for_each(|end| assert!(read(path, &packed[..end]).is_err(), "{end}"));
    }
}

/// The same triangle with every word by which exporters say a unit.
#[test]
fn files_say_their_unit() {
    for (head, unit) in [
        ("# Alias OBJ Model File\n# File units = inches\n", Some(0.0254)),
        ("# Units: millimeters\n", Some(0.001)),
        ("# File units = meters\n", None),
        ("# united = inches\n", None),
    ] {
        let obj = format!("{head}{SQUARE}f 1 2 3 4\n");
        let imported = scene("a.obj", obj.as_bytes(), &Options::default()).unwrap();
        assert_eq!(imported.likely_unit.map(|(_, length)| length), unit, "{head}");
        let is_noted = imported.notes.iter().any(|note| note.contains("is what the file says"));
        assert_eq!(is_noted, unit.is_some(), "{:?}", imported.notes);
    }
}

#[test]
fn stl_may_leave_ends_out_and_no_corners() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n";
    let mesh = read("a.stl", format!("solid\n{facet}{facet}").as_bytes()).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    let cuts =
        [("facet normal 0 0 1\nvertex 0 0 0\n", 8), ("facet\nvertex 0 0 0\nvertex 1 0 0\nendfacet\n", 11)];
    for (cut, line) in cuts {
        let message = read("a.stl", format!("solid\n{facet}{cut}").as_bytes()).unwrap_err().to_string();
        assert!(message.contains(&format!("a.stl:{line}: a facet of")), "{message}");
    }
}

/// Keywords in capitals, and a binary file that begins with `solid` and does not end with its last triangle.
#[test]
fn stl_of_other_exporters_is_read() {
    let upper = "SOLID x\n FACET NORMAL 0 0 1\n OUTER LOOP\n VERTEX 0 0 0\n VERTEX 1 0 0\n VERTEX 0 1 0\n ENDLOOP\n ENDFACET\nENDSOLID x\n";
    assert_eq!(read("a.stl", upper.as_bytes()).unwrap().triangles.len(), 1);
    let mut binary = corpus("stl/binary.stl");
    binary[..5].copy_from_slice(b"solid");
    binary.extend([0; 2]);
    assert_eq!(read("a.stl", &binary).unwrap().triangles.len(), 2);
}

/// Rows that the file does not hold are 0 by the format: no faces come of them, and no time is spent on them.
#[test]
fn rows_that_are_not_in_a_gltf_make_no_faces() {
    let buffers = format!(r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}]"#);
    let nothing = r#",{"attributes":{"POSITION":1}},{"attributes":{"POSITION":0},"indices":1}"#;
    let text = triangle_gltf("", r#","bufferView":0"#, &buffers)
        .replace(r#""POSITION":0}}]"#, &format!(r#""POSITION":0}}}}{nothing}]"#))
        .replace(
            r#""bufferView":0}]"#,
            r#""bufferView":0},{"componentType":5126,"count":4000000,"type":"VEC3"}]"#,
        );
    let imported = scene("a.gltf", text.as_bytes(), &Options::default()).unwrap();
    assert_eq!(imported.spec.surfaces.len(), 1);
    let note = "primitives whose vertices or indices are not in the file, left out: 2";
    assert!(imported.notes.iter().any(|found| found.contains(note)), "{:?}", imported.notes);
    let instancing = r#"[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1}}}},{"mesh":0}]"#;
    let copies = text
        .replace(r#"[{"mesh":0}]"#, instancing)
        .replace(r#""nodes":[0]"#, r#""nodes":[0,1]"#)
        .replace(r#""count":4000000"#, r#""count":4000000,"sparse":{"count":0}"#);
    let imported = scene("a.gltf", copies.as_bytes(), &Options::default()).unwrap();
    assert_eq!(imported.spec.surfaces.len(), 1);
    let note = "transforms of copies that are not in the file, left out: 1";
    assert!(imported.notes.iter().any(|found| found.contains(note)), "{:?}", imported.notes);
}

#[test]
fn compressed_gltf_is_refused_unless_it_is_there_in_full() {
    let draco = r#","extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}"#;
    let buffers = format!(r#","buffers":[{{"byteLength":36,"uri":"{TRIANGLE}"}}]"#);
    let refused = |text: String| read("a.gltf", text.as_bytes()).unwrap_err().to_string();
    let without = refused(triangle_gltf(draco, "", &buffers));
    assert!(without.contains("meshes[0].primitives[0]") && without.contains("Draco"), "{without}");
    let whole = read("a.gltf", triangle_gltf(draco, r#","bufferView":0"#, &buffers).as_bytes()).unwrap();
    assert_eq!(whole.triangles.len(), 1);
    let fallback =
        r#","buffers":[{"byteLength":36,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}]"#;
    let meshopt = refused(triangle_gltf("", r#","bufferView":0"#, fallback));
    assert!(meshopt.contains("buffers[0]") && meshopt.contains("EXT_meshopt_compression"), "{meshopt}");
}

/// The nodes of a mesh that is used twice, one of them below a mirror; they are in the second scene, which the file
/// makes the default.
#[test]
fn exported_gltf_has_strips_mirrors_and_quantised_vertices() {
    let mesh = read("a.gltf", &corpus("gltf/exported.gltf")).unwrap();
    assert_eq!(mesh.parts, ["Seat", "Copy"]);
    let normal = |i: usize| {
        let [a, b, c] = mesh.triangles[i].corners.map(|corner| mesh.positions[corner as usize]);
        (b - a).cross(c - a)
    };
    // The first triangle of the first strip faces z; its mirror image does, too, and the copy is turned about y.
    assert!(normal(0).z > 0.99 && normal(6).z < -0.99, "{} {}", normal(0), normal(6));
    assert_eq!(mesh.positions.iter().fold(0.0_f64, |most, p| most.max(p.x)), 1.0, "32767 stands for 1");
    for words in ["points or lines", "morph targets", "skinned"] {
        assert!(mesh.notes.iter().any(|note| note.contains(words)), "{words}: {:?}", mesh.notes);
    }
}

#[test]
fn exported_obj_keeps_its_parts_and_leaves_out_what_has_no_area() {
    let mesh = corpus("obj/exported.obj");
    let scene = scene("a.obj", mesh.split(|&byte| byte == 0).next().unwrap(), &Options::default()).unwrap();
    let names: Vec<&str> =
        scene.spec.surfaces.iter().map(|surface| surface.name.as_deref().unwrap()).collect();
    assert_eq!(names, ["Room.001:0", "Room.001:0", "Lamp/shade hood:0", "Lamp/shade hood:2", "Lamp:0"]);
    for words in ["1 triangles have no area", "defined by no file"] {
        assert!(scene.notes.iter().any(|note| note.contains(words)), "{words}: {:?}", scene.notes);
    }
}

/// The path is of another machine; the library lies beside the file.
#[test]
fn a_library_that_has_moved_is_found_beside_the_file() {
    let obj = format!("mtllib C:\\rooms\\my room.mtl\n{SQUARE}usemtl white\nf 1 2 3 4\n");
    let mut files = |path: &Path| match path.to_str() {
        Some("rooms/my room.mtl") => Ok(b"newmtl white\nKd 0.75 0.75 0.75\n".to_vec()),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let path = Path::new("rooms/a.obj");
    let mesh = import::read(path, obj.as_bytes(), Format::Obj, 0.0125, &mut Files::new(&mut files)).unwrap();
    assert_eq!(mesh.materials[0].reflectance, 0.75.into());
    assert!(
        mesh.notes.iter().any(|note| note.contains("\"my room.mtl\" beside the file is read")),
        "{:?}",
        mesh.notes
    );
}

/// Of several libraries those that are there are read; the others are named.
#[test]
fn libraries_that_are_there_are_read() {
    let obj = format!("mtllib m1.mtl m2.mtl\nvt nan 0\n{SQUARE}usemtl red\nf 1/1 2/1 3/1 4/1\n");
    let mut files = |path: &Path| match path.to_str() {
        Some("m1.mtl") => Ok(b"newmtl red\nKd 0.75 0.25 0.25\n".to_vec()),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let path = Path::new("a.obj");
    let mesh = import::read(path, obj.as_bytes(), Format::Obj, 0.0125, &mut Files::new(&mut files)).unwrap();
    assert_eq!(mesh.materials[0].reflectance, Spectrum::rgb([0.75, 0.25, 0.25]));
    let words = "line 1: there is no material library \"m2.mtl\",";
    assert!(mesh.notes.len() == 1 && mesh.notes[0].starts_with(words), "{:?}", mesh.notes);
}

/// An array whose copies double in size 72 times: the first are below what the coordinates of the last resolve.
#[test]
fn what_is_too_small_for_the_scene_has_no_area() {
    let mgf = "m grey =\n\trd 0.5\n\ted 1\nv a =\n\tp 0 0 0\nv b =\n\tp 1 0 0\nv c =\n\tp 0 1 0\nm grey\nxf -a 72 -s 2\nf a b c\nxf\n";
    let scene = scene("a.mgf", mgf.as_bytes(), &Options::default()).unwrap();
    assert_eq!(scene.spec.surfaces.len(), 37, "{:?}", scene.notes);
    assert!(scene.notes.iter().any(|note| note.contains("35 triangles have no area")), "{:?}", scene.notes);
}

/// The refused files: name, content, and words of the message.
const REFUSED: &[(&str, &str, &[&str])] = &[
    ("a.obj", "v 0 0\n", &["a.obj:1: ", "a number is missing"]),
    ("a.obj", "v 0 0 x\n", &["a.obj:1: ", "\"x\" is not a finite number"]),
    ("a.obj", "v 0 0 0\nf 1 2 3\n", &["a.obj:2: ", "no vertex \"2\"", "1 are defined"]),
    ("a.obj", "v 0 0 0\n\nf 1 1\n", &["a.obj: ", "no faces; faces of less than three corners, left out: 1"]),
    ("a.obj", "v 0 0 0\n", &["a.obj: ", "no faces"]),
    ("a.stl", "solid\nfacet\nvertex 0 0 0\nendfacet\n", &["a.stl:4: ", "1 corners"]),
    ("a.stl", "nothing", &["a.stl: ", "ends here"]),
    ("a.ply", "plx\n", &["a.ply:1: ", "no PLY"]),
    ("a.vs3", "F 3a\n", &["a.vs3:1: ", "format \"3a\""]),
    ("a.vs3", "V 2 0 0 0\n", &["a.vs3:1: ", "out of order"]),
    ("a.vs3", "V 1 0 0 0\nS 2 1 1 1 0 0 0 0.5 a\n", &["a.vs3:2: ", "surface 2 is out of order"]),
    ("a.vs3", "null 1 1 1 1 0 0 0 0.5 a\n", &["a.vs3:1: ", "null surfaces"]),
    ("a.vs3", "G 1\n", &["a.vs3:1: ", "begins with \"G\""]),
    (
        "a.vs3",
        "V 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nV 4 2 1 0\nS 1 1 2 3 4 0 0 1 a\n",
        &["a.vs3:5: ", "crosses itself"],
    ),
    ("a.vs3", "V 1 0 0 0\nS 1 1 2 3 0 0 0 0.5 a\n", &["a.vs3:2: ", "no vertex 2"]),
    ("a.vs3", "V 1 0 0 0\nS 1 1 1 1 0 2 0 0.5 a\n", &["a.vs3:2: ", "are not read"]),
    ("a.vs3", "V 1 0 0 0\nS 1 1 1 1 0 0 1 0.5 a\n", &["a.vs3:2: ", "no surface 1 to combine with"]),
    ("a.vs3", "V 1 0 0 0\nS 1 1 1 1 0 0 0 1.5 a\n", &["a.vs3:2: ", "emissivity is 1.5"]),
    ("a.vtk", "# vtk\n\nASCII\nDATASET STRUCTURED_GRID\n", &["a.vtk:4: ", "STRUCTURED_GRID", "POLYDATA"]),
    ("a.vtk", "# vtk\n\nASCII\nPOINTS 1 float\n0 0\n", &["a.vtk:6: ", "ends here"]),
    ("a.vtk", "# vtk\n\nASCII\nPOINTS 1 float\n0 0 x\n", &["a.vtk:5: ", "\"x\" is not"]),
    ("a.vtk", "# vtk\n\nASCII\nPOLYGONS 1 4\n3 0 1 2\n", &["a.vtk:5: ", "no point 0", "there are 0"]),
    ("a.vtk", "# vtk\n\nASCII\nPOLYGONS one 4\n", &["a.vtk:4: ", "POLYGONS one 4"]),
    ("a.vtu", "<VTKFile type=\"ImageData\"/>", &["a.vtu: ", "ImageData", "PolyData"]),
    (
        "a.vtu",
        "<VTKFile type=\"PolyData\" compressor=\"vtkLZ4DataCompressor\"/>",
        &["a.vtu: ", "LZ4", "zlib"],
    ),
    (
        "a.vtp",
        "<VTKFile type=\"PolyData\"><Piece>\n<Points><DataArray type=\"Float32\">0 0 nan</DataArray></Points></Piece></VTKFile>",
        &["a.vtp:2: ", "\"nan\" is not"],
    ),
    ("a.ply", "ply\nformat ascii 1.0\nelement vertex x\nend_header\n", &["a.ply:3: "]),
    ("a.glb", "{]", &["a.glb:1: ", "not the JSON"]),
    (
        "a.gltf",
        "{\"extensionsRequired\":[\"EXT_meshopt_compression\"]}",
        &["a.gltf: ", "EXT_meshopt", "gltf-transform"],
    ),
    (
        "a.gltf",
        "{\"asset\":{\"version\":\"1.0\"},\"meshes\":{}}",
        &["a.gltf: ", "glTF 1", "export it as glTF 2.0"],
    ),
    ("a.gltf", "{\"nodes\":[{\"mesh\":7}]}", &["a.gltf: node \"node 0\".mesh: ", "no meshes[7]"]),
    (
        "a.gltf",
        "{\"nodes\":[{\"name\":\"Sun\",\"extensions\":{\"KHR_lights_punctual\":{\"light\":7}}}]}",
        &["a.gltf: node \"Sun\": ", "no lights[7]"],
    ),
    ("a.mgf", "f a b c\n", &["a.mgf:1: ", "no vertex \"a\""]),
    ("a.mgf", "m white =\n\trd x\n", &["a.mgf:2: ", "\"x\""]),
    ("a.mgf", "xf\n", &["a.mgf:1: ", "ends no transform"]),
    ("a.mgf", "xf -q 1\n", &["a.mgf:1: ", "\"-q\" is no transform"]),
    ("a.mgf", "xf -a 99999999 -t 1 0 0\n", &["a.mgf:1: ", "copies"]),
    ("a.mgf", "xf -a 4096\nxf -a 4096\nxf -a 4096\n", &["a.mgf:2: ", "16777216 times", "a.mgf:1 makes 4096"]),
    ("a.mgf", "i other.mgf\n", &["a.mgf:1: ", "other.mgf cannot be included"]),
    ("a.mgf", "v a =\nsph a x\n", &["a.mgf:2: ", "\"x\""]),
    ("a.mgf", "v a =\nring a 0 1\n", &["a.mgf:2: ", "no normal"]),
];

/// A sphere of 360 triangles.
const SPHERE: &str = "v a =\n\tp 0 0 0\nsph a 1\n";

/// Files that ask for gigabytes or for hours: name, content, and words of the refusal.
const GREEDY: &[(&str, &str, &[&str])] = &[
    (
        "a.mgf",
        "v a =\n\tp 0 0 0\nxf -a 200 -t 1 0 0 -a 10 -t 0 1 0\nxf -a 10 -t 0 0 1\nsph a 1\nxf\nxf\n",
        &[
            "a.mgf:5: ",
            "360 triangles of this surface, 20000 times",
            "7200000",
            "4194",
            "a.mgf:3 makes 2000 copies, a.mgf:4 makes 10",
        ],
    ),
    (
        "a.mgf",
        "c\nxf -a 1000000\ncct 5000\n",
        &["a.mgf:3: ", "1000000 times", "steps", "a.mgf:2 makes 1000000 copies"],
    ),
    ("a.mgf", "xf -a 16777216 -t 1 0 0 -a 4 -rx 1\nxf\n", &["a.mgf:1: ", "67108864 times", "steps"]),
    (
        "a.gltf",
        r#"{"accessors":[{"componentType":5126,"count":90000000,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":0,"componentType":5123},"values":{"bufferView":0}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]}"#,
        &[
            "a.gltf: ",
            "meshes[0].primitives[0]",
            "90000000 vertices",
            "4194304 and one for each byte",
            "simplify",
        ],
    ),
    (
        "a.gltf",
        r#"{"accessors":[{"componentType":5126,"count":6000000,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":0,"componentType":5123},"values":{"bufferView":0}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}, "mode": 5}]}],"bufferViews":[{"buffer":0,"byteLength":12}],"buffers":[{"byteLength":12,"uri":"data:;base64,AAAAAAAAAAAAAAAA"}],"nodes":[{"mesh":0}]}"#,
        &["a.gltf: ", "5999998 triangles", "4194304 and one for each byte"],
    ),
    // One block of 50 million bytes, each of which would become a number of 8.
    (
        "a.vtp",
        r#"<VTKFile type="PolyData" compressor="vtkZLibDataCompressor"><Piece><Points><DataArray type="UInt8" format="binary">AQAAAIDw+gKA8PoC</DataArray></Points></Piece></VTKFile>"#,
        &["a.vtp:1: ", "an array is longer than"],
    ),
];

#[test]
fn small_files_cannot_ask_for_much() {
    for (path, content, parts) in GREEDY {
        let message = read(path, content.as_bytes()).unwrap_err().to_string();
        parts
            .iter()
            .for_each(|part| assert!(message.contains(part), "{content:?}: {part:?} not in {message}"));
    }
    // Primitives that are left out take time, too.
    let many = (vec!["{}"; 3000].join(","), vec![r#"{"mesh":0}"#; 3000].join(","));
    let primitives = format!(r#"{{"nodes":[{}],"meshes":[{{"primitives":[{}]}}]}}"#, many.1, many.0);
    let message = read("a.gltf", primitives.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("meshes and primitives"), "{message}");
    let spheres = |copies: u32| format!("{SPHERE}xf -a {copies} -t 1 0 0\nsph a 1\nxf\n");
    assert_eq!(read("a.mgf", spheres(2000).as_bytes()).unwrap().triangles.len(), 2001 * 360);
    assert!(read("a.mgf", spheres(12_000).as_bytes()).is_err());
    let corners = " 1 2 3 4".repeat(5000);
    let message = read("a.obj", format!("{SQUARE}f{corners}\n").as_bytes()).unwrap_err().to_string();
    assert!(message.contains("a.obj:5: a face of 20000 corners"), "{message}");
}

/// The copies of an include are counted before the second is made: the included file is read once.
#[test]
fn copies_are_counted_before_they_are_made() {
    let mut reads = 0;
    let mut open = |path: &Path| {
        reads += 1;
        let content = if path.ends_with("row.mgf") { "i ball.mgf -a 1000 -t 1 0 0\n" } else { SPHERE };
        Ok(content.into())
    };
    let (path, content) = (Path::new("a.mgf"), b"i row.mgf -a 1000 -t 0 1 0\n");
    let read = import::read(path, content, Format::Mgf, 0.0125, &mut Files::new(&mut open));
    let message = read.unwrap_err().to_string();
    assert!(
        message.starts_with("ball.mgf:3: with the 360 triangles of this surface, 1000000 times"),
        "{message}"
    );
    assert_eq!(reads, 2);
}

/// Objects that a copy opens and leaves open end with the copy: the names of later copies do not grow.
#[test]
fn open_objects_end_with_their_copy() {
    let mesh = read("a.mgf", b"v a =\no room\nxf -a 3 -t 1 0 0\no inner\nsph a 1\nxf\nsph a 1\n").unwrap();
    assert_eq!(mesh.parts, ["room", "room/inner"]);
    assert_eq!(mesh.triangles.last().map(|last| (last.part, last.face)), Some((0, 0)));
    assert!(
        mesh.notes[0].starts_with("objects left open within a transform or include, which end with it: 3"),
        "{:?}",
        mesh.notes
    );
}

#[test]
fn long_names_are_cut_and_listed() {
    let mesh = read("a.obj", &corpus("obj/long-names.obj")).unwrap();
    assert_eq!(mesh.parts.len(), 1, "{:?}", mesh.parts);
    assert!(mesh.parts[0].starts_with("long long") && mesh.parts[0].len() <= 200, "{:?}", mesh.parts);
    assert!(mesh.notes.iter().any(|note| note.starts_with("names of parts are cut")), "{:?}", mesh.notes);
    assert_eq!(mesh.triangles.iter().map(|triangle| triangle.face).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn refusals_say_where_what_and_what_to_do() {
    for (path, content, parts) in REFUSED {
        let message = read(path, content.as_bytes()).unwrap_err().to_string();
        assert!(!message.contains('\n') && message.contains('(') && message.contains("); "), "{message}");
        for part in *parts {
            assert!(message.contains(part), "{content:?}: {part:?} is not in: {message}");
        }
    }
}

/// A scene of Mitsuba: a shape of each kind with its area, transforms in their order, references, and what is not diffuse.
#[test]
fn mitsuba_scenes_are_read_as_far_as_they_are_diffuse() {
    let xml = r##"<scene version="3.0.0"><default name="gloss" value="0.25"/><default name="none" value="0"/>
        <bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, $none"/></bsdf></bsdf>
        <bsdf type="plastic" id="floor"><rgb name="diffuse_reflectance" value="#bcbcbc"/></bsdf>
        <bsdf type="diffuse" id="grey"><spectrum name="reflectance" value="$gloss"/></bsdf>
        <shape type="rectangle" id="Floor"><ref id="floor"/><transform name="to_world"><scale value="2"/><translate z="3"/></transform></shape>
        <shape type="cube"><ref id="white"/></shape>
        <shape type="disk"><ref id="grey"/></shape>
        <shape type="sphere" id="Bulb"><float name="radius" value="2"/><point name="center" x="1" y="0" z="0"/>
            <emitter type="area"><rgb name="radiance" value="3 2 1"/></emitter></shape>
        <shape type="obj" id="Chair"><string name="filename" value="chair.obj"/><ref id="white"/>
            <transform name="to_world"><matrix value="1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1"/></transform></shape>
        <shape type="hair"/><emitter type="constant"/></scene>"##;
    let mut files = |path: &Path| match path.to_str() {
        Some("rooms/chair.obj") => Ok(format!("{SQUARE}f 1 2 3\n").into_bytes()),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let path = Path::new("rooms/a.xml");
    let read = |xml: &str, files: &mut dyn FnMut(&Path) -> io::Result<Vec<u8>>| {
        import::read(path, xml.as_bytes(), Format::Mitsuba, 0.0125, &mut Files::new(files))
    };
    let mesh = read(xml, &mut files).unwrap();
    let area = |part: &str| {
        let corner = |at: u32| mesh.positions[at as usize];
        let of = mesh.triangles.iter().filter(|triangle| mesh.parts[triangle.part as usize] == part);
        of.map(|t| {
            let [a, b, c] = t.corners.map(corner);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum::<f64>()
    };
    let pi = std::f64::consts::PI;
    for (part, expected, off) in [
        ("Floor", 16.0, 1e-12),
        ("cube", 24.0, 1e-12),
        ("disk", pi, 0.01),
        ("Bulb", 16.0 * pi, 0.02),
        ("Chair", 0.5, 1e-12),
    ] {
        assert!((area(part) / expected - 1.0).abs() <= off, "{part}: {}", area(part));
    }
    let material = |name: &str| mesh.materials.iter().find(|material| material.name == name).unwrap();
    assert_eq!(
        (material("white").reflectance.channels(), material("white").sides),
        ([0.5, 0.4, 0.0], Some(Sides::Both))
    );
    assert!(
        (material("floor").reflectance[0] - 0.5029).abs() < 1e-4
            && material("floor").lost == [LostProperty::Mirror]
    );
    assert_eq!(material("grey").reflectance, 0.25.into());
    // Facets of a sphere send what the sphere does.
    let sent = material("Bulb").emittance.channels().map(|emitted| emitted * area("Bulb") / (16.0 * pi * pi));
    assert!(sent.iter().zip([3.0, 2.0, 1.0]).all(|(found, sent)| (found - sent).abs() < 1e-12), "{sent:?}");
    let chair = mesh.triangles.last().unwrap().corners[1];
    assert_eq!(mesh.positions[chair as usize].to_array(), [6.0, 6.0, 7.0]);
    // Fronts of bodies look outwards.
    let outwards = mesh.triangles.iter().filter(|t| mesh.parts[t.part as usize] == "cube").all(|t| {
        let [a, b, c] = t.corners.map(|at| mesh.positions[at as usize]);
        (b - a).cross(c - a).dot(a) > 0.0
    });
    assert!(outwards && mesh.notes.len() == 2, "{:?}", mesh.notes);
    for (xml, message) in [
        ("<scene><shape", "not XML"),
        ("<mujoco/>", "not a scene of Mitsuba"),
        (
            "<scene>\n<shape type=\"ply\"><string name=\"filename\" value=\"b.ply\"/></shape></scene>",
            "a.xml:2: \"b.ply\" cannot be read",
        ),
        (
            "<scene><shape type=\"cube\"><transform name=\"to_world\"><scale value=\"x\"/></transform></shape></scene>",
            "not finite",
        ),
    ] {
        let refused = read(xml, &mut files).unwrap_err().to_string();
        assert!(refused.contains(message), "{xml}: {refused}");
    }
}

/// Reads a room of one material and a shape behind it.
fn mitsuba(reflectance: &str, shape: &str) -> Mesh {
    let room = format!(r#"<shape type="cube"><bsdf type="diffuse" id="wall">{reflectance}</bsdf></shape>"#);
    let head = r#"<default name="up" value="y"/><default name="upper" value="1.5"/><medium type="homogeneous" id="fog"/>"#;
    read("a.xml", format!("<scene>{head}{room}{shape}</scene>").as_bytes()).unwrap()
}

/// Spectra without numbers are named and not black: a reflectance is 0.5, an emitter is dark.
#[test]
fn spectra_of_mitsuba_are_read_or_named() {
    let wall = |reflectance: &str| {
        let material = mitsuba(reflectance, "").materials.swap_remove(0);
        (material.reflectance.channels(), material.lost)
    };
    let undefined = ([0.5; 3], vec![LostProperty::Definition]);
    for unread in ["filename=\"grey.spd\"", "value=\"x\"", "value=\"0.1 0.2\"", "value=\"400:x\""] {
        assert_eq!(wall(&format!("<spectrum name=\"reflectance\" {unread}/>")), undefined, "{unread}");
    }
    let uniform =
        r#"<spectrum type="uniform" name="reflectance"><float name="value" value="0.25"/></spectrum>"#;
    assert_eq!(wall(uniform), ([0.25; 3], vec![]));
    // Levels of sRGB are no linear light; those of rgb are.
    let (srgb, _) = wall(r#"<srgb name="reflectance" value="0.5, 0.5, 0.5"/>"#);
    assert!((srgb[0] - 0.214_041_14).abs() < 1e-8, "{srgb:?}");
    assert_eq!(wall(r#"<rgb name="reflectance" value="0.5, 0.5, 0.5"/>"#), ([0.5; 3], vec![]));

    let lamp = |radiance: &str| {
        let shape =
            format!(r#"<shape type="rectangle" id="Lamp"><emitter type="area">{radiance}</emitter></shape>"#);
        let mesh = mitsuba("", &shape);
        (mesh.materials.last().unwrap().emittance[0] / std::f64::consts::PI, mesh.notes)
    };
    let daylight = r#"<spectrum type="d65" name="radiance"><float name="scale" value="10"/></spectrum>"#;
    assert_eq!(lamp(daylight), (10.0, vec![]));
    let (emitted, notes) = lamp(r#"<blackbody name="radiance" temperature="3000K"/>"#);
    assert_eq!(emitted, 0.0);
    let words = "area emitters whose radiance is not read, left dark: 1 (\"Lamp\"); write it as rgb";
    assert_eq!(notes, [words]);
}

/// The reflectance of a material that is made of others, in red, and what it loses; `grey` reflects 0.8.
fn mitsuba_paint(bsdf: &str) -> (f64, Vec<LostProperty>) {
    let shape = format!(r#"<shape type="rectangle">{bsdf}</shape>"#);
    let mesh = mitsuba(r#"<rgb name="reflectance" value="0.8"/>"#, &shape);
    let material = mesh.materials.into_iter().next_back().unwrap();
    (material.reflectance[0], material.lost)
}

/// Blends mix by weight, masks and `null` let light pass, and what is metal or glass of `principled` is no paint.
#[test]
fn mixtures_of_mitsuba_reflect_by_their_parts() {
    use LostProperty::{Clearness, Mirror, Texture, Transparency};
    let bsdf = |kind: &str, rest: &str| format!(r#"<bsdf type="{kind}">{rest}</bsdf>"#);
    let number = |name: &str, value: &str| format!(r#"<float name="{name}" value="{value}"/>"#);
    let grey = r#"<ref id="wall"/>"#;
    let black = bsdf("diffuse", r#"<rgb name="reflectance" value="0"/>"#);
    let null = bsdf("null", "");
    let red = r#"<rgb name="base_color" value="0.8 0 0"/>"#;
    let checks = |colours: &str| {
        bsdf("diffuse", &format!(r#"<texture name="reflectance" type="checkerboard">{colours}</texture>"#))
    };
    let of_checks = r#"<rgb name="color0" value="0.9"/><rgb name="color1" value="0.1"/>"#;
    let image =
        r#"<texture name="opacity" type="bitmap"><string name="filename" value="leaf.png"/></texture>"#;
    for (material, expected, lost) in [
        (bsdf("blendbsdf", &format!("{}{grey}{black}", number("weight", "0.25"))), 0.6, vec![]),
        (bsdf("blendbsdf", &format!("{}{grey}{null}", number("weight", "0.75"))), 0.2, vec![Clearness]),
        (null.clone(), 0.0, vec![Clearness]),
        (bsdf("mask", &format!("{}{grey}", number("opacity", "0.75"))), 0.6, vec![Transparency]),
        (bsdf("mask", &format!("{}{grey}", number("opacity", "0.25"))), 0.2, vec![Clearness]),
        (bsdf("mask", &format!("{}{grey}", number("opacity", "1"))), 0.8, vec![]),
        (bsdf("mask", &format!("{image}{grey}")), 0.8, vec![Transparency]),
        (bsdf("principled", &format!("{red}{}", number("metallic", "0.75"))), 0.2, vec![Mirror]),
        (bsdf("principled", &format!("{red}{}", number("spec_trans", "1"))), 0.0, vec![Mirror, Clearness]),
        (checks(of_checks), 0.5, vec![]),
        (checks(""), 0.3, vec![]),
        (
            bsdf("blendbsdf", &format!("{}{grey}{black}", image.replace("opacity", "weight"))),
            0.4,
            vec![Texture],
        ),
    ] {
        let (found, lost_there) = mitsuba_paint(&material);
        assert!((found - expected).abs() < 1e-12 && lost_there == lost, "{material}: {found} {lost_there:?}");
    }
}

/// Levels of images that are `raw` are of linear light.
#[test]
fn raw_images_of_mitsuba_are_of_linear_light() {
    let mut png = std::io::Cursor::new(Vec::new());
    let grey = image::GrayImage::from_raw(1, 1, vec![51]).unwrap();
    grey.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let red = |raw: &str| {
        let mut files = |_: &Path| Ok(png.get_ref().clone());
        let xml = format!(
            r#"<scene><shape type="cube"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
            <string name="filename" value="a.png"/>{raw}</texture></bsdf></shape></scene>"#
        );
        let mesh = import::read(
            Path::new("a.xml"),
            xml.as_bytes(),
            Format::Mitsuba,
            0.0125,
            &mut Files::new(&mut files),
        );
        mesh.unwrap().materials[0].reflectance[0]
    };
    assert!((red(r#"<boolean name="raw" value="true"/>"#) - 0.2).abs() < 1e-12);
    assert!((red("") - texture_light(0.2)).abs() < 1e-12);
}

/// The back of a sheet with two sides reflects, and its front alone emits.
#[test]
fn backs_of_lamps_of_mitsuba_reflect() {
    let lamp = r#"<shape type="rectangle"><bsdf type="twosided"><ref id="wall"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>"#;
    let mesh = mitsuba(r#"<rgb name="reflectance" value="0.8"/>"#, lamp);
    let faces: Vec<(bool, f64, f64)> = mesh.triangles[12..]
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.corners.map(|corner| mesh.positions[corner as usize]);
            let material = &mesh.materials[triangle.material as usize];
            assert_eq!(material.sides, Some(Sides::Front));
            ((b - a).cross(c - a).z > 0.0, material.reflectance[0], material.emittance[0])
        })
        .collect();
    let exitance = 2.0 * std::f64::consts::PI;
    assert_eq!(faces, [[(true, 0.8, exitance); 2], [(false, 0.8, 0.0); 2]].concat());
    let scene = mesh.into_scene(Path::new("a.xml"), Format::Mitsuba, &Options::default()).unwrap();
    assert_eq!(scene.spec.surfaces.len(), 16, "{:?}", scene.notes);
}

/// Materials without a name of their own are told apart by options.
#[test]
fn nameless_materials_of_mitsuba_have_names_of_their_own() {
    let shape = |colour: &str| {
        format!(
            r#"<shape type="disk"><bsdf type="diffuse"><rgb name="reflectance" value="{colour}"/></bsdf></shape>"#
        )
    };
    let mesh = mitsuba("", &["0.1", "0.2", "0.3"].map(shape).concat());
    let names: Vec<&str> = mesh.materials.iter().map(|material| &*material.name).collect();
    assert_eq!(names, ["wall", "default", "default.2", "default.3"]);
}

#[test]
fn a_pointer_of_git_lfs_is_called_one() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    for name in ["a.glb", "a.obj", "a.xml"] {
        let error = read(name, pointer.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("pointer of Git LFS") && error.contains("git lfs pull"), "{error}");
    }
}

/// References to media are no materials; those to emitters are emitters; an alias is another name.
#[test]
fn references_of_mitsuba_mean_what_they_lead_to() {
    let shape = r#"<emitter type="area" id="glow"><rgb name="radiance" value="2"/></emitter><alias id="wall" as="paint"/>
        <shape type="rectangle"><ref name="interior" id="fog"/><ref id="glow"/><ref id="paint"/></shape>"#;
    let mesh = mitsuba(r#"<rgb name="reflectance" value="0.8"/>"#, shape);
    let lamp = &mesh.materials[mesh.triangles.last().unwrap().material as usize];
    // A name of its own, so that options tell it from the wall that does not emit.
    assert_eq!((lamp.reflectance, &*lamp.name), (0.8.into(), "wall.2"));
    assert_eq!(lamp.emittance, (2.0 * std::f64::consts::PI).into());
    assert!(mesh.notes.is_empty(), "{:?}", mesh.notes);
}

/// Names within a value, of which the longest is meant; matrices of nine numbers; and `lookat` along any axis without one for up.
#[test]
fn transforms_of_mitsuba_stand_in_several_ways() {
    let normal = |transform: &str| {
        let shape =
            format!(r#"<shape type="rectangle"><transform name="to_world">{transform}</transform></shape>"#);
        let mesh = mitsuba("", &shape);
        let [a, b, c] = mesh.triangles.last().unwrap().corners.map(|corner| mesh.positions[corner as usize]);
        ((a + b) / 2.0, (b - a).cross(c - a).normalize())
    };
    let (middle, facing) = normal(r#"<matrix value="1 0 0 0 0 -1 0 1 0"/><translate value="0 $upper 0"/>"#);
    assert_eq!((middle, facing), (DVec3::new(0.0, 1.5, 0.0), DVec3::NEG_Y));
    let (middle, facing) = normal(r#"<lookat origin="0,1.9,0" target="0,0,0"/>"#);
    assert!(middle.distance(DVec3::new(0.0, 1.9, 0.0)) < 1e-12 && facing.distance(DVec3::NEG_Y) < 1e-12);
}
