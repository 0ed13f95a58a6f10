//! What the two sides of a surface see.

use radiosity::{Ray, Scene, Side, Sides, Surface};

use crate::pilot::{Draws, Pilot};

/// Rays from each side of a one-sided surface, and of all together, where there are many: then fewer each.
const RAYS: usize = 48;
const MOST_RAYS: usize = 2_000_000;
const LEAST_RAYS: usize = 12;

/// A side is judged by this part of its rays.
const MOST: f64 = 0.9;

/// What became of the rays from one side.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct View {
    /// The part that left the scene.
    pub(crate) escaped: f64,
    /// The part that met the back of a one-sided surface.
    pub(crate) backs: f64,
}

impl View {
    /// The part that met no active side.
    pub(crate) fn lost(self) -> f64 {
        self.escaped + self.backs
    }
}

/// The views of every surface: front, back.
pub(crate) struct Votes {
    views: Vec<[View; 2]>,
    one_sided: Vec<bool>,
}

impl Votes {
    pub(crate) fn take(scene: &Scene) -> Self {
        let is_asked = |surface: &Surface| surface.sides() == Sides::Front;
        let asked = scene.surfaces().iter().filter(|surface| is_asked(surface)).count();
        let rays = (MOST_RAYS / (2 * asked).max(1)).clamp(LEAST_RAYS, RAYS) as u32;
        // Of surfaces with two sides neither is the wrong one.
        let views = (0..).zip(scene.surfaces()).map(|(number, surface)| match is_asked(surface) {
            true => [Side::Front, Side::Back].map(|side| view(scene, number, surface, side, rays)),
            false => [View::default(); 2],
        });
        Votes {
            views: views.collect(),
            one_sided: scene.surfaces().iter().map(|surface| surface.sides() == Sides::Front).collect(),
        }
    }

    pub(crate) fn front(&self, surface: u32) -> View {
        self.views[surface as usize][0]
    }

    pub(crate) fn is_one_sided(&self, surface: u32) -> bool {
        self.one_sided[surface as usize]
    }

    /// The one-sided surfaces whose back is where their front should be: light arrives at it; the front sees nothing that
    /// reflects and the back does, or the front looks out of the scene and the back into it. Where all faces are flipped, no
    /// light arrives at any back, since all of it leaves the scene at once.
    pub(crate) fn flipped(&self, pilot: &Pilot) -> Vec<u32> {
        let vanishes = pilot.losses().at_once >= MOST;
        let is_flipped = |surface: u32| {
            let [front, back] = self.views[surface as usize];
            let turned = front.lost() >= MOST && back.lost() <= 0.5;
            let outwards = front.escaped >= MOST && back.escaped <= 1.0 - MOST;
            let is_concerned = pilot.back(surface) > 0.0 || vanishes;
            self.is_one_sided(surface) && is_concerned && (turned || outwards)
        };
        (0..self.views.len() as u32).filter(|&surface| is_flipped(surface)).collect()
    }
}

fn view(scene: &Scene, number: u32, surface: &Surface, side: Side, rays: u32) -> View {
    let mut draws = Draws::new(0x51DE ^ (u64::from(number) << 1) ^ (side == Side::Back) as u64);
    let mut view = View::default();
    for _ in 0..rays {
        let point = surface.point(surface.point_in_cell(0, [draws.uniform(), draws.uniform()]));
        let ray = Ray { origin: point, direction: surface.direction(side, draws.bits()), from: number };
        match scene.closest_hit(&ray) {
            None => view.escaped += 1.0 / f64::from(rays),
            Some(hit) => {
                let is_active = scene.surfaces()[hit.surface as usize].is_active(hit.side);
                view.backs += f64::from(u8::from(!is_active)) / f64::from(rays);
            }
        }
    }
    view
}
