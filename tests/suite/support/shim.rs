//! A library that stands between the program and the system, and does what systems do wrong. It is built here with the C
//! compiler that links Rust, and preloaded: the program itself knows nothing of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const LIBRARY: &str = include_str!("shim.c");
const STICK: &str = include_str!("stick.c");

/// What can be wrong, by its place in the control file.
#[derive(Clone, Copy, Debug)]
pub enum Wrong {
    /// The milliseconds that each fsync takes.
    SyncMs,
    /// The number of fsyncs in ten that fail.
    SyncFails,
    /// The time of day jumps by a day, to and fro.
    Clock,
    /// No file grows beyond this number of bytes.
    Full,
    /// The milliseconds for which a thread that gets SIGUSR1 is stuck.
    StuckMs,
    /// No file is opened to be written.
    ReadOnly,
}

const WRONGS: usize = 6;

/// The library, and the file that tells it what is wrong.
pub struct Shim {
    library: PathBuf,
    stick: PathBuf,
    control: PathBuf,
}

impl Shim {
    /// Builds the library and the program that makes a thread stick.
    pub fn new(folder: &Path) -> Self {
        let [library, stick, control] = ["shim.so", "stick", "shim.control"].map(|name| folder.join(name));
        let build = |name: &str, source: &str, arguments: &[&str], built: &Path| {
            let file = folder.join(name);
            fs::write(&file, source).unwrap();
            let status =
                Command::new("cc").args(arguments).arg("-o").args([built, &file]).arg("-ldl").status();
            assert!(status.unwrap().success(), "the C compiler");
        };
        build("shim.c", LIBRARY, &["-shared", "-fPIC", "-O1"], &library);
        build("stick.c", STICK, &["-O1"], &stick);
        fs::write(&control, [0; 4 * WRONGS]).unwrap();
        Shim { library, stick, control }
    }

    /// Puts it between a program and the system.
    pub fn stand_before<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("LD_PRELOAD", &self.library).env("SHIM_CONTROL", &self.control)
    }

    /// From now on this is wrong, to this degree; 0 ends it.
    pub fn set(&self, wrong: Wrong, degree: i32) {
        use std::os::unix::fs::FileExt;
        let file = fs::OpenOptions::new().write(true).open(&self.control).unwrap();
        file.write_all_at(&degree.to_ne_bytes(), 4 * wrong as u64).unwrap();
    }

    /// A thread of a process is stuck for as long as [`Wrong::StuckMs`] says. It may be gone already.
    pub fn stick(&self, process: u32, thread: u32) {
        let _ = Command::new(&self.stick).args([process.to_string(), thread.to_string()]).status();
    }
}

/// The processor time of each thread of a process so far [clock ticks], most first.
pub fn busiest_threads(process: u32) -> Vec<(u32, u64)> {
    let tasks = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let mut threads: Vec<(u32, u64)> = tasks
        .filter_map(|task| {
            let stat = fs::read_to_string(task.path().join("stat")).ok()?;
            // The name, in parentheses, may hold anything.
            let (_, fields) = stat.rsplit_once(')')?;
            let time: Vec<u64> = fields.split_whitespace().skip(11).take(2).flat_map(str::parse).collect();
            Some((task.file_name().to_str()?.parse().ok()?, time.iter().sum()))
        })
        .collect();
    threads.sort_unstable_by_key(|&(_, time)| std::cmp::Reverse(time));
    threads
}
