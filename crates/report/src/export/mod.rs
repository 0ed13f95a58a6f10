//! Results for other programs: VTK for ParaView, glTF for viewers and modellers, Parquet for data frames. All have the
//! corners of the patches.

mod glb;
mod parquet;
mod table;
mod vtu;

use std::io::{self, Write};

use radiosity::Estimates;

use crate::picture::Shot;

/// A format that other programs read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Export {
    /// ParaView and VTK.
    Vtu,
    /// Viewers and modellers.
    Glb,
    /// Data frames.
    Parquet,
}

impl Export {
    /// Every format.
    pub const ALL: [Export; 3] = [Export::Vtu, Export::Glb, Export::Parquet];

    /// The word that stands for it.
    pub fn word(self) -> &'static str {
        match self {
            Export::Vtu => "vtu",
            Export::Glb => "glb",
            Export::Parquet => "parquet",
        }
    }

    /// The name of the file.
    pub fn file(self) -> &'static str {
        match self {
            Export::Vtu => "patches.vtu",
            Export::Glb => "scene.glb",
            Export::Parquet => "patches.parquet",
        }
    }

    /// The programs that read it, in words.
    pub fn readers(self) -> &'static str {
        match self {
            Export::Vtu => "ParaView and VTK",
            Export::Glb => "viewers and modellers",
            Export::Parquet => "data frames",
        }
    }

    /// Writes the faces; the shot tells how bright they are shown, where the format shows them.
    ///
    /// # Errors
    /// Those of `writer`, and where the format cannot hold the result.
    pub fn write(self, writer: impl Write + Send, estimates: &Estimates, shot: &Shot) -> io::Result<()> {
        match self {
            Export::Vtu => vtu::write_vtu(writer, estimates),
            Export::Glb => glb::write_glb(writer, estimates, shot),
            Export::Parquet => parquet::write_parquet(writer, estimates),
        }
    }
}
