//! `radiosity.png`: the scene in its light.

mod field;
mod filter;
mod lamps;
mod light;
mod numbers;
mod photo;
mod sights;
mod spot;
mod studio;
#[cfg(test)]
mod tests;
mod tracer;

use std::io::{self, Write};

use serde::Serialize;

use crate::camera::Viewpoint;
pub use photo::Photo;

/// A picture of a scene: grey, or in colour where the scene is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// The number of pixels per row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// 1: grey; 3: red, green, blue.
    pub channels: usize,
    /// sRGB-encoded, row by row from the top, the channels of a pixel side by side.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write_png(&self, writer: impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(writer, self.width, self.height);
        let grey = self.channels == 1;
        encoder.set_color(if grey { png::ColorType::Grayscale } else { png::ColorType::Rgb });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        // Balanced takes an eighth of all the time of a short run.
        encoder.set_compression(png::Compression::Fast);
        let mut png = encoder.write_header()?;
        png.write_image_data(&self.pixels)?;
        Ok(png.finish()?)
    }
}

/// How the picture of a view with a name was taken.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedShot {
    /// The name of the view.
    pub name: String,
    /// How it was taken.
    #[serde(flatten)]
    pub shot: Shot,
}

/// How a picture was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Where the scene is seen from.
    #[serde(flatten)]
    pub viewpoint: Viewpoint,
    /// Width and height [pixels].
    pub size: [u32; 2],
    /// Light, 1 being white paper, over radiosity, channel by channel [m²/W].
    pub exposure: [f64; 3],
    /// The radiosity that is white, channel by channel [W/m²].
    pub white: [f64; 3],
    /// The light below which the picture is darkened for contrast, and the power that its part of that light is raised to. The page draws by it.
    #[serde(skip)]
    pub contrast: [f64; 2],
}
