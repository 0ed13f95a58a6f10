//! The one module that uses bincode, and the one that reads lengths from a socket.
//!
//! A frame is a 32-bit little-endian length and that many bytes of one bincode message (varint integers). Lengths are
//! checked against the reader's cap before anything is allocated, and bincode is bounded again: a message may claim to
//! hold far more than its bytes, and bincode allocates what it claims. Sums of tallies travel packed, one varint after
//! the other, so that no process has to hold them unpacked.

use std::io::{self, BufWriter};

use bincode::error::DecodeError;
use bincode::{Decode, Encode};
use thiserror::Error;

use crate::foreign::Foreign;

/// The longest frame that is ever read or written.
pub const MAX_FRAME: usize = 1 << 30;

/// The bytes at the start of a frame: the length of its message, little-endian.
const LENGTH_BYTES: usize = 4;

/// The longest frame of all messages but jobs and results.
pub const SHORT_FRAME: usize = 4096;

/// The most bytes of memory that a short frame may claim: a 128-bit number takes one byte at least.
const SHORT_CLAIM: usize = 16 * SHORT_FRAME;

/// The longest frame that a worker may send, whatever the job.
pub const LONG_FRAME: usize = 1 << 16;

/// The most bytes of memory that a long frame may claim.
const LONG_CLAIM: usize = 16 * LONG_FRAME;

/// The most bytes of one packed number.
pub const LONGEST_SUM: usize = 17;

fn config() -> impl bincode::config::Config {
    bincode::config::standard().with_limit::<MAX_FRAME>()
}

/// The reason why a message could not be read or written.
#[derive(Debug, Error)]
pub enum CodecError {
    /// The other end closed the connection, or its process died.
    #[error("the connection was closed")]
    Closed,
    /// The other end has neither sent nor taken anything for too long.
    #[error("the other end does not answer")]
    Silent,
    /// The operating system reported an error of the connection.
    #[error("the connection failed: {0}")]
    Io(io::Error),
    /// The bytes are not what the other end sent.
    #[error(transparent)]
    Foreign(#[from] Foreign),
    /// The peer announced a longer frame than it may send.
    #[error("a frame of {length} bytes exceeds the limit of {cap} (a foreign or faulty peer)")]
    TooLong {
        /// The announced length in bytes.
        length: usize,
        /// The longest frame that the reader allows, in bytes.
        cap: usize,
    },
    /// The bytes do not decode to a message.
    #[error("a frame does not decode ({0})")]
    Malformed(String),
}

impl From<io::Error> for CodecError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => CodecError::Closed,
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => CodecError::Silent,
            _ => CodecError::Io(error),
        }
    }
}

/// Encodes a value, for [`decode`].
///
/// # Errors
/// Where the value exceeds [`MAX_FRAME`].
pub fn encode<T: Encode>(value: &T) -> Result<Vec<u8>, CodecError> {
    let bytes =
        bincode::encode_to_vec(value, config()).map_err(|error| CodecError::Malformed(error.to_string()))?;
    if bytes.len() > MAX_FRAME {
        return Err(CodecError::TooLong { length: bytes.len(), cap: MAX_FRAME });
    }
    Ok(bytes)
}

/// Decodes a value from a whole buffer.
///
/// # Errors
/// Where the bytes are not exactly one value.
pub fn decode<T: Decode<()>>(bytes: &[u8]) -> Result<T, CodecError> {
    let standard = bincode::config::standard();
    let decoded = if bytes.len() <= SHORT_FRAME {
        bincode::decode_from_slice(bytes, standard.with_limit::<SHORT_CLAIM>())
    } else if bytes.len() <= LONG_FRAME {
        bincode::decode_from_slice(bytes, standard.with_limit::<LONG_CLAIM>())
    } else {
        bincode::decode_from_slice(bytes, config())
    };
    whole(decoded, bytes)
}

/// Decodes a book from a buffer whose checksum was verified. Entries may take a thirty-second part of the memory that
/// they decode to; nothing is allocated beyond that.
///
/// # Errors
/// Where the bytes are not exactly one value.
pub fn decode_book<T: Decode<()>>(bytes: &[u8]) -> Result<T, CodecError> {
    let standard = bincode::config::standard();
    let decoded = match bytes.len() {
        0..=0xFFFF => bincode::decode_from_slice(bytes, standard.with_limit::<{ 1 << 21 }>()),
        0x1_0000..=0xF_FFFF => bincode::decode_from_slice(bytes, standard.with_limit::<{ 1 << 25 }>()),
        0x10_0000..=0xFF_FFFF => bincode::decode_from_slice(bytes, standard.with_limit::<{ 1 << 29 }>()),
        _ => bincode::decode_from_slice(bytes, standard.with_limit::<{ 32 * MAX_FRAME }>()),
    };
    whole(decoded, bytes)
}

/// The decoded value, if it took every byte.
fn whole<T>(decoded: Result<(T, usize), DecodeError>, bytes: &[u8]) -> Result<T, CodecError> {
    match decoded {
        Ok((value, used)) if used == bytes.len() => Ok(value),
        Ok((_, used)) => Err(CodecError::Malformed(format!("{} bytes left over", bytes.len() - used))),
        Err(error) => Err(CodecError::Malformed(error.to_string())),
    }
}

/// Encodes a value by serde, as jobs are sent.
///
/// # Errors
/// Where the value exceeds [`MAX_FRAME`].
pub fn encode_serde<T: serde::Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    bincode::serde::encode_to_vec(value, config()).map_err(|error| CodecError::Malformed(error.to_string()))
}

/// Decodes what [`encode_serde`] encoded.
///
/// # Errors
/// Where the bytes are not exactly one such value.
pub fn decode_serde<T: serde::de::DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    whole(bincode::serde::decode_from_slice(bytes, config()), bytes)
}

/// The digest of what [`encode_serde`] encodes, of any length.
///
/// # Errors
/// Where the value has no code.
pub fn digest_serde<T: serde::Serialize>(value: &T) -> Result<[u8; 32], CodecError> {
    // A hasher takes many bytes at once side by side; an encoder writes a number at a time.
    let mut writer = BufWriter::with_capacity(HASHED, HashWriter(blake3::Hasher::new()));
    bincode::serde::encode_into_std_write(value, &mut writer, bincode::config::standard())
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    let digest = writer.into_inner().map_err(|error| CodecError::Malformed(error.to_string()))?;
    Ok(digest.0.finalize().into())
}

/// Bytes that are hashed at once.
const HASHED: usize = 1 << 16;

/// A digest that is written to.
struct HashWriter(blake3::Hasher);

impl std::io::Write for HashWriter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Packs numbers, for [`unpack`].
pub fn pack(numbers: &[u128]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(numbers.len());
    for number in numbers {
        bincode::encode_into_std_write(number, &mut packed, bincode::config::standard())
            .expect("a vector takes any number");
    }
    packed
}

/// Unpacks numbers one after the other; an error is the last item.
pub fn unpack(mut packed: &[u8]) -> impl Iterator<Item = Result<u128, CodecError>> {
    std::iter::from_fn(move || {
        // Most numbers are small.
        let (number, used) = match *packed {
            [] => return None,
            [small @ ..=250, ..] => (u128::from(small), 1),
            _ => match bincode::decode_from_slice(packed, bincode::config::standard()) {
                Ok(unpacked) => unpacked,
                Err(error) => {
                    packed = &[];
                    return Some(Err(CodecError::Malformed(error.to_string())));
                }
            },
        };
        packed = &packed[used..];
        Some(Ok(number))
    })
}

/// The frame of one message, ready to be sent.
///
/// # Errors
/// Where it is too long.
pub fn frame<T: Encode>(message: &T) -> Result<Vec<u8>, CodecError> {
    let mut frame = vec![0; LENGTH_BYTES];
    bincode::encode_into_std_write(message, &mut frame, config())
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    let length = frame.len() - LENGTH_BYTES;
    if length > MAX_FRAME {
        return Err(CodecError::TooLong { length, cap: MAX_FRAME });
    }
    frame[..LENGTH_BYTES].copy_from_slice(&(length as u32).to_le_bytes());
    Ok(frame)
}

/// The first message in `bytes` and the number of bytes that it took; `None` until all of it is there.
///
/// # Errors
/// Where it is longer than `cap`, which shows before it is there, or no message.
pub fn first_message<T: Decode<()>>(bytes: &[u8], cap: usize) -> Result<Option<(T, usize)>, CodecError> {
    let Some((&length, rest)) = bytes.split_first_chunk::<LENGTH_BYTES>() else { return Ok(None) };
    let (length, cap) = (u32::from_le_bytes(length) as usize, cap.min(MAX_FRAME));
    if length > cap {
        return Err(CodecError::TooLong { length, cap });
    }
    let Some(message) = rest.get(..length) else { return Ok(None) };
    Ok(Some((decode(message)?, LENGTH_BYTES + length)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{ToCoordinator, ToWorker};

    #[test]
    fn a_frame_survives_the_wire() {
        let message = ToWorker::Lease { id: 7, first_walk: 1 << 40, walks: 65_536 };
        let mut wire = frame(&message).unwrap();
        let length = wire.len();
        wire.push(77);
        assert_eq!(first_message::<ToWorker>(&wire, 100).unwrap(), Some((message, length)));
    }

    #[test]
    fn an_announced_length_beyond_the_cap_is_refused_before_it_is_there() {
        let error = first_message::<ToWorker>(&u32::MAX.to_le_bytes(), 4096).unwrap_err();
        assert!(matches!(error, CodecError::TooLong { cap: 4096, .. }), "{error}");
    }

    #[test]
    fn frames_that_are_not_whole_are_waited_for_and_random_ones_are_errors() {
        let wire = frame(&ToCoordinator::Failed { reason: "no".repeat(50) }).unwrap();
        for length in 0..wire.len() {
            assert!(first_message::<ToCoordinator>(&wire[..length], 4096).unwrap().is_none());
        }
        let mut state = 1_u64;
        for _ in 0..10_000 {
            let body: Vec<u8> = (0..40)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    (state >> 56) as u8
                })
                .collect();
            // Whatever it decodes to, it must not panic nor allocate what the bytes claim.
            let _ = decode::<ToCoordinator>(&body);
        }
    }

    #[test]
    fn packed_numbers_are_unpacked_up_to_where_they_make_no_sense() {
        let numbers = [0, 1, 250, 251, 1 << 16, 1 << 32, 1 << 64, u128::MAX, 3];
        let mut packed = pack(&numbers);
        let unpacked = |packed: &[u8]| unpack(packed).collect::<Result<Vec<u128>, CodecError>>();
        assert_eq!(unpacked(&packed).unwrap(), numbers);
        assert_eq!(pack(&[u128::MAX]).len(), LONGEST_SUM);
        packed.push(255);
        assert!(unpacked(&packed).is_err());
        packed.pop();
        packed.push(254);
        let all: Vec<_> = unpack(&packed).collect();
        assert!(all.len() == 10 && all[9].is_err(), "an error is the last");
    }

    #[test]
    fn a_claimed_length_inside_a_message_does_not_allocate() {
        // 2⁶⁰ bytes are beyond any limit, 2²⁴ beyond what a short frame may claim.
        for claim in [1_u64 << 60, 1 << 24] {
            let mut bytes = encode(&ToCoordinator::Failed { reason: String::new() }).unwrap();
            bytes.truncate(1);
            bytes.push(253);
            bytes.extend(claim.to_le_bytes());
            let error = decode::<ToCoordinator>(&bytes).unwrap_err().to_string();
            assert!(error.contains("LimitExceeded"), "{error}");
        }
    }

    #[test]
    fn the_densest_short_frame_may_claim_what_it_holds() {
        // 128-bit numbers of one byte each.
        let dense = vec![1_u128; SHORT_FRAME - 3];
        let bytes = encode(&dense).unwrap();
        assert_eq!(bytes.len(), SHORT_FRAME);
        assert_eq!(decode::<Vec<u128>>(&bytes).unwrap(), dense);
    }

    #[test]
    fn a_job_with_bytes_left_over_is_refused() {
        let mut bytes = encode_serde(&(7_u32, "seven")).unwrap();
        assert_eq!(decode_serde::<(u32, String)>(&bytes).unwrap(), (7, "seven".into()));
        bytes.push(0);
        assert!(decode_serde::<(u32, String)>(&bytes).is_err());
    }
}
