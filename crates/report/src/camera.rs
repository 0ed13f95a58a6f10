//! Where to look at a scene from.
//!
//! A camera stands outside of the scene's bounding box and looks at its middle in perspective, upright. Backs
//! of one-sided surfaces are see-through, so that one looks into a closed room as into a doll's house. Where
//! walls are two-sided that does not help: a *cut* leaves out what lies within a thin shell of the box on the
//! near side. Of a fixed set of directions, cut and uncut, the camera takes the one that sees most lit area. A job may
//! say where the camera stands instead.
//!
//! Coordinates are relative to [`Scene::origin`].

use glam::DVec3;
use job::{Stand, View};
use radiosity::{Hit, Ray, Scene};
use serde::Serialize;

use crate::bounds::Bounds;
use crate::cores::on_all_cores;

/// Half the field of view: tan 20°, about that of a 50 mm lens.
const TAN_HALF_VIEW: f64 = 0.363_970_234_266_202_36;

/// The share of the picture that stays free around the scene's box.
const MARGIN: f64 = 0.03;

/// The shorter side of a picture is at least this part of the longer one.
const MIN_ASPECT: f64 = 0.4;

/// How thick a shell a cut leaves out, as a part of the box.
const CUT: f64 = 0.02;

/// Azimuths tried, from the front: first along an axis, as rooms are, then oblique [degrees].
const AZIMUTHS: [f64; 12] = [0.0, 180.0, 90.0, 270.0, 30.0, 330.0, 60.0, 300.0, 120.0, 240.0, 150.0, 210.0];

/// Heights above the horizon tried [degrees]; from below last, for what can be seen from nowhere else.
const ELEVATIONS: [f64; 5] = [0.0, 20.0, 35.0, 55.0, -35.0];

/// A later direction must see this much more than an earlier one: rounding must not decide between the
/// views of a symmetric scene.
const CLEARLY_MORE: f64 = 1.03;

/// Rays along the longer side of a trial picture.
const TRIAL_SIZE: u32 = 40;

/// Rays that are under way together: what is noted of them stays in the cache.
const AT_ONCE: usize = 1024;

/// The longer side of a picture whose size nothing says [pixels].
const SIZE: u32 = 800;

/// Width and height of a picture from a stand, where nothing says them [pixels].
const STAND_SIZE: [u32; 2] = [800, 600];

/// An eye nearer to what it sees than this part of the scene's size stands on it.
const ON_A_WALL: f64 = 1e-3;

/// The sine of the smallest angle between the direction of view and the one that is up.
const PARALLEL: f64 = 1e-6;

/// How large a picture is [pixels].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Size {
    /// The longer side of the picture; the shape is that of the scene.
    Longest(u32),
    /// Width and height in pixels.
    Exactly([u32; 2]),
}

/// What a camera sees along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sight {
    /// The nearest piece of a face that faces the camera.
    pub piece: u32,
    /// The surface that the piece is on.
    surface: u32,
    /// Where on the piece's surface it is, in local coordinates.
    pub uv: [f64; 2],
    /// From the eye [m].
    distance: f64,
    /// Cosine between the ray and the surface's normal.
    cosine: f64,
}

/// Where a scene is seen from, in the coordinates of its file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Viewpoint {
    /// The place of the eye [m].
    pub eye: [f64; 3],
    /// The middle of the picture: that of the scene, unless a job says another point [m].
    pub look_at: [f64; 3],
    /// The direction that is up, of length 1.
    pub up: [f64; 3],
    /// The field of view from the lower to the upper edge [degrees].
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
    /// The left and upper edge of the picture, on the plane at distance 1 from the eye.
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
    /// The camera that a job asks for; without a stand the one that sees most.
    pub(crate) fn of_view(scene: &Scene, view: &View, lit: impl Fn(u32) -> bool + Sync) -> Self {
        match &view.stand {
            Some(stand) => Camera::at(scene, stand, view.size.unwrap_or(STAND_SIZE)),
            None => Camera::best(scene, lit, view.size.map_or(Size::Longest(SIZE), Size::Exactly)),
        }
    }

    /// A camera that stands where a job says.
    fn at(scene: &Scene, stand: &Stand, size: [u32; 2]) -> Self {
        let [eye, target] = [stand.eye, stand.look_at].map(|point| point - scene.origin());
        let forward = (target - eye).normalize();
        let frame = Frame::of(scene, &Bounds::of(scene));
        // From above, what is in front of the scene is below in the picture.
        let level = forward.cross(frame.up).length() > PARALLEL;
        let vertical = stand.up.unwrap_or(if level { frame.up } else { -frame.front });
        let right = forward.cross(vertical).normalize();
        let [width, height] = size.map(f64::from);
        let top = (0.5 * stand.fov).to_radians().tan();
        Camera {
            eye,
            right,
            up: right.cross(forward),
            vertical: vertical.normalize(),
            target,
            forward,
            left: -top * width / height,
            top,
            pixel: 2.0 * top / height,
            size,
            cut: None,
            said: Some([stand.eye, stand.look_at]),
        }
    }

    /// The camera that sees most of a scene. `lit` tells whether a surface has anything to show.
    pub(crate) fn best(scene: &Scene, lit: impl Fn(u32) -> bool + Sync, size: Size) -> Self {
        let bounds = Bounds::of(scene);
        let frame = Frame::of(scene, &bounds);
        let heights = [false, true].into_iter().flat_map(|cut| ELEVATIONS.map(|elevation| (elevation, cut)));
        let trials = heights.flat_map(|(elevation, cut)| AZIMUTHS.map(|azimuth| (azimuth, elevation, cut)));
        let trials: Vec<(f64, f64, bool)> = trials.collect();
        let areas = on_all_cores(trials.len(), |i| {
            let (azimuth, elevation, cut) = trials[i];
            let trial = frame.camera(&bounds, azimuth, elevation, cut, Size::Longest(TRIAL_SIZE));
            trial.visible_area(scene, &lit)
        });
        let mut best = (0.0, (0.0, 0.0, false));
        for (trial, area) in trials.into_iter().zip(areas) {
            if area > best.0 * CLEARLY_MORE {
                best = (area, trial);
            }
        }
        let (azimuth, elevation, cut) = best.1;
        frame.camera(&bounds, azimuth, elevation, cut, size)
    }

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
        let (mut glances, mut rays): (Vec<Glance>, Vec<Ray>) = (Vec::new(), Vec::new());
        for first in (0..points.len()).step_by(AT_ONCE) {
            let some = first..points.len().min(first + AT_ONCE);
            glances.extend(some.filter_map(|point| self.glance(point, points[point])));
            while !glances.is_empty() {
                rays.clear();
                rays.extend(glances.iter().map(|glance| glance.ray(self.eye)));
                let mut hits = scene.closest_hits(&rays).into_iter();
                glances.retain_mut(|glance| {
                    let Some(hit) = hits.next().flatten() else { return false };
                    let surface = &scene.surfaces()[hit.surface as usize];
                    glance.distance += hit.t;
                    glance.from = hit.surface;
                    let is_active = surface.is_active(hit.side);
                    if is_active {
                        sights[glance.point] = Some(Sight {
                            piece: surface.piece(surface.cell_at(hit.uv), hit.side),
                            surface: hit.surface,
                            uv: hit.uv,
                            distance: glance.distance,
                            cosine: surface.normal().dot(glance.direction).abs(),
                        });
                    }
                    // A look that meets a back goes on behind it.
                    !is_active
                });
            }
        }
        sights
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
    fn visible_area(&self, scene: &Scene, lit: &impl Fn(u32) -> bool) -> f64 {
        let [width, height] = self.size;
        let middles = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
        let middles: Vec<[f64; 2]> = middles.collect();
        let sights = middles.iter().zip(self.look(scene, &middles));
        let seen = sights.filter_map(|(&[x, y], sight)| Some((self.direction(x, y).length(), sight?)));
        let lit = seen.filter(|(_, sight)| lit(sight.surface));
        lit.map(|(d, sight)| self.footprint(&sight, d) * sight.cosine.sqrt().sqrt()).sum()
    }

    /// The area that one pixel covers [m²]: with d the distance from the eye to the pixel on the plane at distance 1, a
    /// pixel of side p there spans the solid angle p²/d³.
    fn footprint(&self, sight: &Sight, d: f64) -> f64 {
        (sight.distance * self.pixel).powi(2) / (d.powi(3) * sight.cosine)
    }
}

/// What is wrong with where a job lets the camera stand: a sentence each.
pub fn view_troubles(scene: &Scene, view: &View) -> Vec<String> {
    let Some(stand) = &view.stand else { return Vec::new() };
    let camera = Camera::at(scene, stand, view.size.unwrap_or(STAND_SIZE).map(|side| side.min(TRIAL_SIZE)));
    let [width, height] = camera.size;
    let middles = (0..height).flat_map(|y| (0..width).map(move |x| [x, y].map(|k| f64::from(k) + 0.5)));
    let middles: Vec<[f64; 2]> = middles.collect();
    let rays: Vec<Ray> = middles
        .iter()
        .map(|&[x, y]| Ray {
            origin: camera.eye,
            direction: camera.direction(x, y).normalize(),
            from: Ray::FREE,
        })
        .collect();
    let first: Vec<Hit> = scene.closest_hits(&rays).into_iter().flatten().collect();
    let seen = camera.look(scene, &middles).into_iter().flatten().count();
    if seen == 0 {
        let why = if first.is_empty() {
            "no surface is in front of it"
        } else {
            "surfaces show it only their backs"
        };
        return vec![format!("[view] sees nothing: {why}; move eye or look_at, or remove [view]")];
    }
    let bounds = Bounds::of(scene);
    let share = |part: usize, whole: usize| format!("{:.0} %", 100.0 * part as f64 / whole as f64);
    let most = |hits: usize| hits > 0 && 2 * hits > first.len();
    let near = ON_A_WALL * bounds.size().max_element();
    let close = first.iter().filter(|hit| hit.t < near).count();
    if most(close) {
        let wall =
            scene.surface_name(first.iter().min_by(|a, b| a.t.total_cmp(&b.t)).map_or(0, |hit| hit.surface));
        return vec![format!(
            "the eye of [view] stands on a wall: {} of what it sees is nearer than {near:.1e} m, \"{wall}\" first; move it away",
            share(close, first.len())
        )];
    }
    let is_back = |hit: &&Hit| !scene.surfaces()[hit.surface as usize].is_active(hit.side);
    let backs = first.iter().filter(is_back).count();
    if bounds.contains(camera.eye) && most(backs) {
        return vec![format!(
            "the eye of [view] stands inside a wall or a block: {} of what it meets first are backs of one-sided surfaces, \
             which are left out of the picture; move it to where fronts face it",
            share(backs, first.len())
        )];
    }
    Vec::new()
}

/// A look that is under way.
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

/// The directions that a scene calls up, right and front.
#[derive(Clone, Copy, Debug)]
struct Frame {
    up: DVec3,
    /// To the right for a camera in front.
    right: DVec3,
    /// From the scene to a camera in front of it.
    front: DVec3,
}

impl Frame {
    fn of(scene: &Scene, bounds: &Bounds) -> Self {
        if y_is_up(scene, bounds.size()) {
            Frame { up: DVec3::Y, right: DVec3::X, front: DVec3::Z }
        } else {
            Frame { up: DVec3::Z, right: DVec3::X, front: DVec3::NEG_Y }
        }
    }

    /// A camera in a direction [degrees], as near as shows the whole box.
    fn camera(&self, bounds: &Bounds, azimuth: f64, elevation: f64, cut: bool, size: Size) -> Camera {
        let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation.to_radians().sin_cos();
        let level = self.front * cos_a + self.right * sin_a;
        let back = level * cos_e + self.up * sin_e;
        let right = self.up.cross(level);
        let up = back.cross(right);
        let points = bounds.corners().map(|corner| {
            let offset = corner - bounds.middle();
            [offset.dot(right), offset.dot(up), offset.dot(back)]
        });
        let reach = points.map(|[x, y, z]| z + x.abs().max(y.abs()) / TAN_HALF_VIEW);
        let distance = reach.into_iter().fold(0.0, f64::max);
        let mut window = Window::around(points.map(|[x, y, z]| [x / (distance - z), y / (distance - z)]));
        let (pixel, size) = match size {
            Size::Longest(longest) => {
                let pixel = window.longest() / f64::from(longest);
                (pixel, window.size().map(|length| (length / pixel).round() as u32))
            }
            Size::Exactly(size) => (window.grow_to(size), size),
        };
        Camera {
            eye: bounds.middle() + back * distance,
            right,
            up,
            vertical: self.up,
            target: bounds.middle(),
            forward: -back,
            left: window.min[0],
            top: window.max[1],
            pixel,
            size,
            cut: cut.then(|| Bounds {
                min: bounds.min + CUT * bounds.size(),
                max: bounds.max - CUT * bounds.size(),
            }),
            said: None,
        }
    }
}

/// A rectangle on the picture plane.
struct Window {
    min: [f64; 2],
    max: [f64; 2],
}

impl Window {
    /// The rectangle around points, with a margin, and not too slim.
    fn around(points: [[f64; 2]; 8]) -> Self {
        let extreme = |axis: usize, pick: fn(f64, f64) -> f64| {
            points.iter().map(|point| point[axis]).reduce(pick).unwrap_or(0.0)
        };
        let tight = Window {
            min: [extreme(0, f64::min), extreme(1, f64::min)],
            max: [extreme(0, f64::max), extreme(1, f64::max)],
        };
        let margin = MARGIN * tight.longest();
        let least = MIN_ASPECT * (tight.longest() + 2.0 * margin);
        let grow = tight.size().map(|length| margin.max(0.5 * (least - length)));
        Window {
            min: [tight.min[0] - grow[0], tight.min[1] - grow[1]],
            max: [tight.max[0] + grow[0], tight.max[1] + grow[1]],
        }
    }

    /// Grows to the shape of a picture of this size in pixels; returns the size of one pixel.
    fn grow_to(&mut self, size: [u32; 2]) -> f64 {
        let sizes = self.size();
        let pixel = (sizes[0] / f64::from(size[0])).max(sizes[1] / f64::from(size[1]));
        for axis in [0, 1] {
            let more = 0.5 * (pixel * f64::from(size[axis]) - sizes[axis]);
            self.min[axis] -= more;
            self.max[axis] += more;
        }
        pixel
    }

    fn size(&self) -> [f64; 2] {
        [self.max[0] - self.min[0], self.max[1] - self.min[1]]
    }

    fn longest(&self) -> f64 {
        let [width, height] = self.size();
        width.max(height)
    }
}

/// Whether y rather than z is up. A scene is wider than high: where one extent is less than half the other,
/// that axis is up. Else lamps decide, which are mostly level: the axis that more power is emitted along.
/// Where they cannot tell, z.
fn y_is_up(scene: &Scene, size: DVec3) -> bool {
    if size.y < 0.5 * size.z || size.z < 0.5 * size.y {
        return size.y < size.z;
    }
    let along = scene.faces().iter().fold(DVec3::ZERO, |sum, patch| {
        sum + patch.power(0) * scene.surfaces()[patch.surface as usize].normal().abs()
    });
    along.y > along.z * CLEARLY_MORE
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, SceneSpec, Shape, Sides};

    use super::*;
    use crate::scenes::{cornell, cube, cube_spec, quad};

    fn build(spec: &SceneSpec) -> Scene {
        Scene::build(spec, IndexChoice::Auto).unwrap()
    }

    fn best(scene: &Scene) -> Camera {
        Camera::best(scene, |_| true, Size::Longest(200))
    }

    fn patch_at(scene: &Scene, camera: &Camera, point: DVec3) -> Option<u32> {
        let [x, y] = camera.project(point - scene.origin()).expect("the eye looks at the scene");
        camera.look(scene, &[[x, y]])[0].map(|sight| scene.faces().face_of(sight.piece))
    }

    fn named(scene: &Scene, name: &str) -> usize {
        scene.faces().iter().position(|patch| scene.surface_name(patch.surface) == name).unwrap()
    }

    #[test]
    fn an_open_box_is_seen_through_its_front_and_upright() {
        let scene = build(&cornell());
        let camera = best(&scene);
        assert!(camera.forward.z > 0.999 && camera.up.y > 0.999, "{camera:?}");
        for name in ["floor", "ceiling", "back", "dark", "light", "lamp", "short"] {
            let first = named(&scene, name);
            let surface = scene.faces().get(first).surface;
            let own = scene.faces().iter().skip(first).take_while(|patch| patch.surface == surface);
            let seen = (first as u32..)
                .zip(own)
                .filter(|(number, patch)| patch_at(&scene, &camera, patch.centroid) == Some(*number));
            assert!(seen.count() > 0, "{name}");
        }
    }

    #[test]
    fn one_looks_through_the_backs_of_a_closed_room() {
        let scene = cube();
        let camera = best(&scene);
        assert!(camera.up.z > 0.999 && camera.cut.is_none());
        let seen = |(number, patch): &(u32, radiosity::Face)| {
            patch_at(&scene, &camera, patch.centroid) == Some(*number)
        };
        assert_eq!((0..).zip(scene.faces()).filter(seen).count(), 45);
    }

    #[test]
    fn two_sided_walls_are_cut_away() {
        let mut spec = cube_spec();
        for surface in &mut spec.surfaces {
            surface.sides = Sides::Both;
        }
        let scene = build(&spec);
        let camera = best(&scene);
        assert!(camera.cut.is_some());
        let lamp = scene.faces().iter().position(|patch| patch.emittance.is_lit()).unwrap();
        assert_eq!(patch_at(&scene, &camera, scene.faces().get(lamp).centroid), Some(lamp as u32));
    }

    #[test]
    fn unlit_sides_do_not_draw_the_camera() {
        let scene = cube();
        let camera = Camera::best(&scene, |surface| surface == 0, Size::Longest(200));
        assert!(camera.forward.z < -0.5, "{camera:?}");
    }

    #[test]
    fn a_plate_is_seen_from_its_front() {
        for (corners, forward) in [
            ([[0., 0., 0.], [2., 0., 0.], [0., 3., 0.]], -1.0),
            ([[0., 0., 0.], [0., 3., 0.], [2., 0., 0.]], 1.0),
        ] {
            let mut plate = quad("plate", corners, [2, 2], 0.5);
            plate.emittance = 1.0.into();
            let scene = build(&SceneSpec::new(vec![plate]));
            let camera = best(&scene);
            assert!(camera.up.z > 0.5 && camera.forward.z * forward > 0.5, "{camera:?}");
            assert_eq!(patch_at(&scene, &camera, scene.faces().get(3).centroid), Some(3));
        }
    }

    #[test]
    fn the_shortest_extent_is_up_and_lamps_decide_among_equals() {
        let mut spec = cube_spec();
        let up = |spec: &SceneSpec| best(&build(spec)).up.round();
        assert_eq!(up(&spec), DVec3::Z);
        spec.surfaces[1].cell_emittance.clear();
        spec.surfaces[3].cell_emittance = vec![(4, 1.0.into())];
        assert_eq!(up(&spec), DVec3::Y);
        for surface in &mut spec.surfaces {
            if let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut surface.shape {
                for point in [corner, corner_u, corner_v] {
                    point.y *= 5.0;
                }
            }
        }
        assert_eq!(up(&spec), DVec3::Z);
    }

    #[test]
    fn the_whole_scene_is_in_the_picture() {
        let scene = build(&cornell());
        let bounds = Bounds::of(&scene);
        let frame = Frame::of(&scene, &bounds);
        for (azimuth, elevation) in [(0.0, 0.0), (30.0, 20.0), (240.0, 55.0)] {
            let camera = frame.camera(&bounds, azimuth, elevation, false, Size::Longest(300));
            let [width, height] = camera.size.map(f64::from);
            assert!(width.max(height) == 300.0);
            for [x, y] in bounds.corners().map(|corner| camera.project(corner).unwrap()) {
                assert!(x > 0.0 && x < width && y > 0.0 && y < height, "{x} {y}");
            }
        }
    }

    fn view(eye: DVec3, look_at: DVec3) -> View {
        View { stand: Some(Stand { eye, look_at, up: None, fov: 60.0 }), ..View::default() }
    }

    #[test]
    fn a_stand_sees_what_it_looks_at_upright() {
        let scene = cube();
        let eye = DVec3::new(0.5, 0.1, 0.5);
        let [wall, lamp] = [DVec3::new(0.5, 1.0, 0.5), DVec3::new(0.5, 0.5, 1.0)];
        for up in [None, Some(DVec3::new(0.0, -0.3, 2.0))] {
            let mut level = view(eye, wall);
            level.stand.as_mut().unwrap().up = up;
            level.size = Some([300, 200]);
            let camera = Camera::of_view(&scene, &level, |_| true);
            let at = |point: DVec3| camera.project(point - scene.origin()).unwrap();
            let [x, y] = at(wall);
            assert!((x - 150.0).abs() < 1e-9 && (y - 100.0).abs() < 1e-9, "{x} {y}");
            // 60° from the lower to the upper edge, 0.9 m away; x grows to the right, z upwards.
            let half = 0.9 * 30_f64.to_radians().tan();
            assert!(at(wall + DVec3::Z * half)[1].abs() < 1e-9);
            assert!(at(wall + DVec3::X * half)[0] > 249.0);
            let shown = camera.viewpoint(&scene);
            assert!((shown.fov - 60.0).abs() < 1e-9 && (DVec3::from(shown.look_at) - wall).length() < 1e-9);
        }
        // Straight up, where the scene's own up tells nothing.
        let camera = Camera::of_view(&scene, &view(DVec3::new(0.5, 0.5, 0.1), lamp), |_| true);
        let middle = camera.look(&scene, &[camera.size.map(|side| f64::from(side) / 2.0)])[0].unwrap();
        assert!(scene.faces().piece(middle.piece).emittance.is_lit());
    }

    #[test]
    fn a_size_changes_the_frame_and_not_the_direction() {
        let scene = build(&cornell());
        let [free, wide] = [None, Some([600, 200])]
            .map(|size| Camera::of_view(&scene, &View { size, ..View::default() }, |_| true));
        assert_eq!((free.eye, free.forward, wide.size), (wide.eye, wide.forward, [600, 200]));
        for corner in Bounds::of(&scene).corners() {
            let [x, y] = wide.project(corner).unwrap();
            assert!(x > 0.0 && x < 600.0 && y > 0.0 && y < 200.0, "{x} {y}");
        }
    }

    #[test]
    fn stands_that_show_nothing_are_told() {
        let scene = cube();
        let middle = DVec3::splat(0.5);
        let told = |eye: DVec3, look_at: DVec3| view_troubles(&scene, &view(eye, look_at)).join("; ");
        assert_eq!(told(DVec3::new(0.5, 0.1, 0.5), middle), "");
        assert_eq!(
            told(DVec3::new(0.5, -3.0, 0.5), middle),
            "",
            "a room is seen through the backs of its walls"
        );
        assert!(
            told(DVec3::new(0.5, -3.0, 0.5), DVec3::new(0.5, -9.0, 0.5)).contains("no surface is in front")
        );
        assert!(told(DVec3::new(0.5, 1e-5, 0.5), DVec3::new(0.5, -1.0, 0.5)).contains("stands on a wall"));
        // From inside a block one sees the room through its faces' backs.
        let scene = build(&cornell());
        let block = view(DVec3::new(0.67, 0.15, 0.28), DVec3::new(0.5, 0.2, 1.0));
        let told = view_troubles(&scene, &block).join("; ");
        assert!(told.contains("inside a wall or a block"), "{told}");
        assert!(view_troubles(&scene, &View::default()).is_empty());
    }

    #[test]
    fn a_cut_leaves_out_the_near_shell_only() {
        let bounds = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        assert_eq!(bounds.entry(DVec3::new(0.5, 0.5, -2.0), DVec3::Z), Some(2.0));
        assert_eq!(bounds.entry(DVec3::new(0.5, 0.5, -2.0), DVec3::NEG_Z), None);
        assert_eq!(bounds.entry(DVec3::new(1.5, 0.5, -2.0), DVec3::Z), None);
        assert_eq!(bounds.entry(DVec3::splat(0.5), DVec3::X), Some(0.0));
    }

    #[test]
    fn the_pixels_of_a_plate_cover_its_area() {
        let mut plate = quad("plate", [[0., 0., 0.], [3., 0., 0.], [0., 2., 0.]], [1, 1], 0.5);
        plate.emittance = 1.0.into();
        let scene = build(&SceneSpec::new(vec![plate]));
        let bounds = Bounds::of(&scene);
        let camera = Frame::of(&scene, &bounds).camera(&bounds, 30.0, 35.0, false, Size::Longest(400));
        let mut area = 0.0;
        for (x, y) in (0..camera.size[1]).flat_map(|y| (0..camera.size[0]).map(move |x| (x, y))) {
            let [x, y] = [x, y].map(f64::from);
            if let Some(sight) = camera.look(&scene, &[[x, y]])[0] {
                area += camera.footprint(&sight, camera.direction(x, y).length());
            }
        }
        assert!((area - 6.0).abs() < 0.1, "{area}");
    }
}
