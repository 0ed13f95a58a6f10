//! The fuzz targets that libFuzzer runs for minutes (`scripts/fuzz.sh`), run briefly: the kept corpus, and fixed
//! changes of it.

use std::path::Path;
use std::time::{Duration, Instant};

/// The kept inputs of a target, in the order of their names.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let files = kept("corpus", target);
    assert!(!files.is_empty(), "no corpus of {target}");
    files
}

/// The kept inputs of a target that ask for too much. Some changes of them are not refused, and take seconds.
fn greedy(target: &str) -> Vec<Vec<u8>> {
    kept("greedy", target)
}

fn kept(folder: &str, target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz").join(folder).join(target);
    let Ok(files) = folder.read_dir() else { return Vec::new() };
    let mut files: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// A hash of a number: splitmix64 (Steele, Lea and Flood 2014).
fn hash(n: u64) -> u64 {
    let mut x = n.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Words that have a meaning for some reader.
const WORDS: &[&[u8]] = &[
    b" ",
    b"\n",
    b"-1",
    b"0",
    b"nan",
    b"1e999",
    b"99999999999",
    b"4294967295",
    b" -a 3",
    b" -i 2",
    b"xf\n",
    b"o\n",
    b"f ",
    b"v ",
    b"i x\n",
    b"{}",
    b"[]",
    b"null",
    b"\"",
    b"\\\n",
    b"/",
    b"#",
    b"\0",
    b"-",
];

/// An input with some bytes changed, cut, repeated, or replaced by a word or by bytes of another input.
fn changed(corpus: &[Vec<u8>], number: u64) -> Vec<u8> {
    let mut lots = (1000 * number..).map(hash);
    let mut lot = |n: usize| (lots.next().unwrap() % n.max(1) as u64) as usize;
    let mut bytes = corpus[lot(corpus.len())].clone();
    for _ in 0..1 + lot(4) {
        let at = lot(bytes.len());
        match lot(7) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, lot(256) as u8),
            2 => {
                let other = &corpus[lot(corpus.len())];
                bytes.truncate(at);
                bytes.extend(&other[at.min(other.len())..]);
            }
            3 => {
                let end = (at + lot(40)).min(bytes.len());
                bytes.splice(at..end, WORDS[lot(WORDS.len())].iter().copied());
            }
            4 => {
                let end = (at + lot(40)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ if !bytes.is_empty() => bytes[at] = lot(256) as u8,
            _ => {}
        }
    }
    bytes
}

/// A reader's target by the name of its corpus.
type Target = (&'static str, fn(&[u8]));

const TARGETS: [Target; 8] = [
    ("obj", crate::targets::obj),
    ("gltf", crate::targets::gltf),
    ("stl", crate::targets::stl),
    ("ply", crate::targets::ply),
    ("mgf", crate::targets::mgf),
    ("mitsuba", crate::targets::mitsuba),
    ("vs3", crate::targets::vs3),
    ("vtk", crate::targets::vtk),
];

#[test]
fn readers_stand_anything() {
    for (name, target) in TARGETS {
        let corpus = corpus(name);
        corpus.iter().chain(&greedy(name)).for_each(|content| target(content));
        (0..4_000).for_each(|number| target(&changed(&corpus, number)));
    }
}

/// Tries many more changes, for `FUZZ_SECONDS` seconds per format, of the one format `FUZZ_FORMAT` if it is set.
#[test]
#[ignore = "takes as long as one likes"]
fn readers_stand_anything_for_long() {
    let seconds = std::env::var("FUZZ_SECONDS").map_or(60, |seconds| seconds.parse().unwrap());
    let only = std::env::var("FUZZ_FORMAT").ok();
    for (name, target) in
        TARGETS.into_iter().filter(|(name, _)| only.as_deref().is_none_or(|only| only == *name))
    {
        let (corpus, began) = ([corpus(name), greedy(name)].concat(), Instant::now());
        let mut number = 0;
        while began.elapsed() < Duration::from_secs(seconds) {
            let content = changed(&corpus, number);
            let started = Instant::now();
            target(&content);
            assert!(
                started.elapsed() < Duration::from_secs(20),
                "{name} {number} takes {:?}",
                started.elapsed()
            );
            number += 1;
        }
        println!("{name}: {number} inputs");
    }
}
