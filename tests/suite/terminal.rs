//! Tests of what a person sees at a terminal of 80 columns.

use std::fs::File;
use std::io::Read;
use std::os::fd::{AsFd, OwnedFd};
use std::process::Stdio;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};
use tempfile::tempdir;

use crate::support::{finish, path, radwalk, signal};

const COLUMNS: usize = 80;

/// Both ends of a pseudo-terminal.
fn terminal() -> (File, OwnedFd) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY;
    let owner = openpt(flags).unwrap();
    grantpt(&owner).unwrap();
    unlockpt(&owner).unwrap();
    let user = ioctl_tiocgptpeer(&owner, flags).unwrap();
    let size = Winsize { ws_row: 24, ws_col: COLUMNS as u16, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(user.as_fd(), size).unwrap();
    (owner.into(), user)
}

/// The text that is drawn between carriage returns and line feeds, without escape sequences.
fn lines(bytes: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(bytes);
    let mut plain = String::new();
    let mut rest = text.chars();
    while let Some(c) = rest.next() {
        match c {
            // Escape sequences end with a letter.
            '\u{1b}' => _ = rest.by_ref().find(char::is_ascii_alphabetic),
            _ => plain.push(c),
        }
    }
    plain.split(['\r', '\n']).map(|line| line.trim_end().to_owned()).filter(|line| !line.is_empty()).collect()
}

/// Whether a line of the bar shows whole facts: it ends as one of them does.
fn is_whole(line: &str) -> bool {
    ["%", "left", "worker", "workers", "rays/s", "paths/s", "ago"].iter().any(|end| line.ends_with(end))
}

#[test]
fn the_bar_fits_eighty_columns_and_no_fact_is_cut() {
    let folder = tempdir().unwrap();
    let (mut owner, user) = terminal();
    let mut command = radwalk();
    command.args(["run", "tests/data/cube54.toml", "--paths", "1e9", "--workers", "2", "--out"]);
    command.arg(path(&folder, "out")).env("TERM", "xterm-256color").stdout(Stdio::null()).stderr(user);
    let run = command.spawn().unwrap();
    // The command holds the other end; while it does, the terminal never ends.
    drop(command);
    let (mut drawn, mut buffer, mut stopped) = (Vec::new(), [0; 4096], false);
    // Linux returns an error when the last user of a terminal is gone.
    while let Ok(bytes @ 1..) = owner.read(&mut buffer) {
        drawn.extend_from_slice(&buffer[..bytes]);
        if !stopped && lines(&drawn).iter().any(|line| line.contains(" % ") && line.contains("workers")) {
            signal("INT", run.id());
            stopped = true;
        }
    }
    assert_eq!(finish(run).0, 130);
    let lines = lines(&drawn);
    let bars: Vec<&String> =
        lines.iter().filter(|line| line.contains(" % ") && line.contains("worker")).collect();
    let fits = |line: &str| line.chars().count() <= COLUMNS && is_whole(line);
    assert!(!bars.is_empty() && bars.iter().all(|line| fits(line)), "{bars:#?}");
}

/// What a run writes to a terminal that is of some kind, and the picture in its folder.
fn shown_on(kind: &str) -> (String, Vec<u8>) {
    let folder = tempdir().unwrap();
    let (mut owner, user) = terminal();
    let mut command = radwalk();
    command.args(["run", "configs/cube54.toml", "--paths", "1e4", "--out"]).arg(path(&folder, "out"));
    command.env("TERM", kind).env_remove("TERM_PROGRAM").stdout(user).stderr(Stdio::null());
    let run = command.spawn().unwrap();
    drop(command);
    let (mut drawn, mut buffer) = (Vec::new(), [0; 4096]);
    while let Ok(bytes @ 1..) = owner.read(&mut buffer) {
        drawn.extend_from_slice(&buffer[..bytes]);
    }
    assert_eq!(finish(run).0, 0);
    (String::from_utf8(drawn).unwrap(), std::fs::read(path(&folder, "out").join("radiosity.png")).unwrap())
}

#[test]
fn a_terminal_that_can_shows_the_picture() {
    let (drawn, picture) = shown_on("xterm-kitty");
    let pieces = drawn.split("\x1b_G").skip(1).map(|piece| piece.split("\x1b\\").next().unwrap());
    let shown: String = pieces.map(|piece| piece.split_once(';').unwrap().1).collect();
    assert_eq!(BASE64_STANDARD.decode(shown).unwrap(), picture);
    let (drawn, _) = shown_on("xterm-256color");
    assert!(drawn.contains("written to") && !drawn.contains('\x1b'), "{drawn}");
}
