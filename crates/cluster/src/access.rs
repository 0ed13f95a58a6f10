//! The access file: the coordinator's address, and the key that lets workers in.

use std::fs::OpenOptions;
use std::io::{self, Read, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

/// No access file is longer [bytes].
const LONGEST: u64 = 1 << 16;

/// The contents of an access file (JSON, readable by its owner only).
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Access {
    /// The coordinator's address as host:port.
    pub address: String,
    /// A random name of this run of a coordinator.
    pub run: String,
    /// The version and commit of the coordinator, the only build that may join.
    pub build: String,
    /// The hash of the scene, in hexadecimal.
    pub scene: String,
    /// The key: 32 random bytes in hexadecimal; it is never sent.
    key: String,
}

/// 32 bytes from the operating system's generator.
///
/// # Errors
/// Where the operating system has none to give.
pub fn random_bytes() -> io::Result<[u8; 32]> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|error| io::Error::other(error.to_string()))?;
    Ok(bytes)
}

fn hexadecimal(bytes: [u8; 32]) -> String {
    blake3::Hash::from(bytes).to_hex().to_string()
}

impl Access {
    /// A fresh key for a coordinator of this `build` at `address`, whose scene has this hash.
    ///
    /// # Errors
    /// Where there is no randomness.
    pub fn new(address: String, build: &str, scene_hash: [u8; 32]) -> io::Result<Self> {
        Ok(Access {
            address,
            run: hexadecimal(random_bytes()?)[..16].into(),
            build: build.into(),
            scene: hexadecimal(scene_hash),
            key: hexadecimal(random_bytes()?),
        })
    }

    /// Writes the file, readable by its owner only. It appears whole: workers may be waiting for it. Returns the address in the file that it
    /// replaces, where another coordinator has left one.
    ///
    /// # Errors
    /// Where the file cannot be written, and where another file has the name.
    pub fn write(&self, path: &Path) -> io::Result<Option<String>> {
        let replaced = replaced_address(path)?;
        let mut draft = path.as_os_str().to_owned();
        draft.push(format!(".{}.tmp", std::process::id()));
        // A process of this number that was killed may have left the file: in a container all processes have the same number.
        let _ = std::fs::remove_file(&draft);
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let written = options
            .open(&draft)
            .and_then(|mut file| file.write_all(&self.to_bytes()))
            .and_then(|()| std::fs::rename(&draft, path));
        if written.is_err() {
            // The failure above is what matters.
            let _ = std::fs::remove_file(&draft);
        }
        written.map(|()| replaced)
    }

    /// Removes the file if it is still that of this run: another coordinator may have written its own meanwhile.
    ///
    /// # Errors
    /// Where it cannot be read or removed.
    pub fn remove(&self, path: &Path) -> io::Result<()> {
        if Access::read(path)?.run == self.run { std::fs::remove_file(path) } else { Ok(()) }
    }

    /// Reads what [`Access::write`] wrote.
    ///
    /// # Errors
    /// Where there is no such file or it is something else.
    pub fn read(path: &Path) -> io::Result<Self> {
        Access::read_from(std::fs::File::open(path)?)
    }

    /// Reads an access file from a stream, such as standard input.
    ///
    /// # Errors
    /// Where that fails, or something else comes.
    pub fn read_from(source: impl Read) -> io::Result<Self> {
        let mut bytes = Vec::new();
        source.take(LONGEST).read_to_end(&mut bytes)?;
        Access::from_bytes(&bytes)
    }

    /// The content of the access file.
    pub fn to_bytes(&self) -> Vec<u8> {
        serde_json::to_vec_pretty(self).expect("strings are JSON")
    }

    /// Reads what [`Access::to_bytes`] returned.
    fn from_bytes(bytes: &[u8]) -> io::Result<Self> {
        let access: Access = serde_json::from_slice(bytes)?;
        blake3::Hash::from_hex(&access.key).map_err(|_| {
            io::Error::new(io::ErrorKind::InvalidData, "the key is not 64 hexadecimal digits")
        })?;
        Ok(access)
    }

    /// The key as bytes.
    pub(crate) fn key(&self) -> [u8; 32] {
        *blake3::Hash::from_hex(&self.key).expect("checked when the access was made").as_bytes()
    }

    /// Everything beside the key that both ends must have read alike.
    pub(crate) fn prologue(&self) -> Vec<u8> {
        let Access { run, build, scene, .. } = self;
        format!("radwalk\n{run}\n{build}\n{scene}").into_bytes()
    }
}

/// The address in the access file that a new one replaces, which may be of another build; `None` where there is no file yet.
fn replaced_address(path: &Path) -> io::Result<Option<String>> {
    let mut bytes = Vec::new();
    match std::fs::File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        file => file?.take(LONGEST).read_to_end(&mut bytes)?,
    };
    let value: serde_json::Value = serde_json::from_slice(&bytes).unwrap_or_default();
    match (value["address"].as_str(), value["key"].as_str()) {
        (Some(address), Some(_)) => Ok(Some(address.into())),
        _ => Err(io::Error::new(io::ErrorKind::AlreadyExists, "there is a file that is no access file")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_back_private_and_replaces_what_was_there() {
        let path = std::env::temp_dir().join(format!("radwalk-access-{}.json", std::process::id()));
        std::fs::write(&path, "{ \"address\": \"nowhere:1\", \"key\": \"short\" }").unwrap();
        assert_eq!(Access::read(&path).err().unwrap().kind(), io::ErrorKind::InvalidData);
        let access = Access::new("somewhere:2".into(), "1.0 (abc)", [7; 32]).unwrap();
        // A process that was killed here, and had this one's number.
        std::fs::write(format!("{}.{}.tmp", path.display(), std::process::id()), "{").unwrap();
        assert_eq!(access.write(&path).unwrap().as_deref(), Some("nowhere:1"));
        let read = Access::read(&path).unwrap();
        assert_eq!((&read.address, read.key()), (&access.address, access.key()));
        assert_eq!(read.prologue(), access.prologue());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        let other = Access::new("somewhere:3".into(), "1.0 (abc)", [7; 32]).unwrap();
        other.remove(&path).unwrap();
        assert!(path.exists(), "it is not that of the other run");
        let spoilt = std::fs::read_to_string(&path).unwrap().replace(&access.key, "short");
        std::fs::write(&path, spoilt).unwrap();
        assert!(Access::read(&path).err().unwrap().to_string().contains("64 hexadecimal digits"));
        std::fs::write(&path, "scene = \"room.toml\"").unwrap();
        assert_eq!(access.write(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read(&path).unwrap(), b"scene = \"room.toml\"", "it is no access file");
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn every_run_has_its_own_key_and_name() {
        let [one, other] = [(); 2].map(|()| Access::new("a:1".into(), "1.0", [7; 32]).unwrap());
        assert_ne!(one.key(), other.key());
        assert_ne!(one.run, other.run);
    }
}
