//! The fuzz targets that libFuzzer runs for minutes (`scripts/fuzz.sh`), run briefly: the kept corpus, and fixed
//! changes of it.

use std::path::Path;

use crate::toy::hash;

/// The kept inputs of a target, in the order of their names.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut files: Vec<_> = folder.read_dir().unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "no corpus in {}", folder.display());
    files.into_iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// An input with some bytes changed, cut, or replaced by those of another.
fn changed(corpus: &[Vec<u8>], number: u64) -> Vec<u8> {
    let mut lots = (1000 * number..).map(hash);
    let mut lot = |n: usize| (lots.next().unwrap() % n.max(1) as u64) as usize;
    let mut bytes = corpus[lot(corpus.len())].clone();
    for _ in 0..1 + lot(4) {
        let at = lot(bytes.len());
        match lot(4) {
            0 => bytes.truncate(at),
            1 => bytes.insert(at, lot(256) as u8),
            2 => {
                let other = &corpus[lot(corpus.len())];
                bytes.truncate(at);
                bytes.extend(&other[at.min(other.len())..]);
            }
            _ if !bytes.is_empty() => bytes[at] = lot(256) as u8,
            _ => {}
        }
    }
    bytes
}

fn run(name: &str, target: fn(&[u8]), changes: u64) {
    let corpus = corpus(name);
    corpus.iter().for_each(|bytes| target(bytes));
    (0..changes).for_each(|number| target(&changed(&corpus, number)));
}

#[test]
fn the_decoder_stands_anything() {
    run("decoder", crate::targets::decoder, 20_000);
}

#[test]
fn the_handshake_and_records_stand_anything() {
    run("handshake", crate::targets::handshake, 500);
}

#[test]
fn the_coordinator_stands_whatever_peers_with_the_key_say() {
    run("coordinator", crate::targets::coordinator, 5_000);
}
