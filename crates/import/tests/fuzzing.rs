//! A plain driver of fuzz targets, for those who have no libFuzzer: the kept corpus, and fixed changes of it. Crates with readers share it.

#![allow(unsafe_code, reason = "allocators are unsafe to write")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use std::time::{Duration, Instant};

/// A reader that takes any bytes.
pub struct Target {
    /// The name of its corpus.
    pub name: &'static str,
    /// Reads some content.
    pub read: fn(&[u8]),
    /// The memory that no input may need [bytes].
    pub memory: isize,
}

/// The system's memory, counted for each thread.
struct Counted;

thread_local! {
    /// The bytes that this thread has taken and not given back, and the most since that was asked for.
    static USED: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    // A thread that ends has no counters any more.
    let _ = USED.try_with(|used| {
        used.set(used.get() + bytes);
        let _ = MOST.try_with(|most| most.set(most.get().max(used.get())));
    });
}

// SAFETY: the system's allocator does the work, and is given what this one is asked for.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller keeps the rules of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: the memory comes from the system's allocator, by `alloc` above.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static MEMORY: Counted = Counted;

/// The inputs of a target that are kept in a folder, in the order of their names.
fn kept(package: &str, folder: &str, target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(package).join("fuzz").join(folder).join(target);
    let mut files: Vec<_> =
        folder.read_dir().into_iter().flatten().map(|file| file.unwrap().path()).collect();
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
    b"-0",
    b"1e308",
    b"-1e308",
    b"5e-324",
    b"0.1",
    b"true",
    b"= ",
    b"[[",
    b"[1e308, 0, 0]",
    b"4000000000",
    b"TILT=INCLUDE\n",
    b"NCOLS=99999999\n",
    b",",
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

/// Gives a target some content: neither memory nor time may be out of proportion.
fn give(Target { name, read, memory }: &Target, content: &[u8], which: &str) {
    let (began, before) = (Instant::now(), USED.get());
    MOST.set(before);
    read(content);
    let (needed, took) = (MOST.get() - before, began.elapsed());
    let said = || format!("{name}, {which}: {:?}", String::from_utf8_lossy(content));
    assert!(needed <= *memory, "{needed} bytes of memory for {}", said());
    assert!(took < Duration::from_secs(20), "{took:?} for {}", said());
}

/// Gives each target of a package its corpus and 4,000 changes of it, and what asks for too much (`greedy`) as it is: some changes of that are not refused, and take seconds.
pub fn stand_anything(package: &str, targets: &[Target]) {
    for target in targets {
        let corpus = kept(package, "corpus", target.name);
        assert!(!corpus.is_empty(), "no corpus of {}", target.name);
        let greedy = kept(package, "greedy", target.name);
        corpus.iter().chain(&greedy).for_each(|content| give(target, content, "kept"));
        (0..4_000).for_each(|number| give(target, &changed(&corpus, number), &number.to_string()));
    }
}

/// Tries many more changes, for `FUZZ_SECONDS` seconds each, of the one target `FUZZ_FORMAT` if it is set.
pub fn stand_anything_for_long(package: &str, targets: &[Target]) {
    let seconds = std::env::var("FUZZ_SECONDS").map_or(60, |seconds| seconds.parse().unwrap());
    let only = std::env::var("FUZZ_FORMAT").ok();
    for target in targets.iter().filter(|target| only.as_deref().is_none_or(|only| only == target.name)) {
        let corpus = [kept(package, "corpus", target.name), kept(package, "greedy", target.name)].concat();
        let (began, mut number) = (Instant::now(), 0);
        while began.elapsed() < Duration::from_secs(seconds) {
            give(target, &changed(&corpus, number), &number.to_string());
            number += 1;
        }
        println!("{}: {number} inputs", target.name);
    }
}
