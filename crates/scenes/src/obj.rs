//! Meshes as the text of OBJ files.

use std::collections::HashMap;
use std::fmt::Write;

use crate::material::SceneMaterial;
use crate::mesh::ObjMesh;

/// The text of a mesh as an OBJ file that names a file of materials, and the text of that. Objects of one name are distinguished by numbers.
/// Numbers have the fewest digits from which the same number is read back.
pub(crate) fn to_obj(mesh: &ObjMesh, materials: &str) -> [String; 2] {
    let (mut obj, mut mtl) = (format!("mtllib {materials}\n"), String::new());
    let (mut corners, mut names) = (HashMap::new(), HashMap::new());
    let mut objects = mesh.objects().iter().peekable();
    let mut current = None;
    for (triangle, (points, material)) in mesh.rounded().enumerate() {
        while let Some((_, name)) = objects.next_if(|(first, _)| *first <= triangle) {
            let uses = names.entry(name).and_modify(|uses| *uses += 1).or_insert(1);
            writeln!(obj, "o {name} {uses}").expect("strings take all");
        }
        let name = material.name();
        if current.as_ref() != Some(&name) {
            writeln!(obj, "usemtl {name}").expect("strings take all");
            define(&mut mtl, &name, material);
            current = Some(name);
        }
        let numbers = points.map(|point| {
            let next = corners.len() + 1;
            *corners.entry(point.to_array().map(f64::to_bits)).or_insert_with(|| {
                writeln!(obj, "v {} {} {}", point.x, point.y, point.z).expect("strings take all");
                next
            })
        });
        let [a, b, c] = numbers;
        writeln!(obj, "f {a} {b} {c}").expect("strings take all");
    }
    [obj, mtl]
}

/// Writes a material, unless it stands there.
fn define(mtl: &mut String, name: &str, material: SceneMaterial) {
    let header = format!("newmtl {name}\n");
    if !mtl.contains(&header) {
        let [reflectance, emittance] = material.light().map(|x| [x; 3].map(|x| x.to_string()).join(" "));
        write!(mtl, "{header}Kd {reflectance}\nKe {emittance}\n").expect("strings take all");
    }
}
