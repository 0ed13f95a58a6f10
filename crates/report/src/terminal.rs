//! Pictures in a terminal, by kitty's graphics protocol (<https://sw.kovidgoyal.net/kitty/graphics-protocol/>).

use base64::prelude::{BASE64_STANDARD, Engine as _};

/// How many columns of text a picture is wide.
const COLUMNS: u32 = 72;

/// The most bytes of one escape sequence that carry a picture.
const PIECE: usize = 4096;

/// Whether a terminal says by its variables `TERM` and `TERM_PROGRAM` that it shows pictures.
pub fn shows_pictures([term, program]: [&str; 2]) -> bool {
    ["xterm-kitty", "xterm-ghostty"].contains(&term)
        || ["ghostty", "WezTerm"].contains(&program) && term.starts_with("xterm")
}

/// What shows a PNG in a terminal that shows pictures, with the end of a line.
pub fn in_terminal(png: &[u8]) -> String {
    let text = BASE64_STANDARD.encode(png);
    let last = text.len().saturating_sub(1) / PIECE;
    let mut shown = String::with_capacity(text.len() + 16 * (last + 2));
    for (number, piece) in text.as_bytes().chunks(PIECE).enumerate() {
        // a: transmit and show; f: PNG; q: no answer; c: columns; m: whether more follows.
        let what = if number == 0 { format!("a=T,f=100,q=2,c={COLUMNS},") } else { String::new() };
        let piece = String::from_utf8_lossy(piece);
        shown += &format!("\x1b_G{what}m={};{piece}\x1b\\", u8::from(number < last));
    }
    shown + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pieces_of_a_picture_make_it_whole() {
        for length in [1, 3072, 3073, 10_000] {
            let png: Vec<u8> = (0..length).map(|k| (k % 251) as u8).collect();
            let shown = in_terminal(&png);
            let sequences: Vec<&str> = shown.trim_end().split_terminator("\x1b\\").collect();
            let pieces: Vec<(&str, &str)> = sequences
                .iter()
                .map(|sequence| {
                    sequence.strip_prefix("\x1b_G").and_then(|rest| rest.split_once(';')).unwrap()
                })
                .collect();
            let text: String = pieces.iter().map(|piece| piece.1).collect();
            assert_eq!(BASE64_STANDARD.decode(text).unwrap(), png);
            assert!(pieces[0].0.starts_with("a=T,f=100,"), "{}", pieces[0].0);
            let (last, others) = pieces.split_last().unwrap();
            assert!(last.0.ends_with("m=0") && last.1.len() <= PIECE);
            assert!(others.iter().all(|(keys, piece)| keys.ends_with("m=1") && piece.len() == PIECE));
        }
    }

    #[test]
    fn only_terminals_that_say_so_show_pictures() {
        assert!(shows_pictures(["xterm-kitty", ""]) && shows_pictures(["xterm-256color", "WezTerm"]));
        // Within tmux, which takes the sequences away.
        assert!(!shows_pictures(["tmux-256color", "WezTerm"]) && !shows_pictures(["xterm-256color", ""]));
    }
}
