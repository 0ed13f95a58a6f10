//! `radiosity.exr`: the radiance behind every pixel of the picture, in OpenEXR.
//!
//! One part of scan lines, 32-bit floats, blocks of 16 lines packed by zlib ("OpenEXR File Layout", openexr.com). The crate `exr`
//! reads the file back in a test; as a writer it would add 20 s to a cold build.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// What an OpenEXR file begins with: its magic number, and version 2 without flags.
const MAGIC: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];

/// Lines of a block that is packed by zlib.
const BLOCK: usize = 16;

/// The numbers of the format: a channel of 32-bit floats; packing by zlib in blocks of 16 lines; lines from the top.
const FLOAT: i32 = 2;
const ZIP: u8 = 3;
const FROM_THE_TOP: u8 = 0;

/// The names of the channels in the order of the file, and which of a pixel's values they hold.
const LAYERS: [(&str, usize); 3] = [("B", 2), ("G", 1), ("R", 0)];

/// The radiance behind the pixels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// The number of pixels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// Row by row from the top: L = B/π [W/(m² sr)], a mean over the pixel, of red, green and blue; 0 beyond the scene.
    pub values: Vec<[f32; 3]>,
}

impl Values {
    /// Writes the values as OpenEXR: channels R, G and B, which are equal in grey scenes. `unit` is that of radiance.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_exr(&self, mut writer: impl Write, unit: &str) -> io::Result<()> {
        let header = self.header(unit);
        let lines = self.values.chunks(self.width as usize * BLOCK).enumerate();
        let blocks: Vec<Vec<u8>> =
            lines.map(|(block, pixels)| self.block(block, pixels)).collect::<io::Result<_>>()?;
        writer.write_all(&header)?;
        let mut offset = (header.len() + 8 * blocks.len()) as u64;
        for block in &blocks {
            writer.write_all(&offset.to_le_bytes())?;
            offset += block.len() as u64;
        }
        blocks.iter().try_for_each(|block| writer.write_all(block))
    }

    fn header(&self, unit: &str) -> Vec<u8> {
        let int = |number: i32| number.to_le_bytes();
        let mut list = Vec::new();
        for (name, _) in LAYERS {
            list.extend(name.as_bytes());
            // The end of the name, the type, linear light with three bytes of nothing, one sample a pixel across and down.
            list.extend([[0].as_slice(), &int(FLOAT), &[0; 4], &int(1), &int(1)].concat());
        }
        list.push(0);
        let window = [0, 0, self.width as i32 - 1, self.height as i32 - 1].map(int).concat();
        let comments = format!("radwalk: radiance in {unit}, a mean over each pixel");
        let mut header = MAGIC.to_vec();
        let mut attribute = |name: &str, kind: &str, value: &[u8]| {
            let length = int(value.len() as i32);
            header.extend([name.as_bytes(), &[0], kind.as_bytes(), &[0], &length, value].concat());
        };
        attribute("channels", "chlist", &list);
        attribute("comments", "string", comments.as_bytes());
        attribute("compression", "compression", &[ZIP]);
        attribute("dataWindow", "box2i", &window);
        attribute("displayWindow", "box2i", &window);
        attribute("lineOrder", "lineOrder", &[FROM_THE_TOP]);
        attribute("pixelAspectRatio", "float", &1_f32.to_le_bytes());
        attribute("screenWindowCenter", "v2f", &[0; 8]);
        attribute("screenWindowWidth", "float", &1_f32.to_le_bytes());
        header.push(0);
        header
    }

    /// A block: the number of its first line, its length, and its lines, each channel by channel.
    fn block(&self, block: usize, pixels: &[[f32; 3]]) -> io::Result<Vec<u8>> {
        let mut plain = Vec::with_capacity(4 * pixels.len() * LAYERS.len());
        for line in pixels.chunks(self.width as usize) {
            for (_, which) in LAYERS {
                line.iter().for_each(|pixel| plain.extend(pixel[which].to_le_bytes()));
            }
        }
        let packed = packed(&plain)?;
        // A block that does not shrink is stored as it is.
        let stored = if packed.len() < plain.len() { packed } else { plain };
        let first = (block * BLOCK) as i32;
        Ok([&first.to_le_bytes()[..], &(stored.len() as i32).to_le_bytes(), &stored].concat())
    }
}

/// Bytes as OpenEXR packs them: those of even places before those of odd ones, as differences from one to the next.
fn packed(plain: &[u8]) -> io::Result<Vec<u8>> {
    let halves = plain.iter().step_by(2).chain(plain.iter().skip(1).step_by(2));
    let mut before = None;
    let steps = halves.map(|&byte| match before.replace(byte) {
        Some(last) => byte.wrapping_sub(last).wrapping_add(128),
        None => byte,
    });
    let steps: Vec<u8> = steps.collect();
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
    zlib.write_all(&steps)?;
    zlib.finish()
}

#[cfg(test)]
mod tests {
    use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};

    use super::*;

    #[test]
    fn every_value_is_read_as_it_was_written() {
        // Noise does not shrink; shades do. Two blocks and a part of one.
        let noise = |i: u32| f32::from_bits(i.wrapping_mul(2_654_435_761) >> 2);
        let shade = |i: u32| (i / 100) as f32 / 7.0;
        for of in [&noise as &dyn Fn(u32) -> f32, &shade] {
            let pixel = |i: u32| [0, 1, 2].map(|c| of(3 * i + c));
            let values = Values { width: 13, height: 37, values: (0..13 * 37).map(pixel).collect() };
            let file = tempfile::NamedTempFile::new().unwrap();
            values.write_exr(file.as_file(), "W/m²").unwrap();
            let layer = read_first_flat_layer_from_file(file.path()).unwrap().layer_data;
            assert_eq!((layer.size.0, layer.size.1), (13, 37));
            let list = layer.channel_data.list;
            assert_eq!(
                list.iter().map(|channel| channel.name.to_string()).collect::<Vec<_>>(),
                ["B", "G", "R"]
            );
            for channel in &list {
                let which = ["R", "G", "B"].iter().position(|name| channel.name == **name).unwrap();
                let FlatSamples::F32(samples) = &channel.sample_data else { panic!("32-bit floats") };
                let written: Vec<u32> = values.values.iter().map(|value| value[which].to_bits()).collect();
                assert_eq!(samples.iter().map(|sample| sample.to_bits()).collect::<Vec<_>>(), written);
            }
        }
    }
}
