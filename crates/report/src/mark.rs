//! Pictures that show some surfaces of a scene: these in red, all else in grey.

use radiosity::Scene;

use crate::camera::{Camera, Sight, Size};
use crate::picture::Picture;

/// The longer side of a picture [pixels].
const SIZE: u32 = 640;

/// What lies beyond the scene: sRGB.
const BACKGROUND: [u8; 3] = [28, 28, 32];

/// A surface seen straight on, and what is left of it at grazing angles.
const GREY: [f64; 3] = [205.0, 205.0, 210.0];
const RED: [f64; 3] = [235.0, 60.0, 40.0];
const GRAZING: f64 = 0.35;

/// Outlines of marked surfaces, drawn over whatever hides them.
const OUTLINE: [u8; 3] = [255, 140, 0];

/// Marks smaller than this get a ring of this radius around them [pixels].
const RING: f64 = 18.0;

impl Picture {
    /// A picture from the side that shows most of the marked surfaces. Their outlines are drawn over what hides them, and
    /// a ring where they are too small to be found.
    pub fn mark(scene: &Scene, marked: &[u32]) -> Self {
        let is_marked = |surface: u32| marked.contains(&surface);
        let camera =
            Camera::best(scene, |piece| is_marked(scene.faces().piece(piece).surface), Size::Longest(SIZE));
        let [width, height] = camera.size;
        let places = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
        let sights = camera.look(scene, &places.collect::<Vec<_>>());
        let pixels = sights.into_iter().flat_map(|sight| shade(scene, sight, &is_marked)).collect();
        let mut picture = Picture { width, height, channels: 3, pixels };
        let outlines = marked.iter().map(|&surface| outline(scene, &camera, surface));
        let outlines: Vec<Vec<[f64; 2]>> = outlines.collect();
        for corners in &outlines {
            let ends = corners.iter().zip(corners.iter().cycle().skip(1));
            ends.for_each(|(from, to)| picture.line(*from, *to));
        }
        picture.ring_if_small(&outlines.concat());
        picture
    }

    fn put(&mut self, [x, y]: [f64; 2]) {
        let inside = |at: f64, size: u32| (at >= 0.0 && at < f64::from(size)).then_some(at as usize);
        if let (Some(x), Some(y)) = (inside(x, self.width), inside(y, self.height)) {
            let first = 3 * (y * self.width as usize + x);
            self.pixels[first..first + 3].copy_from_slice(&OUTLINE);
        }
    }

    fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        let way = [to[0] - from[0], to[1] - from[1]];
        // Corners far outside of the picture do not lengthen the line without end.
        let most = f64::from(4 * SIZE);
        let steps = way[0].abs().max(way[1].abs()).clamp(1.0, most).ceil();
        for step in 0..=steps as u32 {
            let t = f64::from(step) / steps;
            self.put([from[0] + t * way[0], from[1] + t * way[1]]);
        }
    }

    fn ring_if_small(&mut self, corners: &[[f64; 2]]) {
        let extreme = |axis: usize, pick: fn(f64, f64) -> f64| {
            corners.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or(0.0)
        };
        let (min, max) = ([0, 1].map(|k| extreme(k, f64::min)), [0, 1].map(|k| extreme(k, f64::max)));
        if (0..2).any(|k| max[k] - min[k] > 2.0 * RING) {
            return;
        }
        let middle = [0, 1].map(|k| 0.5 * (min[k] + max[k]));
        for step in 0..360 {
            let (sin, cos) = f64::from(step).to_radians().sin_cos();
            for radius in [RING, RING + 1.0] {
                self.put([middle[0] + radius * cos, middle[1] + radius * sin]);
            }
        }
    }
}

fn shade(scene: &Scene, sight: Option<Sight>, is_marked: &impl Fn(u32) -> bool) -> [u8; 3] {
    sight.map_or(BACKGROUND, |sight| {
        let colour = if is_marked(scene.faces().piece(sight.piece).surface) { RED } else { GREY };
        let light = GRAZING + (1.0 - GRAZING) * sight.cosine();
        colour.map(|channel| (channel * light).round() as u8)
    })
}

/// The corners of a surface in the picture, in their order around it; those behind the eye are left out.
fn outline(scene: &Scene, camera: &Camera, surface: u32) -> Vec<[f64; 2]> {
    let mut corners = scene.surfaces()[surface as usize].outline();
    if let [_, _, third, fourth] = &mut corners[..] {
        std::mem::swap(third, fourth);
    }
    corners.into_iter().filter_map(|corner| camera.project(corner)).collect()
}

#[cfg(test)]
mod tests {
    use radiosity::IndexChoice;

    use super::*;
    use crate::scenes::{cornell, cube};

    fn count(picture: &Picture, is: impl Fn(&[u8]) -> bool) -> usize {
        picture.pixels.chunks_exact(3).filter(|pixel| is(pixel)).count()
    }

    fn is_red(pixel: &[u8]) -> bool {
        let [red, green, blue] = [pixel[0], pixel[1], pixel[2]].map(u16::from);
        red > 2 * green && red > 2 * blue
    }

    #[test]
    fn marked_surfaces_are_red_and_outlined() {
        let scene = cube();
        let picture = Picture::mark(&scene, &[0]);
        assert!(count(&picture, is_red) > 10_000);
        assert!(count(&picture, |pixel| pixel == OUTLINE) > 500);
        assert_eq!(count(&Picture::mark(&scene, &[]), is_red), 0);
    }

    #[test]
    fn what_is_small_is_ringed() {
        let mut spec = cornell();
        let mut dot = spec.surfaces[5].clone();
        dot.shape =
            crate::scenes::quad("", [[0.5, 0.5, 0.5], [0.501, 0.5, 0.5], [0.5, 0.5, 0.501]], [1, 1], 0.0)
                .shape;
        spec.surfaces.push(dot);
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let picture = Picture::mark(&scene, &[spec.surfaces.len() as u32 - 1]);
        assert!(count(&picture, |pixel| pixel == OUTLINE) > 150);
    }
}
