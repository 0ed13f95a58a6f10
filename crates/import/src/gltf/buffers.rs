//! The bytes of glTF: the container GLB, buffers inside and beside the file, accessors.

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use super::json::{Accessor, At, BufferView, Document, element};
use crate::bytes::Bytes;
use crate::error::UnplacedError;
use crate::files::Files;

/// The first bytes of a GLB file: `glTF` in ASCII.
const MAGIC: &[u8] = b"glTF";

/// The types of chunks in a GLB file: `JSON` and `BIN\0`.
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;

/// The JSON of a file, and the bytes that a GLB file holds beside it.
pub(super) fn unpack(content: &[u8]) -> Result<(&[u8], &[u8]), UnplacedError> {
    if !content.starts_with(MAGIC) {
        return Ok((content, &[]));
    }
    let mut bytes = Bytes::new(&content[MAGIC.len()..]);
    let version = u32::from_le_bytes(bytes.take()?);
    if version != 2 {
        return Err(super::old_version(version));
    }
    bytes.skip(4)?;
    let (mut json, mut binary): (Option<&[u8]>, &[u8]) = (None, &[]);
    while bytes.len() >= 8 {
        let length = u32::from_le_bytes(bytes.take()?) as usize;
        match u32::from_le_bytes(bytes.take()?) {
            JSON_CHUNK if json.is_none() => json = Some(bytes.slice(length)?),
            BINARY_CHUNK => binary = bytes.slice(length)?,
            _ => bytes.skip(length)?,
        }
    }
    Ok((json.ok_or_else(UnplacedError::short)?, binary))
}

/// The content of a buffer, which several buffers may share.
pub(super) type SharedBytes = Rc<[u8]>;

/// The content of every buffer, and the bytes of all files that were read for it.
pub(super) fn buffers(
    document: &Document,
    binary: &[u8],
    path: &Path,
    files: &mut Files<'_>,
) -> Result<(Vec<SharedBytes>, usize), At> {
    let binary: SharedBytes = binary.into();
    // Buffers that name one file share its content.
    let mut known: HashMap<String, SharedBytes> = HashMap::new();
    let content = |(number, buffer): (usize, &super::json::Buffer)| {
        let at = |fault| (format!("buffers[{number}]"), fault);
        let content = match buffer.uri.as_deref() {
            None if buffer.extensions.meshopt.is_some() => return Err(at(compressed())),
            None => binary.clone(),
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => decode_data(data).ok_or_else(|| at(bad_data()))?.into(),
                None => {
                    let uri = decode_percent(uri);
                    match known.get(&uri) {
                        Some(content) => content.clone(),
                        None => {
                            let read = files.beside(path, &uri).map_err(|error| at(missing(&uri, &error)))?;
                            known.entry(uri).or_insert(read.1.into()).clone()
                        }
                    }
                }
            },
        };
        if content.len() < buffer.byte_length {
            let problem = format!("the buffer holds {} bytes of {}", content.len(), buffer.byte_length);
            return Err(at(UnplacedError::new(
                problem,
                "its vertices are not all there",
                "export the file again",
            )));
        }
        Ok(content)
    };
    let buffers = document.buffers.iter().enumerate().map(content).collect::<Result<_, At>>()?;
    Ok((buffers, known.values().map(|content| content.len()).sum()))
}

fn compressed() -> UnplacedError {
    let problem = "its meshes are compressed (EXT_meshopt_compression)";
    UnplacedError::new(problem, "that is not read", super::WITHOUT_EXTENSIONS)
}

fn bad_data() -> UnplacedError {
    UnplacedError::new(
        "the buffer's data are not base64",
        "no vertex can be read from it",
        "export the file again",
    )
}

fn missing(uri: &str, error: &std::io::Error) -> UnplacedError {
    UnplacedError::new(
        format!("the buffer {uri:?} cannot be read"),
        error.to_string(),
        "put it beside the .gltf file, or export as .glb",
    )
}

/// What follows `;base64,` in a data URI.
pub(super) fn decode_data(data: &str) -> Option<Vec<u8>> {
    let (_, encoded) = data.split_once(";base64,")?;
    let mut decoded = Vec::with_capacity(encoded.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for digit in encoded.bytes().take_while(|&digit| digit != b'=') {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            decoded.push((bits >> count) as u8);
        }
    }
    Some(decoded)
}

/// Decodes percent-encoded characters, such as `%20`.
pub(super) fn decode_percent(uri: &str) -> String {
    let mut decoded = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| byte == b'%');
        let code = code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        decoded.push(code.unwrap_or(byte));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

/// The accessors of a document whose buffers were read.
pub(super) struct Data<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: &'a [SharedBytes],
}

impl Data<'_> {
    /// Reads an accessor whose rows have N components each.
    pub(super) fn rows<const N: usize>(&self, number: usize, from: &str) -> Result<Vec<[f64; N]>, At> {
        let accessor = element(&self.document.accessors, number, "accessors", from)?;
        let path = format!("accessors[{number}]");
        self.read(accessor).map_err(|fault| (path, fault))
    }

    fn read<const N: usize>(&self, accessor: &Accessor) -> Result<Vec<[f64; N]>, UnplacedError> {
        let expected = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        if accessor.kind != expected {
            return Err(UnplacedError::new(
                format!("the accessor's type is {:?}", accessor.kind),
                format!("its use here needs {expected}"),
                "export the file again",
            ));
        }
        let PackedRows { bytes, stride, component } = match accessor.buffer_view {
            Some(view) => {
                self.part(view, accessor.byte_offset, accessor.component_type, accessor.count, N)?
            }
            None => PackedRows { bytes: &[], stride: 0, component: Component::new(accessor.component_type)? },
        };
        let mut rows = match accessor.buffer_view {
            Some(_) => (0..accessor.count).map(|row| component.row(bytes, row * stride)).collect(),
            None => vec![[0.0; N]; accessor.count],
        };
        self.overwrite(accessor, &mut rows)?;
        if accessor.normalized {
            rows.iter_mut().flatten().for_each(|value| *value = component.normalized(*value));
        }
        Ok(rows)
    }

    /// Puts the values of a sparse accessor in their rows.
    fn overwrite<const N: usize>(
        &self,
        accessor: &Accessor,
        rows: &mut [[f64; N]],
    ) -> Result<(), UnplacedError> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let (at, of) = (&sparse.indices, &sparse.values);
        let indices = self.part(at.buffer_view, at.byte_offset, at.component_type, sparse.count, 1)?;
        let values = self.part(of.buffer_view, of.byte_offset, accessor.component_type, sparse.count, N)?;
        for item in 0..sparse.count {
            let [row] = indices.component.row::<1>(indices.bytes, item * indices.stride);
            let row = rows.get_mut(row as usize).ok_or_else(UnplacedError::short)?;
            *row = values.component.row(values.bytes, item * values.stride);
        }
        Ok(())
    }

    /// The bytes that hold `count` rows of `width` components, checked to be all there.
    fn part(
        &self,
        view: usize,
        offset: usize,
        kind: u32,
        count: usize,
        width: usize,
    ) -> Result<PackedRows<'_>, UnplacedError> {
        let component = Component::new(kind)?;
        let row = component.size() * width;
        let bytes = self.view(view).and_then(|bytes| bytes.get(offset..)).ok_or_else(UnplacedError::short)?;
        let stride = self.document.buffer_views[view].byte_stride.unwrap_or(row);
        let needed = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(row));
        if needed.is_none_or(|needed| needed > bytes.len()) || (stride < row && count > 1) {
            return Err(UnplacedError::short());
        }
        Ok(PackedRows { bytes, stride, component })
    }

    /// The bytes of a view.
    pub(super) fn view(&self, number: usize) -> Option<&[u8]> {
        let BufferView { buffer, byte_offset, byte_length, .. } = *self.document.buffer_views.get(number)?;
        self.buffers.get(buffer)?.get(byte_offset..byte_offset.checked_add(byte_length)?)
    }
}

/// The rows of numbers in a part of a buffer.
struct PackedRows<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: Component,
}

/// The type of a number in a buffer (specification, section 3.6.2.2).
#[derive(Clone, Copy, Debug)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn new(code: u32) -> Result<Self, UnplacedError> {
        match code {
            5120 => Ok(Component::I8),
            5121 => Ok(Component::U8),
            5122 => Ok(Component::I16),
            5123 => Ok(Component::U16),
            5125 => Ok(Component::U32),
            5126 => Ok(Component::F32),
            _ => Err(UnplacedError::new(
                format!("unknown component type {code}"),
                "glTF has 5120 to 5123, 5125 and 5126",
                "export the file again",
            )),
        }
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The N numbers from a place in `bytes` on.
    fn row<const N: usize>(self, bytes: &[u8], start: usize) -> [f64; N] {
        std::array::from_fn(|i| {
            let bytes = &bytes[start + i * self.size()..];
            let two = || [bytes[0], bytes[1]];
            let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
            match self {
                Component::I8 => f64::from(bytes[0] as i8),
                Component::U8 => f64::from(bytes[0]),
                Component::I16 => f64::from(i16::from_le_bytes(two())),
                Component::U16 => f64::from(u16::from_le_bytes(two())),
                Component::U32 => f64::from(u32::from_le_bytes(four())),
                Component::F32 => f64::from(f32::from_le_bytes(four())),
            }
        })
    }

    /// An integer as the number in [−1, 1] that it stands for.
    fn normalized(self, value: f64) -> f64 {
        match self {
            Component::I8 => (value / 127.0).max(-1.0),
            Component::U8 => value / 255.0,
            Component::I16 => (value / 32767.0).max(-1.0),
            Component::U16 => value / 65535.0,
            Component::U32 | Component::F32 => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded() {
        assert_eq!(decode_data("application/octet-stream;base64,aGVsbG8="), Some(b"hello".to_vec()));
        assert_eq!(decode_data("application/octet-stream;base64,a?"), None);
    }

    #[test]
    fn percents_are_decoded() {
        assert_eq!(decode_percent("my%20room%2.bin"), "my room%2.bin");
    }
}
