//! Files that exist whole or not at all, even after a power cut.

use std::fs;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use job::{Keyword, OutputFile};
use tempfile::{Builder, NamedTempFile};

use crate::error::Error;

/// What marks a file that is still being written; one that a crash leaves behind is recognised by it.
const TEMPORARY: (&str, &str) = (".radwalk-", ".tmp");

/// What commands write into an output folder beside the files that a job may choose; all of them may stand beside each other. Several names of one
/// kind are in one line.
const OWN_FILES: &str = "tally.bin tally.previous.bin partition.toml pilot.bin pilot.arrivals.bin round.bin
    sensors.csv sources.csv sensitivities.csv planes.csv planes.svg planes.png
    access.json status.json access.status.json
    exact.csv exact_r.csv exact_g.csv exact_b.csv
    exact.json exact_r.json exact_g.json exact_b.json
    exact-factors.csv exact-factors_r.csv exact-factors_g.csv exact-factors_b.csv
    factors.csv factors.json factors.counts.json factors.rows groups.csv thermal.csv
    factors.mtx factors.npz smoothed.npz factors.parquet factors.vf factors.idf
    vfsparse.inp svf.inp vf.nc.inp F globalFaceFaces subMap constructMap constructMapDim
    annual.csv annual.ill annual-error.ill coefficients.mtx coefficients.float.mtx
    daylight.json daylight.counts.json daylight.npz daylight.parquet calendar.svg maps.svg
    polar.svg";

/// Writes a file through a temporary one in the same folder: a reader sees the old content or the whole new
/// one, and what was written survives a loss of power once this returns.
///
/// # Errors
/// What the writer returns, or the operating system; an earlier file is then untouched.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
) -> Result<(), Error> {
    replace_atomically(path, None, write, |_| Ok(()))
}

/// Writes a file as [`write_atomically`] does, but a loss of power may take it back: for what is soon written again.
///
/// # Errors
/// What the operating system says; an earlier file is then untouched.
pub fn write_soon(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = temporary_in(folder_of(path))?;
    file.write_all(bytes)?;
    file.persist(path)?;
    Ok(())
}

/// Writes a file as [`write_atomically`] does; an earlier file of that name becomes the `previous` one. At any moment both are there whole. What
/// was written is given to `prove` from its beginning, before it takes the place of anything.
///
/// # Errors
/// What the writer or `prove` returns, or the operating system; earlier files are then untouched.
pub fn replace_atomically(
    path: &Path,
    previous: Option<&Path>,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
    prove: impl FnOnce(&fs::File) -> io::Result<()>,
) -> Result<(), Error> {
    let folder = folder_of(path);
    let save = || {
        let file = temporary_in(folder)?;
        let mut writer = BufWriter::with_capacity(1 << 18, file.as_file());
        write(&mut writer)?;
        writer.flush()?;
        drop(writer);
        file.as_file().sync_all()?;
        file.as_file().rewind()?;
        prove(file.as_file())?;
        if let Some(previous) = previous
            && path.exists()
        {
            keep_as(path, previous)?;
        }
        file.persist(path)?;
        sync_folder(folder)
    };
    save().map_err(Error::io("write", path))
}

/// Gives a file a second name in place of what has it, so that it is never without one.
fn keep_as(path: &Path, previous: &Path) -> io::Result<()> {
    let draft = Builder::new()
        .prefix(TEMPORARY.0)
        .suffix(TEMPORARY.1)
        .make_in(folder_of(previous), |draft| fs::hard_link(path, draft));
    match draft {
        Ok(draft) => Ok(draft.into_temp_path().persist(previous)?),
        // Some file systems have no second names: there is a moment without the first one then.
        Err(_) => fs::rename(path, previous),
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A temporary file with the permissions of any other new file (the default would be private).
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Makes a rename durable. Only Unix opens folders as files; elsewhere the file system sees to it.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Makes a folder, and those around it that are not there. All of them outlast a loss of power, as far as the disk can sync: one that cannot says so when the
/// first file is kept.
fn make_folder(path: &Path) -> io::Result<()> {
    let around = folder_of(path);
    if !path.is_dir() {
        if around != path {
            make_folder(around)?;
        }
        match fs::create_dir(path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => {}
            made => made?,
        }
    }
    // Also where it was there: another process may have been killed before it got here.
    let _ = sync_folder(around);
    Ok(())
}

/// The folder that the results of one run go to.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// Held as long as this process may write there.
    lock: Mutex<Option<fs::File>>,
}

/// A file that is written and not yet in its place.
pub struct Draft {
    file: NamedTempFile,
    path: PathBuf,
}

impl Draft {
    /// Puts it in its place.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn place(self) -> Result<(), Error> {
        let Draft { file, path } = self;
        file.persist(&path).map(drop).map_err(|error| error.error).map_err(Error::io("write", &path))
    }
}

impl OutputFolder {
    /// Claims a folder for the `files` that one command will write, and makes it, its parents too. Results of
    /// other commands may stand beside them (`exact.csv` next to those of a run). With `force`, earlier results
    /// are replaced, each when its successor is written and not before; nothing else is touched.
    ///
    /// # Errors
    /// Where one of `files`, or anything that radwalk did not write, is there and `force` is not given; where
    /// the path is a file; where another process writes there; and where the operating system refuses.
    pub fn claim(path: &Path, files: &[&str], force: bool) -> Result<Self, Error> {
        if path.exists() && !path.is_dir() {
            return Err(Error::NotAFolder { path: path.to_path_buf() });
        }
        make_folder(path).map_err(Error::io("create", path))?;
        let lock = lock(path)?;
        let entries = entries(path).map_err(Error::io("read", path))?;
        let in_the_way = |entry: &PathBuf| !is_own(entry) || files.iter().any(|file| entry.ends_with(file));
        if !force && entries.iter().any(in_the_way) {
            return Err(Error::OutputExists { path: path.to_path_buf() });
        }
        // A folder that cannot be written to is refused before hours of walks, not behind them.
        temporary_in(path).map_err(Error::io("write to", path))?;
        for entry in entries.iter().filter(|entry| is_temporary(entry)) {
            fs::remove_file(entry).map_err(Error::io("remove", entry))?;
        }
        Ok(OutputFolder { path: path.to_path_buf(), lock: Mutex::new(lock) })
    }

    /// Sees to it that the folder is still the one that was claimed: writing goes by its path. One that was removed is made
    /// and claimed again.
    ///
    /// # Errors
    /// Where another folder has its path, or the operating system refuses.
    pub fn keep_hold(&self) -> Result<(), Error> {
        let mut held = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(folder) = &*held else { return Ok(()) };
        if !self.path.exists() {
            make_folder(&self.path).map_err(Error::io("create", &self.path))?;
            *held = lock(&self.path)?;
            return Ok(());
        }
        let is_same = is_same(folder, &self.path).map_err(Error::io("read", &self.path))?;
        if is_same { Ok(()) } else { Err(Error::Replaced { path: self.path.clone() }) }
    }

    /// Writes a file beside the others, to be placed when all that belong together are written.
    ///
    /// # Errors
    /// What the writer returns, or the operating system.
    pub fn draft(
        &self,
        name: &str,
        write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
    ) -> Result<Draft, Error> {
        let path = self.file(name);
        let draft = || {
            let file = temporary_in(&self.path)?;
            let mut writer = BufWriter::with_capacity(1 << 18, file.as_file());
            write(&mut writer)?;
            writer.flush()?;
            drop(writer);
            file.as_file().sync_all()?;
            Ok(file)
        };
        let file = draft().map_err(Error::io("write", &path))?;
        Ok(Draft { file, path })
    }

    /// Makes what was placed durable.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn sync(&self) -> Result<(), Error> {
        sync_folder(&self.path).map_err(Error::io("write", &self.path))
    }

    /// Removes files of results, where they are there.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn remove(&self, names: &[&str]) -> Result<(), Error> {
        for name in names {
            match fs::remove_file(self.file(name)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(Error::io("remove", &self.file(name))(error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of a file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes one file of the folder, atomically.
    ///
    /// # Errors
    /// As [`write_atomically`].
    pub fn write(
        &self,
        name: &str,
        write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
    ) -> Result<(), Error> {
        write_atomically(&self.file(name), write)
    }
}

/// Keeps other processes from writing into a folder until the lock is dropped, or this process dies. Only Unix opens
/// folders as files, and not every file system has locks: nothing is held then.
fn lock(path: &Path) -> Result<Option<fs::File>, Error> {
    if !cfg!(unix) {
        return Ok(None);
    }
    let folder = fs::File::open(path).map_err(Error::io("open", path))?;
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(fs::TryLockError::WouldBlock) => Err(Error::InUse { path: path.to_path_buf() }),
        Err(fs::TryLockError::Error(_)) => Ok(None),
    }
}

/// Whether an open folder is the one at a path.
#[cfg(unix)]
fn is_same(folder: &fs::File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let (held, there) = (folder.metadata()?, fs::metadata(path)?);
    Ok((held.dev(), held.ino()) == (there.dev(), there.ino()))
}

/// Elsewhere no folder is held.
#[cfg(not(unix))]
fn is_same(_: &fs::File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect()
}

/// Whether radwalk wrote this: a regular file of a name of its own.
fn is_own(path: &Path) -> bool {
    let chosen = OutputFile::ALL.iter().map(|file| file.name());
    let is_result = OWN_FILES.split_whitespace().chain(chosen).any(|name| path.ends_with(name));
    (is_result || is_temporary(path) || is_of_view(path)) && !path.is_dir()
}

/// Whether this is a picture of a view with a name.
fn is_of_view(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let rest = name.strip_prefix("radiosity-");
    rest.is_some_and(|rest| rest.ends_with(".png") || rest.ends_with(".exr"))
}

/// Whether this is what a crash left of a file that was being written.
fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1) && path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    fn write_text(path: &Path, text: &str) -> Result<(), Error> {
        write_atomically(path, |writer| writer.write_all(text.as_bytes()))
    }

    #[test]
    fn a_file_is_replaced_whole_and_leaves_no_temporary_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("summary.json");
        write_text(&path, "old, and longer than the new").unwrap();
        write_text(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(entries(dir.path()).unwrap(), [path]);
    }

    #[test]
    fn a_writer_that_fails_leaves_the_old_file_untouched() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("summary.json");
        write_text(&path, "old").unwrap();
        let error = write_atomically(&path, |writer| {
            writer.write_all(b"half of the ne")?;
            Err(io::Error::other("disk full"))
        })
        .unwrap_err();
        assert!(error.to_string().contains("summary.json: disk full"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(entries(dir.path()).unwrap(), [path]);
    }

    #[test]
    fn the_file_before_is_kept_where_that_is_asked_for() {
        let dir = tempfile::tempdir().unwrap();
        let (path, previous) = (dir.path().join("tally.bin"), dir.path().join("tally.previous.bin"));
        for text in ["first", "second", "third"] {
            let write = |writer: &mut BufWriter<&fs::File>| writer.write_all(text.as_bytes());
            replace_atomically(&path, Some(&previous), write, |_| Ok(())).unwrap();
        }
        let full = || Err(io::Error::other("disk full"));
        assert!(replace_atomically(&path, Some(&previous), |_| full(), |_| Ok(())).is_err());
        let prove = |mut file: &fs::File| {
            let mut text = String::new();
            file.read_to_string(&mut text)?;
            assert_eq!(text, "fourth", "from its beginning");
            full()
        };
        assert!(replace_atomically(&path, Some(&previous), |file| file.write_all(b"fourth"), prove).is_err());
        let text = |path: &Path| fs::read_to_string(path).unwrap();
        assert_eq!((text(&path), text(&previous)), ("third".into(), "second".into()));
        assert_eq!(entries(dir.path()).unwrap().len(), 2);
    }

    #[test]
    fn a_file_that_is_replaced_is_there_all_the_time() {
        let dir = tempfile::tempdir().unwrap();
        let (path, previous) = (dir.path().join("tally.bin"), dir.path().join("tally.previous.bin"));
        write_text(&path, "first").unwrap();
        keep_as(&path, &previous).unwrap();
        let text = |path: &Path| fs::read_to_string(path).unwrap();
        assert_eq!((text(&path), text(&previous)), ("first".into(), "first".into()));
    }

    #[test]
    fn a_folder_is_claimed_by_one_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let first = OutputFolder::claim(dir.path(), &["tally.bin"], false).unwrap();
        let second = OutputFolder::claim(dir.path(), &["tally.bin"], true);
        assert!(matches!(second, Err(Error::InUse { .. })));
        drop(first);
        OutputFolder::claim(dir.path(), &["tally.bin"], true).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_is_replaced_under_a_run_is_not_written_to_and_one_that_is_gone_is_made_again() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out");
        let ours = OutputFolder::claim(&path, &["tally.bin"], false).unwrap();
        ours.keep_hold().unwrap();
        fs::remove_dir_all(&path).unwrap();
        ours.keep_hold().unwrap();
        assert!(matches!(OutputFolder::claim(&path, &["tally.bin"], true), Err(Error::InUse { .. })));
        fs::remove_dir_all(&path).unwrap();
        let _theirs = OutputFolder::claim(&path, &["tally.bin"], false).unwrap();
        assert!(matches!(ours.keep_hold(), Err(Error::Replaced { .. })));
    }

    #[test]
    fn files_that_belong_together_take_their_places_when_all_are_written() {
        let dir = tempfile::tempdir().unwrap();
        let folder = OutputFolder::claim(dir.path(), &["patches.csv"], false).unwrap();
        folder.write("patches.csv", |writer| writer.write_all(b"old")).unwrap();
        let table = folder.draft("patches.csv", |writer| writer.write_all(b"new")).unwrap();
        assert!(folder.draft("summary.json", |_| Err(io::Error::other("disk full"))).is_err());
        assert_eq!(fs::read(folder.file("patches.csv")).unwrap(), b"old");
        table.place().unwrap();
        folder.sync().unwrap();
        assert_eq!(fs::read(folder.file("patches.csv")).unwrap(), b"new");
        folder.remove(&["patches.csv", "summary.json"]).unwrap();
        assert_eq!(entries(dir.path()).unwrap(), [] as [PathBuf; 0]);
    }

    #[test]
    fn an_error_names_the_file_that_could_not_be_written() {
        let error = write_text(Path::new("/nonexistent-folder/patches.csv"), "").unwrap_err();
        assert!(error.to_string().starts_with("cannot write /nonexistent-folder/patches.csv: "), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn files_get_the_permissions_that_other_new_files_get() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let [ours, plain] = ["patches.csv", "plain"].map(|name| dir.path().join(name));
        write_text(&ours, "x").unwrap();
        fs::write(&plain, "x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn a_new_output_folder_gets_its_parents() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out/cornell");
        let folder = OutputFolder::claim(&path, &["patches.csv"], false).unwrap();
        folder.write("patches.csv", |writer| writer.write_all(b"patch\n")).unwrap();
        assert_eq!(fs::read(path.join("patches.csv")).unwrap(), b"patch\n");
        assert_eq!(folder.file("patches.csv"), folder.path().join("patches.csv"));
    }

    #[test]
    fn a_folder_that_holds_the_results_of_such_a_command_is_refused_and_kept() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("tally.bin"), "precious").unwrap();
        let error = OutputFolder::claim(dir.path(), &["tally.bin", "patches.csv"], false).unwrap_err();
        assert!(matches!(error, Error::OutputExists { .. }));
        assert!(error.to_string().contains("--force"), "{error}");
        OutputFolder::claim(dir.path(), &["exact.csv"], false).unwrap();
        OutputFolder::claim(dir.path(), &["tally.bin"], true).unwrap();
        assert_eq!(fs::read_to_string(dir.path().join("tally.bin")).unwrap(), "precious");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_cannot_be_written_to_is_refused_at_once() {
        let error = OutputFolder::claim(Path::new("/proc/self"), &[], true).unwrap_err();
        assert!(error.to_string().starts_with("cannot write to /proc/self: "), "{error}");
    }

    #[test]
    fn a_folder_of_other_things_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("notes.txt"), "mine").unwrap();
        let error = OutputFolder::claim(dir.path(), &["patches.csv"], false).unwrap_err();
        assert!(matches!(error, Error::OutputExists { .. }));
    }

    #[test]
    fn what_a_crash_left_half_written_is_cleared_away_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["exact.csv", ".radwalk-a1b2c3.tmp", "notes.txt"] {
            fs::write(dir.path().join(name), "x").unwrap();
        }
        OutputFolder::claim(dir.path(), &["exact.csv"], true).unwrap();
        let mut left = entries(dir.path()).unwrap();
        left.sort();
        assert_eq!(left, ["exact.csv", "notes.txt"].map(|name| dir.path().join(name)));
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_refused_even_with_force() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("out");
        fs::write(&path, "x").unwrap();
        assert!(matches!(OutputFolder::claim(&path, &["patches.csv"], true), Err(Error::NotAFolder { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), "x");
    }
}
