//! Numbers as VTK encodes them: types, byte orders, base64, and blocks compressed by zlib.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::bytes::Bytes;
use crate::error::UnplacedError;

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VtkScalar {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl VtkScalar {
    /// The type by its name in an XML format or in the legacy format.
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" | "char" | "signed_char" => VtkScalar::Signed(1),
            "Int16" | "short" => VtkScalar::Signed(2),
            // The legacy format writes the type of VTK's own numbers in 4 bytes.
            "Int32" | "int" | "vtkIdType" => VtkScalar::Signed(4),
            "Int64" | "long" | "vtktypeint64" => VtkScalar::Signed(8),
            "UInt8" | "unsigned_char" => VtkScalar::Unsigned(1),
            "UInt16" | "unsigned_short" => VtkScalar::Unsigned(2),
            "UInt32" | "unsigned_int" => VtkScalar::Unsigned(4),
            "UInt64" | "unsigned_long" | "vtktypeuint64" => VtkScalar::Unsigned(8),
            "Float32" | "float" => VtkScalar::Float(4),
            "Float64" | "double" => VtkScalar::Float(8),
            _ => return None,
        })
    }

    /// Its bytes.
    pub(super) fn size(self) -> usize {
        let (VtkScalar::Signed(size) | VtkScalar::Unsigned(size) | VtkScalar::Float(size)) = self;
        size
    }

    /// The numbers of some bytes; what is left over at the end is none.
    pub(super) fn numbers(self, bytes: &[u8], big: bool) -> Vec<f64> {
        bytes.chunks_exact(self.size()).map(|bytes| self.number(bytes, big)).collect()
    }

    fn number(self, bytes: &[u8], big: bool) -> f64 {
        let mut word = [0; 8];
        bytes.iter().enumerate().for_each(|(place, &byte)| {
            word[if big { bytes.len() - 1 - place } else { place }] = byte;
        });
        let (bits, unused) = (u64::from_le_bytes(word), 64 - 8 * self.size() as u32);
        match self {
            VtkScalar::Signed(_) => ((bits << unused) as i64 >> unused) as f64,
            VtkScalar::Unsigned(_) => bits as f64,
            VtkScalar::Float(4) => f32::from_bits(bits as u32).into(),
            VtkScalar::Float(_) => f64::from_bits(bits),
        }
    }
}

/// How the arrays of a file are packed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packing {
    /// Whether the most significant byte comes first.
    pub(super) big: bool,
    /// The type of the numbers that tell lengths.
    pub(super) header: VtkScalar,
    /// Whether blocks are compressed by zlib.
    pub(super) zlib: bool,
    /// The most bytes of an array.
    pub(super) most: u64,
}

impl Packing {
    /// The bytes of an array that is packed so, with its header.
    pub(super) fn unpack(&self, packed: &[u8]) -> Result<Vec<u8>, UnplacedError> {
        let mut bytes = Bytes::new(packed);
        let length = self.length(&mut bytes)?;
        if !self.zlib {
            return Ok(bytes.slice(length)?.to_vec());
        }
        let (blocks, size, last) = (length, self.length(&mut bytes)?, self.length(&mut bytes)?);
        if blocks.saturating_mul(size) as u64 > self.most {
            return Err(too_long(self.most));
        }
        // The lengths of all blocks come before the first.
        if blocks > bytes.len() {
            return Err(UnplacedError::short());
        }
        let packed: Vec<usize> = (0..blocks).map(|_| self.length(&mut bytes)).collect::<Result<_, _>>()?;
        let mut unpacked = Vec::new();
        for (block, length) in packed.into_iter().enumerate() {
            let size = if block + 1 == blocks && last > 0 { last.min(size) } else { size };
            let mut decoder = ZlibDecoder::new(bytes.slice(length)?).take(size as u64);
            let found = decoder.read_to_end(&mut unpacked);
            if found.is_err() || found.is_ok_and(|found| found < size) {
                return Err(UnplacedError::new(
                    format!("block {block} of an array is not {size} bytes packed by zlib"),
                    "its numbers are not all there",
                    "export the file again",
                ));
            }
        }
        Ok(unpacked)
    }

    fn length(&self, bytes: &mut Bytes<'_>) -> Result<usize, UnplacedError> {
        let length = bytes.slice(self.header.size())?;
        Ok(self.header.number(length, self.big) as usize)
    }
}

pub(super) fn too_long(most: u64) -> UnplacedError {
    UnplacedError::new(
        format!("an array is longer than {most} bytes"),
        "the file is too small for that number of points or cells",
        "export the file again",
    )
}

/// Decodes base64. Header and data may be encoded by themselves, so that padding may stand between them.
pub(super) fn decode(text: &str) -> Result<Vec<u8>, UnplacedError> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let (mut decoded, mut rest) = (Vec::with_capacity(digits.len() / 4 * 3), digits.as_slice());
    while !rest.is_empty() {
        let padding = rest.iter().position(|&digit| digit == b'=').unwrap_or(rest.len());
        // Four digits that hold padding are the last of their part.
        let (part, after) = rest.split_at((4 * (padding / 4 + 1)).min(rest.len()));
        STANDARD.decode_vec(part, &mut decoded).map_err(|fault| {
            UnplacedError::new(
                format!("an array is not base64: {fault}"),
                "no number can be read from it",
                "export the file again",
            )
        })?;
        rest = after;
    }
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_signs_sizes_and_byte_orders() {
        assert_eq!(VtkScalar::Signed(2).numbers(&[0xFF, 0xFE], true), [-2.0]);
        assert_eq!(VtkScalar::Unsigned(2).numbers(&[0xFF, 0xFE], false), [65279.0]);
        assert_eq!(VtkScalar::Float(4).numbers(&0.5_f32.to_be_bytes(), true), [0.5]);
        assert_eq!(VtkScalar::Signed(8).numbers(&(-7_i64).to_le_bytes(), false), [-7.0]);
    }

    #[test]
    fn padding_may_stand_between_header_and_data() {
        let parts = [&[1_u8, 2, 3, 4][..], &[5, 6, 7]].map(|part| STANDARD.encode(part));
        assert_eq!(decode(&parts.concat()).unwrap(), [1, 2, 3, 4, 5, 6, 7]);
        assert!(["a?==", "====", "AQ==="].iter().all(|text| decode(text).is_err()));
    }
}
