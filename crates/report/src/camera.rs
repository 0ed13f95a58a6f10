//! Where to look at a scene from.
//!
//! In a room of people, and in any other whose walls hide the inside, the camera stands inside (`inside.rs`), unless a wall is missing through
//! which one sees far more. Otherwise it
//! stands outside of the scene's bounding box and looks at its middle in perspective, upright. Backs
//! of one-sided surfaces are see-through, so that one looks into a closed box as into a doll's house. Where
//! that does not help, a *cut* leaves out what lies within a thin shell of the bounding box on the
//! near side. Of a fixed set of directions, cut and uncut, the camera takes the one that sees most lit area. A job may
//! say where the camera stands instead.
//!
//! Coordinates are relative to [`Scene::origin`].

mod choice;
mod inside;
#[cfg(test)]
mod tests;
mod troubles;

use glam::DVec3;
use radiosity::{
    Scene, Side,
    rays::{Lookout, Ray},
    surfaces::Surface,
};
use serde::Serialize;

use crate::bounds::Bounds;
pub(crate) use choice::{Frame, Size};
pub use troubles::view_troubles;

/// Rays that are under way together: what is noted of them stays in the cache.
const AT_ONCE: usize = 1024;

/// What a camera sees along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sight {
    /// The nearest piece of a face that faces the camera.
    pub piece: u32,
    /// The surface that the piece is on.
    pub surface: u32,
    /// The side of it that the piece is on.
    pub side: Side,
    /// Where on the piece's surface it is, in local coordinates.
    pub uv: [f64; 2],
    /// Whether it is seen through the back of a one-sided surface.
    is_behind: bool,
    /// From the eye [m].
    distance: f64,
    /// Cosine between the ray and the surface's normal.
    cosine: f64,
}

/// The eye, the middle of the picture and the field of view, in the coordinates of the scene file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Viewpoint {
    /// The place of the eye [m].
    pub eye: [f64; 3],
    /// The middle of the picture [m].
    pub look_at: [f64; 3],
    /// The direction that is up, of length 1.
    pub up: [f64; 3],
    /// The vertical field of view, from the lower to the upper edge [degrees].
    pub fov: f64,
}

impl Sight {
    /// Cosine between the ray and the surface's normal.
    pub(crate) fn cosine(&self) -> f64 {
        self.cosine
    }
}

/// A camera with perspective, aimed at a scene.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    /// The direction that the scene calls up.
    vertical: DVec3,
    /// What the eye looks at.
    target: DVec3,
    /// From the eye to the target, length 1.
    forward: DVec3,
    /// The left and upper edge of the picture, on the plane at distance 1 from the eye. The middle is where the eye looks.
    left: f64,
    top: f64,
    /// The size of a pixel on that plane.
    pixel: f64,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Nothing is seen before a ray enters this box.
    cut: Option<Bounds>,
    /// Eye and target as the job has them, in the coordinates of its scene.
    said: Option<[DVec3; 2]>,
}

impl Camera {
    /// This camera with pixels that are `times` times larger.
    pub(crate) fn coarser(&self, times: u32) -> Self {
        let size = self.size.map(|side| side.div_ceil(times));
        Camera { pixel: self.pixel * f64::from(times), size, ..self.clone() }
    }

    /// Where the camera stands, in the coordinates of the file.
    pub(crate) fn viewpoint(&self, scene: &Scene) -> Viewpoint {
        let [eye, look_at] = self.said.unwrap_or_else(|| {
            let eye = self.eye + scene.origin();
            [eye, eye + self.forward * (self.target - self.eye).dot(self.forward)]
        });
        let half_height = 0.5 * f64::from(self.size[1]) * self.pixel;
        Viewpoint {
            eye: eye.to_array(),
            look_at: look_at.to_array(),
            up: self.vertical.to_array(),
            fov: 2.0 * half_height.atan().to_degrees(),
        }
    }

    /// What is seen at points of the picture: x, y in pixels, from the upper left corner.
    pub(crate) fn look(&self, scene: &Scene, points: &[[f64; 2]]) -> Vec<Option<Sight>> {
        let mut sights = vec![None; points.len()];
        self.each_sight(scene, points, |point, sight| sights[point] = Some(sight));
        sights
    }

    /// [`Camera::look`], handed on in any order, each with the number of its point; points that show nothing are left out.
    pub(crate) fn each_sight(&self, scene: &Scene, points: &[[f64; 2]], mut see: impl FnMut(usize, Sight)) {
        let mut lookout = Lookout::new(scene);
        let (mut glances, mut rays): (Vec<Glance>, Vec<Ray>) = (Vec::new(), Vec::new());
        for first in (0..points.len()).step_by(AT_ONCE) {
            let some = first..points.len().min(first + AT_ONCE);
            glances.extend(some.filter_map(|point| self.glance(point, points[point])));
            while !glances.is_empty() {
                rays.clear();
                rays.extend(glances.iter().map(|glance| glance.ray(self.eye)));
                let mut behind = 0;
                lookout.each_closest_hit(&rays, |number, hit| {
                    let (Some(hit), mut glance) = (hit, glances[number]) else { return };
                    let surface = &scene.surfaces()[hit.surface as usize];
                    glance.distance += hit.t;
                    glance.from = hit.surface;
                    if surface.is_active(hit.side) {
                        let sight = Sight {
                            piece: surface.piece(surface.cell_at(hit.uv), hit.side),
                            surface: hit.surface,
                            side: hit.side,
                            uv: hit.uv,
                            is_behind: rays[number].from != Ray::FREE,
                            distance: glance.distance,
                            cosine: surface.normal().dot(glance.direction).abs(),
                        };
                        see(glance.point, sight);
                    } else {
                        // A look that meets a back goes on behind it.
                        glances[behind] = glance;
                        behind += 1;
                    }
                });
                glances.truncate(behind);
            }
        }
    }

    /// The way from the eye to a point of the picture; `None` where it misses the box of a cut.
    fn glance(&self, point: usize, [x, y]: [f64; 2]) -> Option<Glance> {
        let direction = self.direction(x, y).normalize();
        let distance = match &self.cut {
            Some(bounds) => bounds.entry(self.eye, direction)?,
            None => 0.0,
        };
        Some(Glance { point, direction, distance, from: Ray::FREE })
    }

    /// Where the way through a point of the picture meets the plane of a surface, in local coordinates; `None` beyond its outline.
    pub(crate) fn on_plane(&self, surface: &Surface, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (corner, normal, direction) = (surface.point([0.0; 2]), surface.normal(), self.direction(x, y));
        let place = self.eye + direction * (normal.dot(corner - self.eye) / normal.dot(direction)) - corner;
        let [along_u, along_v] = [[1.0, 0.0], [0.0, 1.0]].map(|end| surface.point(end) - corner);
        let area = normal.dot(along_u.cross(along_v));
        let uv = [normal.dot(place.cross(along_v)) / area, normal.dot(along_u.cross(place)) / area];
        let is_inside = uv.iter().all(|x| (0.0..=1.0).contains(x));
        (is_inside && !(surface.is_triangle() && uv[0] + uv[1] > 1.0)).then_some(uv)
    }

    /// How wide a pixel is at a point in sight [m].
    pub(crate) fn width_of_pixel(&self, point: DVec3) -> f64 {
        (point - self.eye).dot(self.forward) * self.pixel
    }

    /// Where a point is seen in the picture [pixels]; `None` behind the eye.
    pub(crate) fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let sight = point - self.eye;
        let depth = sight.dot(self.forward);
        (depth > 0.0).then(|| {
            [
                (sight.dot(self.right) / depth - self.left) / self.pixel,
                (self.top - sight.dot(self.up) / depth) / self.pixel,
            ]
        })
    }

    fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.forward + self.right * (self.left + x * self.pixel) + self.up * (self.top - y * self.pixel)
    }

    /// The lit surface area in view [m²]; what is seen at a slant counts by the fourth root of its cosine,
    /// since a floor seen edge-on shows little.
    fn visible_area(&self, scene: &Scene, mut lit: impl FnMut(&Sight) -> bool) -> f64 {
        let [width, height] = self.size;
        let middles = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
        let middles: Vec<[f64; 2]> = middles.collect();
        let sights = middles.iter().zip(self.look(scene, &middles));
        let seen = sights.filter_map(|(&[x, y], sight)| Some((self.direction(x, y).length(), sight?)));
        let lit = seen.filter(|(_, sight)| lit(sight));
        lit.map(|(d, sight)| self.footprint(&sight, d) * sight.cosine.sqrt().sqrt()).sum()
    }

    /// The part of the pixels with something in sight whose sight is not lit.
    fn dark_part(&self, scene: &Scene, lit: impl Fn(u32) -> bool) -> f64 {
        let [width, height] = self.size;
        let middles = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
        let (mut seen, mut dark) = (0, 0);
        self.each_sight(scene, &middles.collect::<Vec<_>>(), |_, sight| {
            seen += 1;
            dark += u32::from(!lit(sight.piece));
        });
        f64::from(dark) / f64::from(seen.max(1))
    }

    /// The area that one pixel covers [m²]: with d the distance from the eye to the pixel on the plane at distance 1, a
    /// pixel of side p there spans the solid angle p²/d³.
    fn footprint(&self, sight: &Sight, d: f64) -> f64 {
        (sight.distance * self.pixel).powi(2) / (d.powi(3) * sight.cosine)
    }
}

/// A look that is under way.
#[derive(Clone, Copy)]
struct Glance {
    /// Which point of the picture it goes through.
    point: usize,
    /// The direction of the ray, of length 1.
    direction: DVec3,
    /// How far it has come [m].
    distance: f64,
    /// The back that it has passed last.
    from: u32,
}

impl Glance {
    fn ray(&self, eye: DVec3) -> Ray {
        Ray { origin: eye + self.direction * self.distance, direction: self.direction, from: self.from }
    }
}
