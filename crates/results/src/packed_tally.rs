//! What files keep beside `tally.bin`: tallies, and values behind which stands a checksum.

use std::fs;
use std::path::Path;

use protocol::codec::{CodecError, decode_serde, encode_serde, pack, unpack};
use radiosity::{Counts, Layout, Tally};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// The bytes of a value and their checksum.
pub(crate) fn sealed<T: Serialize>(value: &T) -> Result<Vec<u8>, CodecError> {
    let mut content = encode_serde(value)?;
    let checksum = blake3::hash(&content);
    content.extend(checksum.as_bytes());
    Ok(content)
}

/// The value that a file keeps; `None` where it cannot be read, or the checksum is not that of the bytes.
pub(crate) fn unsealed<T: DeserializeOwned>(path: &Path) -> Option<T> {
    let bytes = fs::read(path).ok()?;
    let (content, checksum) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    (blake3::hash(content) == *checksum).then_some(())?;
    decode_serde(content).ok()
}

/// A tally whose sums are packed.
#[derive(Serialize, Deserialize)]
pub(crate) struct PackedTally {
    counts: [u128; 15],
    sums: Vec<u8>,
}

impl PackedTally {
    /// Packs a tally.
    pub(crate) fn of(tally: &Tally) -> Self {
        PackedTally { counts: tally.counts.to_array(), sums: pack(tally.sums()) }
    }

    /// The tally, where it has this shape.
    pub(crate) fn unpack(&self, rows: usize, layout: Layout) -> Option<Tally> {
        let sums = unpack(&self.sums).collect::<Result<_, _>>().ok()?;
        Tally::from_parts(Counts::from_array(self.counts)?, rows, layout, sums).ok()
    }
}
