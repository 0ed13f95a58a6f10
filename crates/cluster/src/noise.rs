//! Authentication and encryption of connections: the Noise protocol (noiseprotocol.org, revision 34) by the pattern
//! NNpsk0, with the key of the access file as pre-shared key.
//!
//! The worker speaks first. Its message can only be made with the key, so that a coordinator refuses a stranger before
//! it computes with curves; the answer can only be made with the key, too. Keys for the traffic come from two fresh
//! ephemeral ones: an attacker that learns the access file's key later cannot read recorded traffic. A worker's first
//! message may be a replay; the attacker that replays it cannot read the answer, and so cannot send anything that
//! opens.
//!
//! Traffic is a stream of records: a 16-bit little-endian length, and that many bytes of one Noise message. Each end
//! numbers its records, and a record opens only with its own number: a record that was altered, replayed, left out or
//! moved does not open.

use std::sync::Arc;

use snow::{Builder, HandshakeState, StatelessTransportState};

use crate::access::Access;
use protocol::Foreign;

/// The Noise pattern: Curve25519, ChaCha20 with Poly1305, and BLAKE2s are all fast without special instructions.
const PATTERN: &str = "Noise_NNpsk0_25519_ChaChaPoly_BLAKE2s";

/// The bytes that a record takes beyond its content.
const TAG_BYTES: usize = 16;

/// The bytes at the start of a record: its length, little-endian.
const LENGTH_BYTES: usize = 2;

/// The most content of a record in bytes. Noise allows 65,519, but each connection has to keep a record.
pub const RECORD_CONTENT: usize = 1 << 14;

/// The bytes of each message of a handshake: a public key and a tag.
const HANDSHAKE_BYTES: usize = 32 + TAG_BYTES;

/// The bytes of a handshake's message with its length.
pub const HANDSHAKE_RECORD: usize = LENGTH_BYTES + HANDSHAKE_BYTES;

/// The answer to a first message that was not made with the key.
pub const NO_ENTRY: [u8; LENGTH_BYTES] = [0; LENGTH_BYTES];

/// One end of a finished handshake.
#[derive(Debug)]
pub struct SecureSession {
    /// The sealer of what is sent.
    pub sealer: Sealer,
    /// The opener of what arrives.
    pub opener: Opener,
}

impl SecureSession {
    fn new(handshake: HandshakeState) -> Self {
        let cipher =
            Arc::new(handshake.into_stateless_transport_mode().expect("both messages have been exchanged"));
        SecureSession {
            sealer: Sealer { cipher: cipher.clone(), records: 0 },
            opener: Opener { cipher, records: 0 },
        }
    }
}

/// A worker that has sent its first message.
pub struct Greeting(HandshakeState);

impl Greeting {
    /// The state of a worker, and its first record.
    pub fn new(access: &Access) -> (Self, [u8; HANDSHAKE_RECORD]) {
        let mut handshake = begin(access, |builder| builder.build_initiator());
        let record = handshake_record(&mut handshake);
        (Greeting(handshake), record)
    }

    /// The number of bytes of the answer, by its first two bytes.
    ///
    /// # Errors
    /// Where it is none, or says that our key is wrong.
    pub fn answer_bytes(length: [u8; LENGTH_BYTES]) -> Result<usize, Foreign> {
        match usize::from(u16::from_le_bytes(length)) {
            0 => Err(Foreign::NoEntry),
            HANDSHAKE_BYTES => Ok(HANDSHAKE_BYTES),
            _ => Err(Foreign::Tongue),
        }
    }

    /// Reads the coordinator's answer, without its length.
    ///
    /// # Errors
    /// Where it was not made with our key.
    pub fn finish(mut self, answer: &[u8]) -> Result<SecureSession, Foreign> {
        self.0.read_message(answer, &mut []).map_err(|_| Foreign::Key)?;
        Ok(SecureSession::new(self.0))
    }
}

/// Reads a worker's first record. Returns the coordinator's session and its answer.
///
/// # Errors
/// Where it is none, or was not made with our key.
pub fn answer(
    access: &Access,
    record: &[u8; HANDSHAKE_RECORD],
) -> Result<(SecureSession, [u8; HANDSHAKE_RECORD]), Foreign> {
    let (length, message) = record.split_at(LENGTH_BYTES);
    if !speaks(length) {
        return Err(Foreign::Tongue);
    }
    let mut handshake = begin(access, |builder| builder.build_responder());
    handshake.read_message(message, &mut []).map_err(|_| Foreign::Key)?;
    let record = handshake_record(&mut handshake);
    Ok((SecureSession::new(handshake), record))
}

/// Whether a first record can begin with these bytes.
pub fn speaks(bytes: &[u8]) -> bool {
    let length = (HANDSHAKE_BYTES as u16).to_le_bytes();
    bytes.iter().zip(&length).all(|(byte, expected)| byte == expected)
}

fn begin(
    access: &Access,
    build: impl FnOnce(Builder) -> Result<HandshakeState, snow::Error>,
) -> HandshakeState {
    let (key, prologue) = (access.key(), access.prologue());
    let pattern = PATTERN.parse().expect("snow knows this pattern");
    Builder::new(pattern)
        .psk(0, &key)
        .and_then(|builder| builder.prologue(&prologue))
        .and_then(build)
        .expect("the pattern takes one pre-shared key and no other")
}

/// The next message of this end in a handshake.
fn handshake_record(handshake: &mut HandshakeState) -> [u8; HANDSHAKE_RECORD] {
    let mut record = [0; HANDSHAKE_RECORD];
    record[..LENGTH_BYTES].copy_from_slice(&(HANDSHAKE_BYTES as u16).to_le_bytes());
    let written = handshake.write_message(&[], &mut record[LENGTH_BYTES..]);
    assert_eq!(written, Ok(HANDSHAKE_BYTES), "a key and a tag");
    record
}

/// Seals the records that are sent.
pub struct Sealer {
    cipher: Arc<StatelessTransportState>,
    records: u64,
}

impl Sealer {
    /// Seals a record and adds it to `wire`.
    ///
    /// # Panics
    /// Where the content is longer than [`RECORD_CONTENT`].
    pub fn seal(&mut self, content: &[u8], wire: &mut Vec<u8>) {
        assert!(content.len() <= RECORD_CONTENT, "the caller cuts what it sends");
        let length = content.len() + TAG_BYTES;
        wire.extend((length as u16).to_le_bytes());
        let start = wire.len();
        wire.resize(start + length, 0);
        let sealed = self.cipher.write_message(self.records, content, &mut wire[start..]);
        assert_eq!(sealed, Ok(length), "there is room, and 2⁶⁴ records are never sent");
        self.records += 1;
    }

    /// Seals a whole frame and adds its records to `wire`.
    pub fn seal_all(&mut self, frame: &[u8], wire: &mut Vec<u8>) {
        frame.chunks(RECORD_CONTENT).for_each(|content| self.seal(content, wire));
    }
}

/// Opens the records that arrive.
pub struct Opener {
    cipher: Arc<StatelessTransportState>,
    records: u64,
}

impl Opener {
    /// Opens the first record in `wire` and adds its content to `content`. Returns the number of bytes of `wire` that
    /// it took; `None` if the record is not complete yet.
    ///
    /// # Errors
    /// Where it is not the next record of the other end.
    pub fn open(&mut self, wire: &[u8], content: &mut Vec<u8>) -> Result<Option<usize>, Foreign> {
        let Some((&length, rest)) = wire.split_first_chunk::<LENGTH_BYTES>() else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes(length));
        if !(TAG_BYTES + 1..=TAG_BYTES + RECORD_CONTENT).contains(&length) {
            return Err(Foreign::Length(length));
        }
        let Some(sealed) = rest.get(..length) else { return Ok(None) };
        let start = content.len();
        content.resize(start + length - TAG_BYTES, 0);
        if self.cipher.read_message(self.records, sealed, &mut content[start..]).is_err() {
            content.truncate(start);
            return Err(Foreign::Altered);
        }
        self.records += 1;
        Ok(Some(LENGTH_BYTES + length))
    }
}

impl std::fmt::Debug for Sealer {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Sealer({} records)", self.records)
    }
}

impl std::fmt::Debug for Opener {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Opener({} records)", self.records)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access() -> Access {
        Access::new("nowhere:1".into(), "1.0", [7; 32]).unwrap()
    }

    fn sessions(access: &Access) -> (SecureSession, SecureSession) {
        let (greeting, first) = Greeting::new(access);
        let (theirs, second) = answer(access, &first).unwrap();
        assert_eq!(Greeting::answer_bytes([second[0], second[1]]), Ok(HANDSHAKE_BYTES));
        (greeting.finish(&second[LENGTH_BYTES..]).unwrap(), theirs)
    }

    #[test]
    fn both_ends_read_each_other_and_no_third_party_reads_them() {
        let (mut worker, mut coordinator) = sessions(&access());
        let (mut wire, mut content) = (Vec::new(), Vec::new());
        let words = b"four score and seven".repeat(3000);
        worker.sealer.seal_all(&words, &mut wire);
        assert!(!wire.windows(8).any(|bytes| bytes == &words[..8]), "it is sealed");
        let mut at = 0;
        while let Some(taken) = coordinator.opener.open(&wire[at..], &mut content).unwrap() {
            at += taken;
        }
        assert_eq!((at, &content), (wire.len(), &words));
        let (mut back, mut heard) = (Vec::new(), Vec::new());
        coordinator.sealer.seal(b"yes", &mut back);
        worker.opener.open(&back, &mut heard).unwrap();
        assert_eq!(heard, b"yes");
    }

    #[test]
    fn another_key_run_build_or_scene_is_found_out_by_either_end() {
        let ours = access();
        let [mut run, mut build, mut scene] = [(); 3].map(|()| ours.clone());
        (run.run, build.build, scene.scene) = ("another".into(), "1.1".into(), "another".into());
        let others = [access(), run, build, scene];
        for other in others {
            let (_, first) = Greeting::new(&other);
            assert_eq!(answer(&ours, &first).err(), Some(Foreign::Key));
            // An impostor has seen our first message, but has another key for its answer.
            let (greeting, _) = Greeting::new(&ours);
            let (_, second) = answer(&other, &first).unwrap();
            assert_eq!(greeting.finish(&second[LENGTH_BYTES..]).err(), Some(Foreign::Key));
        }
        assert_eq!(Greeting::answer_bytes(NO_ENTRY), Err(Foreign::NoEntry));
        assert_eq!(Greeting::answer_bytes(*b"HT"), Err(Foreign::Tongue));
        assert_eq!(answer(&ours, &[b'G'; HANDSHAKE_RECORD]).err(), Some(Foreign::Tongue));
    }

    #[test]
    fn a_replayed_first_message_lets_the_attacker_send_nothing() {
        let access = access();
        let (greeting, first) = Greeting::new(&access);
        let (mut theirs, second) = answer(&access, &first).unwrap();
        let mut worker = greeting.finish(&second[LENGTH_BYTES..]).unwrap();
        let mut said = Vec::new();
        worker.sealer.seal(b"hello", &mut said);
        let (mut replayed, _) = answer(&access, &first).unwrap();
        assert_eq!(replayed.opener.open(&said, &mut Vec::new()), Err(Foreign::Altered));
        assert_eq!(theirs.opener.open(&said, &mut Vec::new()), Ok(Some(said.len())));
    }

    #[test]
    fn no_bit_can_be_changed_and_no_record_replayed_dropped_or_moved() {
        let (mut worker, coordinator) = sessions(&access());
        let [mut first, mut second] = [Vec::new(), Vec::new()];
        worker.sealer.seal(b"first", &mut first);
        worker.sealer.seal(b"second", &mut second);
        let fresh = || Opener { cipher: coordinator.opener.cipher.clone(), records: 0 };
        for bit in 0..8 * first.len() {
            let mut changed = first.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            // A length that grew waits for bytes that belong to the next record, and fails then.
            changed.extend(&second);
            changed.resize(1 << 17, 0);
            assert!(fresh().open(&changed, &mut Vec::new()).is_err(), "bit {bit}");
        }
        let mut opener = fresh();
        let mut content = Vec::new();
        assert_eq!(opener.open(&second, &mut content), Err(Foreign::Altered), "dropped or moved");
        opener.open(&first, &mut content).unwrap();
        assert_eq!(opener.open(&first, &mut content), Err(Foreign::Altered), "replayed");
        opener.open(&second, &mut content).unwrap();
        assert_eq!(content, b"firstsecond");
    }

    #[test]
    fn lengths_that_no_record_has_are_refused_at_once() {
        let (_, mut coordinator) = sessions(&access());
        for length in [0, 1, 16, (RECORD_CONTENT + 17) as u16, u16::MAX] {
            let opened = coordinator.opener.open(&length.to_le_bytes(), &mut Vec::new());
            assert_eq!(opened, Err(Foreign::Length(length.into())));
        }
        assert_eq!(coordinator.opener.open(&[], &mut Vec::new()), Ok(None));
        assert_eq!(coordinator.opener.open(&[17], &mut Vec::new()), Ok(None));
    }
}
