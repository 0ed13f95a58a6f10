//! Data inside a page: base64 of zlib streams.

use std::io::{self, BufWriter, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::DVec3;

/// Bytes that are packed together.
const PIECE: usize = 1 << 16;

/// What packs data for the page. An encoder takes as long for a number as for many thousands.
pub(crate) type Packer = BufWriter<ZlibEncoder<Vec<u8>>>;

/// What is written, as base64 of a zlib stream.
pub(crate) fn pack(write: impl FnOnce(&mut Packer) -> io::Result<()>) -> io::Result<String> {
    let zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
    let mut packer = BufWriter::with_capacity(PIECE, zlib);
    write(&mut packer)?;
    let zlib = packer.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(STANDARD.encode(zlib.finish()?))
}

/// Three little-endian 32-bit floats.
pub(crate) fn write_point(writer: &mut impl Write, point: DVec3) -> io::Result<()> {
    point.to_array().iter().try_for_each(|&x| writer.write_all(&(x as f32).to_le_bytes()))
}
