//! The fuzz targets that libFuzzer runs for minutes (`scripts/fuzz.sh`), run briefly: the kept corpus, and fixed changes of it.

use crate::fuzzing::{Target, stand_anything, stand_anything_for_long};

const TARGETS: [Target; 4] = [
    Target { name: "job", read: crate::targets::job, memory: 1 << 30 },
    Target { name: "scene", read: crate::targets::scene, memory: 1 << 30 },
    Target { name: "points", read: crate::targets::points, memory: 1 << 26 },
    Target { name: "partition", read: crate::targets::partition, memory: 1 << 30 },
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
