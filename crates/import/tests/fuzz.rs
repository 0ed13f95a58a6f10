//! The fuzz targets that libFuzzer runs for minutes (`scripts/fuzz.sh`), run briefly: the kept corpus, and fixed changes of it.

use crate::fuzzing::{Target, stand_anything, stand_anything_for_long};

const TARGETS: [Target; 8] = [
    Target { name: "obj", read: crate::targets::obj, memory: 1 << 30 },
    Target { name: "gltf", read: crate::targets::gltf, memory: 1 << 30 },
    Target { name: "stl", read: crate::targets::stl, memory: 1 << 30 },
    Target { name: "ply", read: crate::targets::ply, memory: 1 << 30 },
    Target { name: "mgf", read: crate::targets::mgf, memory: 1 << 30 },
    Target { name: "mitsuba", read: crate::targets::mitsuba, memory: 1 << 30 },
    Target { name: "vs3", read: crate::targets::vs3, memory: 1 << 30 },
    Target { name: "vtk", read: crate::targets::vtk, memory: 1 << 30 },
];

#[test]
fn readers_stand_anything() {
    stand_anything(env!("CARGO_MANIFEST_DIR"), &TARGETS);
}

#[test]
#[ignore = "takes as long as one likes"]
fn readers_stand_anything_for_long() {
    stand_anything_for_long(env!("CARGO_MANIFEST_DIR"), &TARGETS);
}
