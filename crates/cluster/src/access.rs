//! The access file: where the coordinator listens and the key that lets workers in.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::message::Proof;

/// The contents of an access file (JSON, readable by its owner only).
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Access {
    /// host:port of the coordinator.
    pub address: String,
    /// 32 random bytes in hexadecimal; never sent, only proved.
    key: String,
}

/// A key that says which end speaks, so that no proof can be sent back to its maker.
#[derive(Clone, Copy, Debug)]
pub enum Speaker {
    /// The worker's proof over the coordinator's nonce.
    Worker,
    /// The coordinator's proof over the worker's nonce.
    Coordinator,
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

impl Access {
    /// A fresh key for a coordinator at `address`.
    ///
    /// # Errors
    /// Where there is no randomness.
    pub fn new(address: String) -> io::Result<Self> {
        Ok(Access { address, key: blake3::Hash::from(random_bytes()?).to_hex().to_string() })
    }

    /// Writes the file, readable by its owner only. It appears whole: workers may be waiting for it.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let mut draft = path.as_os_str().to_owned();
        draft.push(format!(".{}.tmp", std::process::id()));
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let written = options
            .open(&draft)
            .and_then(|mut file| file.write_all(&serde_json::to_vec_pretty(self)?))
            .and_then(|()| std::fs::rename(&draft, path));
        if written.is_err() {
            // The failure above is what matters.
            let _ = std::fs::remove_file(&draft);
        }
        written
    }

    /// Reads what [`Access::write`] wrote.
    ///
    /// # Errors
    /// Where there is no such file or it is something else.
    pub fn read(path: &Path) -> io::Result<Self> {
        let access: Access = serde_json::from_slice(&std::fs::read(path)?)?;
        blake3::Hash::from_hex(&access.key).map_err(|_| {
            io::Error::new(io::ErrorKind::InvalidData, "the key is not 64 hexadecimal digits")
        })?;
        Ok(access)
    }

    /// Proves knowledge of the key to whoever chose the nonce.
    pub fn prove(&self, speaker: Speaker, nonce: &Proof) -> Proof {
        *self.tag(speaker, nonce).as_bytes()
    }

    /// Whether a proof holds; takes the same time either way.
    pub fn holds(&self, speaker: Speaker, nonce: &Proof, proof: &Proof) -> bool {
        self.tag(speaker, nonce) == blake3::Hash::from(*proof)
    }

    fn tag(&self, speaker: Speaker, nonce: &Proof) -> blake3::Hash {
        let role: &[u8] = match speaker {
            Speaker::Worker => b"radwalk worker",
            Speaker::Coordinator => b"radwalk coordinator",
        };
        let key = blake3::Hash::from_hex(&self.key).expect("checked when the access was made");
        let mut hasher = blake3::Hasher::new_keyed(key.as_bytes());
        hasher.update(role).update(nonce);
        hasher.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proofs_need_the_key_the_nonce_and_the_speaker() {
        let (ours, other) = (Access::new("a:1".into()).unwrap(), Access::new("a:1".into()).unwrap());
        let nonce = [7; 32];
        let proof = ours.prove(Speaker::Worker, &nonce);
        assert!(ours.holds(Speaker::Worker, &nonce, &proof));
        assert!(!ours.holds(Speaker::Coordinator, &nonce, &proof));
        assert!(!ours.holds(Speaker::Worker, &[8; 32], &proof));
        assert!(!other.holds(Speaker::Worker, &nonce, &proof));
    }

    #[test]
    fn a_file_is_read_back_private_and_replaces_what_was_there() {
        let path = std::env::temp_dir().join(format!("radwalk-access-{}.json", std::process::id()));
        std::fs::write(&path, "{ \"address\": \"nowhere:1\", \"key\": \"short\" }").unwrap();
        assert_eq!(Access::read(&path).err().unwrap().kind(), io::ErrorKind::InvalidData);
        let access = Access::new("somewhere:2".into()).unwrap();
        access.write(&path).unwrap();
        let read = Access::read(&path).unwrap();
        assert_eq!((&read.address, &read.key), (&access.address, &access.key));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        std::fs::remove_file(&path).unwrap();
    }
}
