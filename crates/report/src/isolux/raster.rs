//! `planes.png`: the maps of `planes.svg` in pixels, for where drawings are not shown.

use radiosity::sensors::Readings;

use super::{PlaneGrid, colour, grids, levels};
use crate::chart::write_label;
use crate::picture::Picture;
use crate::words::quantity;

/// The longer side of a map, and what is white around each [px].
const SIDE: f64 = 720.0;
const MARGIN: usize = 32;

/// Red, green and blue of the background.
const WHITE: [u8; 3] = [255; 3];

/// The maps of all planes that are grids, one below the other, each below its title in a `unit`; `None` where there are none.
pub fn isolux_picture(readings: &Readings, unit: &str) -> Option<Picture> {
    let maps: Vec<(String, Picture)> =
        grids(readings).map(|(name, grid)| (grid.title(&name, unit), map(&grid))).collect();
    stacked(&maps)
}

/// Maps below their titles, one below the other.
fn stacked(maps: &[(String, Picture)]) -> Option<Picture> {
    // As wide as the widest map can be: titles are longer than a narrow map.
    let width = maps.first().map(|_| SIDE as usize)? + 2 * MARGIN;
    let height = maps.iter().map(|(_, map)| map.height as usize + MARGIN).sum::<usize>() + MARGIN;
    let mut all = blank([width, height]);
    let mut top = MARGIN;
    for (title, map) in maps {
        write_label(&mut all, [0.5 * width as f64, top as f64 - 0.5 * MARGIN as f64], title);
        let row_length = 3 * map.width as usize;
        for (y, row) in map.pixels.chunks_exact(row_length).enumerate() {
            let first = 3 * ((top + y) * width + MARGIN);
            all.pixels[first..first + row_length].copy_from_slice(row);
        }
        top += map.height as usize + MARGIN;
    }
    Some(all)
}

fn blank([width, height]: [usize; 2]) -> Picture {
    Picture { width: width as u32, height: height as u32, channels: 3, pixels: vec![255; 3 * width * height] }
}

/// A grid in colours, with white lines of equal light and what they stand for.
fn map(grid: &PlaneGrid) -> Picture {
    let sides = [0, 1].map(|axis| grid.size[axis] as f64 * grid.step[axis]);
    let pixels_per_metre = SIDE / sides[0].max(sides[1]);
    let [width, height] = sides.map(|side| (side * pixels_per_metre).round().max(1.0) as usize);
    let [low, high] = grid.range();
    let levels = levels([low, high]);
    // In steps of the grid, from the point in the lower left.
    let per_pixel = grid.step.map(|step| 1.0 / (step * pixels_per_metre));
    let place = |x: usize, y: usize| {
        [(x as f64 + 0.5) * per_pixel[0] - 0.5, ((height - 1 - y) as f64 + 0.5) * per_pixel[1] - 0.5]
    };
    let values: Vec<f64> =
        (0..height).flat_map(|y| (0..width).map(move |x| place(x, y))).map(|at| grid.between(at)).collect();
    let above = |value: f64| levels.iter().take_while(|level| **level <= value).count();
    let mut picture = blank([width, height]);
    for (pixel, value) in values.iter().enumerate() {
        let (x, y) = (pixel % width, pixel / width);
        let beside = [(x + 1 < width).then_some(pixel + 1), (y + 1 < height).then_some(pixel + width)];
        let is_line = beside.into_iter().flatten().any(|other| above(values[other]) != above(*value));
        let shade = if is_line { WHITE } else { colour((value - low) / (high - low).max(f64::MIN_POSITIVE)) };
        picture.pixels[3 * pixel..3 * pixel + 3].copy_from_slice(&shade);
    }
    for level in levels {
        let pieces = grid.line(level);
        if let Some([a, b]) = pieces.get(pieces.len() / 2) {
            let middle = [0, 1].map(|axis| (0.5 * (a[axis] + b[axis]) + 0.5) / per_pixel[axis]);
            write_label(&mut picture, [middle[0], height as f64 - middle[1]], &quantity(level));
        }
    }
    picture
}

impl PlaneGrid {
    /// The value at a place in steps of the grid, linear between points and constant beyond the outer ones; NaN in a cell with a missing value.
    fn between(&self, at: [f64; 2]) -> f64 {
        let [(i, u), (j, v)] = [0, 1].map(|axis| {
            let most = self.size[axis] - 1;
            let at = at[axis].clamp(0.0, most as f64);
            let low = (at as usize).min(most - 1);
            (low, at - low as f64)
        });
        let along = |j: usize| (1.0 - u) * self.value(i, j) + u * self.value(i + 1, j);
        (1.0 - v) * along(j) + v * along(j + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a slope along u a white line stands where the value is that of the line, a number beside it, and the colour rises to the right.
    #[test]
    fn lines_stand_at_their_value() {
        let values = (0..30).map(|n| f64::from(n / 5) * 20.0).collect();
        let grid = PlaneGrid { size: [6, 5], step: [1.0, 1.0], values };
        let picture = map(&grid);
        assert_eq!([picture.width, picture.height], [720, 600]);
        let pixel = |x: usize, y: usize| &picture.pixels[3 * (y * 720 + x)..][..3];
        let whites: Vec<usize> = (0..720).filter(|&x| pixel(x, 100) == WHITE).collect();
        // Lines of 20, 40, 60, 80; a point is 120 pixels from the next, and the first in the middle of its own.
        assert_eq!(whites, [179, 299, 419, 539]);
        assert!(pixel(100, 100)[0] < pixel(250, 100)[0] && pixel(250, 100)[0] < pixel(600, 100)[0]);
        // No colour of the map is grey: that is the edge of a digit.
        let is_ink = |pixel: &[u8]| pixel[0] < 128 && pixel.iter().all(|of| *of == pixel[0]);
        let ink = picture.pixels.chunks_exact(3).filter(|pixel| is_ink(pixel)).count();
        assert!(ink > 160, "{ink}");
    }

    /// A title stands above each map, and the map is where it was.
    #[test]
    fn maps_have_titles() {
        let grid = PlaneGrid { size: [4, 3], step: [1.0, 1.0], values: (0..12).map(f64::from).collect() };
        let [bare, titled] =
            ["", "desk: 0 … 11 lx"].map(|title| stacked(&[(title.into(), map(&grid))]).unwrap());
        assert_eq!([titled.width, titled.height], [784, 604]);
        let dark =
            |picture: &Picture| picture.pixels[..3 * 784 * MARGIN].iter().filter(|&&of| of < 128).count();
        assert_eq!(dark(&bare), 0);
        assert!(dark(&titled) > 100);
        assert_eq!(bare.pixels[3 * 784 * MARGIN..], titled.pixels[3 * 784 * MARGIN..]);
    }

    /// Cells of the grid beside a missing value are white, others are not.
    #[test]
    fn holes_are_white() {
        let values = (0..12).map(|n| if n == 0 { f64::NAN } else { f64::from(n) }).collect();
        let picture = map(&PlaneGrid { size: [4, 3], step: [1.0, 1.0], values });
        assert_eq!([picture.width, picture.height], [720, 540]);
        let corner = |x: usize, y: usize| &picture.pixels[3 * (y * 720 + x)..][..3];
        assert_eq!(corner(0, 539), WHITE);
        assert_ne!(corner(719, 0), WHITE);
    }
}
