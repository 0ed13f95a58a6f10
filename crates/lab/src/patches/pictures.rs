//! Pictures of a scene by constants, by linear fits and with chosen patches, at equal processor time, side by side.

use std::fs::File;
use std::path::Path;

use job::{Cut, View};
use radiosity::Estimates;
use report::{Photo, Picture, Smooth};

use super::rooms::Room;
use super::runs::{Failure, experiment, walk};
use super::study::PatchStudy;

/// The walks of the job whose time all three have.
pub const PATHS: u64 = 1_000_000;

/// The scene that is drawn.
pub const DRAWN: &str = "cornell";

/// Width and height of each picture [pixels].
const SIZE: [u32; 2] = [420, 420];

/// Draws them, from the left to the right, with the light of the first.
pub fn draw(room: &Room, study: &PatchStudy, folder: &Path) -> Result<(), Failure> {
    let row = study.rows.iter().find(|row| row.paths == PATHS).ok_or("no such job")?;
    if room.name != DRAWN {
        return Ok(());
    }
    let time = row.chosen.seconds;
    let of_uniform = |best: &super::study::BestGrid| (PATHS as f64 * time / best.seconds) as u64;
    let [constant, linear] = &row.uniform;
    let (first, light) = shoot(room, (&constant.cuts, false), of_uniform(constant), None)?;
    let (second, _) = shoot(room, (&linear.cuts, true), of_uniform(linear), Some(light))?;
    let (third, _) = shoot(room, (&row.chosen.cuts, row.chosen.is_linear), PATHS, Some(light))?;
    let picture = beside(&[first, second, third]);
    picture.write_png(File::create(folder.join(format!("patches-{}.png", room.name)))?)?;
    Ok(())
}

/// A picture, and how its light was measured.
fn shoot(
    room: &Room,
    (cuts, linear): (&[Cut], bool),
    walks: u64,
    exposure: Option<f64>,
) -> Result<(Picture, f64), Failure> {
    let experiment = experiment(&room.spec, cuts, linear)?;
    let tally = walk(&experiment, 0, walks);
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let view = View { size: Some(SIZE), exposure, ..View::default() };
    let photo = Photo::shoot(&estimates, &Smooth::new(&estimates), &view, false);
    Ok((photo.picture, photo.shot.exposure[0]))
}

/// Pictures of one size side by side.
fn beside(pictures: &[Picture]) -> Picture {
    let Picture { width, height, channels, .. } = pictures[0];
    let row = width as usize * channels;
    let pixels = (0..height as usize)
        .flat_map(|y| {
            pictures.iter().flat_map(move |picture| picture.pixels[y * row..(y + 1) * row].iter().copied())
        })
        .collect();
    Picture { width: width * pictures.len() as u32, height, channels, pixels }
}
