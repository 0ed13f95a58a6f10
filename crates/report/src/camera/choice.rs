//! The camera that a job asks for, or else the one of a fixed set of directions that sees most.

use glam::DVec3;
use job::{Stand, Vantage, View};
use parallel::on_all_cores;
use radiosity::Scene;

use super::inside::inside;
use super::{Camera, Sight};
use crate::bounds::Bounds;

/// Half the field of view: tan 20°, about that of a 50 mm lens.
const TAN_HALF_VIEW: f64 = 0.363_970_234_266_202_36;

/// The share of the picture that stays free around the scene's box.
const MARGIN: f64 = 0.03;

/// The shorter side of a picture is at least this part of the longer one.
const MIN_ASPECT: f64 = 0.4;

/// Steps that bring the middle of the scene's box into the middle of the picture.
const CENTRING: usize = 8;

/// Where lamps decide what is up, they emit this many times as much along it.
const UPRIGHT: f64 = 2.0;

/// How thick a shell a cut leaves out, as a part of the box.
const CUT: f64 = 0.02;

/// Azimuths tried, from the front: first along an axis, as rooms are, then oblique [degrees].
const AZIMUTHS: [f64; 12] = [0.0, 180.0, 90.0, 270.0, 30.0, 330.0, 60.0, 300.0, 120.0, 240.0, 150.0, 210.0];

/// Heights above the horizon tried [degrees]; from below last, for what can be seen from nowhere else.
const ELEVATIONS: [f64; 5] = [0.0, 20.0, 35.0, 55.0, -35.0];

/// A later direction must see this much more than an earlier one: rounding must not decide between the
/// views of a symmetric scene.
pub(super) const CLEARLY_MORE: f64 = 1.03;

/// Rays along the longer side of a trial picture.
pub(super) const TRIAL_SIZE: u32 = 40;

/// Where a view is only judged, pixels are this many times as large.
const TRIAL_STEP: u32 = 16;

/// The longer side of a picture whose size nothing says [pixels].
const SIZE: u32 = 800;

/// Width and height of a picture from a stand, where nothing says them [pixels].
pub(super) const STAND_SIZE: [u32; 2] = [800, 600];

/// Width and height of a picture from inside, where nothing says them [pixels].
const ROOM_SIZE: [u32; 2] = [800, 500];

/// A view from outside is taken where it shows more than this part of the lit area that one from inside shows.
const OUTSIDE: f64 = 0.5;

/// Of a room for people it must show this many times that area, and not through backs: a wall is missing, as that of a stage.
const OPEN: f64 = 1.5;

/// At most this part of what it shows is dark: outsides of walls, which no light reaches.
const MOST_DARK: f64 = 0.15;

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

impl Camera {
    /// The camera that a job asks for; without a stand the one that sees most.
    pub(crate) fn of_view(scene: &Scene, view: &View, lit: impl Fn(u32) -> bool + Sync) -> Self {
        match &view.stand {
            Some(stand) => Camera::at(scene, stand, view.size.unwrap_or(STAND_SIZE)),
            None => Camera::free(scene, view, lit),
        }
    }

    /// The camera of a view that names no stand.
    fn free(scene: &Scene, view: &View, lit: impl Fn(u32) -> bool + Sync) -> Self {
        let size = view.size.map_or(Size::Longest(SIZE), Size::Exactly);
        let of_room = view.size.unwrap_or(ROOM_SIZE);
        let frame = Frame::of(scene, &Bounds::below_sky(scene));
        let shape = f64::from(of_room[0]) / f64::from(of_room[1]);
        let within = match view.from {
            Some(Vantage::Outside) => None,
            _ => inside(scene, &frame, shape, &lit),
        };
        let Some(within) = within else { return Camera::best(scene, lit, size) };
        if view.from.is_none() {
            let for_people = within.is_for_people;
            let shows = |sight: &Sight| lit(sight.piece) && !(for_people && sight.is_behind);
            let (outside, area) = Camera::among(scene, &shows, size, &[false]);
            let least = (if for_people { OPEN } else { OUTSIDE }) * within.area;
            if area > least && outside.coarser(TRIAL_STEP).dark_part(scene, &lit) <= MOST_DARK {
                return outside;
            }
        }
        Camera::standing(scene, &frame, &within.stand, of_room)
    }

    /// A camera that stands where a job says.
    pub(super) fn at(scene: &Scene, stand: &Stand, size: [u32; 2]) -> Self {
        Camera::standing(scene, &Frame::of(scene, &Bounds::below_sky(scene)), stand, size)
    }

    /// [`Camera::at`] in a scene whose directions are known.
    pub(super) fn standing(scene: &Scene, frame: &Frame, stand: &Stand, size: [u32; 2]) -> Self {
        let [eye, target] = [stand.eye, stand.look_at].map(|point| point - scene.origin());
        let forward = (target - eye).normalize();
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

    /// The camera outside that sees most of a scene. `lit` tells whether a piece has anything to show.
    pub(crate) fn best(scene: &Scene, lit: impl Fn(u32) -> bool + Sync, size: Size) -> Self {
        Camera::among(scene, &|sight| lit(sight.piece), size, &[false, true]).0
    }

    /// The camera outside that sees most of what shows light, cut or not as is allowed, and the area of that in sight [m²].
    fn among(
        scene: &Scene,
        shows: &(impl Fn(&Sight) -> bool + Sync),
        size: Size,
        cuts: &[bool],
    ) -> (Self, f64) {
        let bounds = Bounds::below_sky(scene);
        let frame = Frame::of(scene, &bounds);
        let heights = cuts.iter().flat_map(|&cut| ELEVATIONS.map(|elevation| (elevation, cut)));
        let trials = heights.flat_map(|(elevation, cut)| AZIMUTHS.map(|azimuth| (azimuth, elevation, cut)));
        let trials: Vec<(f64, f64, bool)> = trials.collect();
        let areas = on_all_cores(trials.len(), |i| {
            let (azimuth, elevation, cut) = trials[i];
            let trial = frame.camera(&bounds, azimuth, elevation, cut, Size::Longest(TRIAL_SIZE));
            trial.visible_area(scene, shows)
        });
        let mut best = (0.0, (0.0, 0.0, false));
        for (trial, area) in trials.into_iter().zip(areas) {
            if area > best.0 * CLEARLY_MORE {
                best = (area, trial);
            }
        }
        let (area, (azimuth, elevation, cut)) = best;
        (frame.camera(&bounds, azimuth, elevation, cut, size), area)
    }
}

/// The directions that a scene calls up, right and front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) up: DVec3,
    /// To the right for a camera in front.
    pub(crate) right: DVec3,
    /// From the scene to a camera in front of it.
    pub(crate) front: DVec3,
}

impl Frame {
    pub(crate) fn of(scene: &Scene, bounds: &Bounds) -> Self {
        if y_is_up(scene, bounds.size()) {
            Frame { up: DVec3::Y, right: DVec3::X, front: DVec3::Z }
        } else {
            Frame { up: DVec3::Z, right: DVec3::X, front: DVec3::NEG_Y }
        }
    }

    /// How high a box is [m].
    pub(crate) fn height(&self, bounds: &Bounds) -> f64 {
        bounds.size().dot(self.up)
    }

    /// A camera in a direction [degrees], as near as shows the whole box.
    pub(super) fn camera(
        &self,
        bounds: &Bounds,
        azimuth: f64,
        elevation: f64,
        cut: bool,
        size: Size,
    ) -> Camera {
        let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation.to_radians().sin_cos();
        let level = self.front * cos_a + self.right * sin_a;
        let back = level * cos_e + self.up * sin_e;
        let right = self.up.cross(level);
        let up = back.cross(right);
        let mut target = bounds.middle();
        let (mut distance, mut window) = Window::towards(bounds, target, [right, up, back]);
        // The eye moves to where the box is in the middle of the picture, as other programs have it.
        for _ in 0..CENTRING {
            let [x, y] = window.middle();
            target += (right * x + up * y) * distance;
            (distance, window) = Window::towards(bounds, target, [right, up, back]);
        }
        window.centre();
        let (pixel, size) = match size {
            Size::Longest(longest) => {
                let pixel = window.longest() / f64::from(longest);
                (pixel, window.size().map(|length| (length / pixel).round() as u32))
            }
            Size::Exactly(size) => (window.grow_to(size), size),
        };
        Camera {
            eye: target + back * distance,
            right,
            up,
            vertical: self.up,
            target,
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
    /// The window around a box for an eye that looks at a target from its back, given the directions right, up and back;
    /// and the distance of that eye from the target [m].
    fn towards(bounds: &Bounds, target: DVec3, axes: [DVec3; 3]) -> (f64, Self) {
        let points = bounds.corners().map(|corner| axes.map(|axis| (corner - target).dot(axis)));
        let reach = points.map(|[x, y, z]| z + x.abs().max(y.abs()) / TAN_HALF_VIEW);
        let distance = reach.into_iter().fold(0.0, f64::max);
        (distance, Window::around(points.map(|[x, y, z]| [x / (distance - z), y / (distance - z)])))
    }

    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.min[axis] + self.max[axis]))
    }

    /// Grows until its middle is that of the picture plane.
    fn centre(&mut self) {
        for axis in [0, 1] {
            let half = self.max[axis].max(-self.min[axis]);
            (self.min[axis], self.max[axis]) = (-half, half);
        }
    }

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
/// that axis is up. Else lamps decide, which are mostly level: the axis that far more power is emitted along.
/// Where they cannot tell, z.
fn y_is_up(scene: &Scene, size: DVec3) -> bool {
    if size.y < 0.5 * size.z || size.z < 0.5 * size.y {
        return size.y < size.z;
    }
    let along = scene.faces().iter().fold(DVec3::ZERO, |sum, patch| {
        sum + patch.power(0) * scene.surfaces()[patch.surface as usize].normal().abs()
    });
    along.y > along.z * UPRIGHT
}
