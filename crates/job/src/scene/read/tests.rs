//! Scenes read part by part, against scenes read whole.

use super::*;

/// Surfaces in plain form and in others, with materials between them.
const SCENE: &str = "[material.a]\nreflectance = 0.5\n\n[[surface]]\nname = \"floor\"\nmaterial = \"a\" # grey\n\
    quad = [[0, 0, 0], [1.5, 0, 0], [0, 1e0, -0.0]]\npatches = [2, 3]\n[[surface]]\nmaterial = 'b'\nsides = 2\n\
    triangle = [[0, 0, 1], [1, 0, 1],\n  [0, 1, +1]]\n\n[material.b]\nemittance = [1, 2, 3]\n[[surface]]\n\
    material = \"a\"\nname = \"w\\u0061ll\"\ntriangle = [[0, 0, 2], [1, 0, 2], [0, 1, 2]]\npatches = 4\n\
    [[surface.emit]]\ncell = [1, 1]\nemittance = 2\n[[surface]]\nmaterial = \"b\"\r\n\
    quad = [[0, 0, 0x3], [1, 0, 3], [0, 1_0, 3]]\n";

/// What changes put into the text.
const WORDS: &[&str] = &[
    "\n",
    " ",
    "#",
    "-",
    "0",
    "1",
    ",",
    "[",
    "]",
    "\"",
    "'",
    ".",
    "e9",
    "_",
    "=",
    "[[surface]]\n",
    "name",
    "inf",
    "\t",
];

/// splitmix64 (Steele, Lea and Flood 2014).
fn hash(n: u64) -> u64 {
    let mut x = n.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// The scene with a piece or two of up to two letters replaced.
fn changed(number: u64) -> String {
    let mut text = SCENE.to_owned();
    for change in 0..=hash(number) % 2 {
        let lot = |n: u64, below: usize| (hash(hash(number) + 3 * change + n) % below as u64) as usize;
        let start = lot(0, text.len());
        let end = (start + lot(1, 3)).min(text.len());
        text.replace_range(start..end, WORDS[lot(2, WORDS.len())]);
    }
    text
}

/// Scenes are read part by part, in plain form where they have it: what comes of it is what the document says.
#[test]
fn parts_say_what_the_whole_says() {
    let options = Options::default();
    let (mut accepted, mut refused) = (0, 0);
    for number in 0..4_000 {
        let text = if number == 0 { SCENE.into() } else { changed(number) };
        let source = SourceText::of_scene(Path::new("s.toml"), &text);
        let whole = read_whole(&source, &options);
        match (read_parts(&source, &options), &whole) {
            (Ok(Some(parts)), Ok(whole)) => {
                assert_eq!(parts, *whole, "{text}");
                accepted += 1;
            }
            (Ok(None), _) => {}
            (Err(_), Err(_)) => refused += 1,
            (parts, whole) => panic!("{parts:?}\n{whole:?}\n{text}"),
        }
    }
    assert!(accepted > 200 && refused > 200, "{accepted} {refused}");
}
