//! Votes: what rays from the two sides of each surface see.

use radiosity::{Scene, Side, Sides, rays::Ray, surfaces::Surface};

use crate::losses::Losses;
use crate::pilot::{Draws, LightPilot};

/// The number of rays from each side of a one-sided surface, and the most of all together; in large scenes each side
/// has fewer.
const RAYS: usize = 48;
const MOST_RAYS: usize = 2_000_000;
const LEAST_RAYS: usize = 12;

/// The part of a side's rays that decides its view.
const MOST: f64 = 0.9;

/// What became of the rays from one side.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SideVotes {
    /// The part that left the scene.
    pub(crate) escaped: f64,
    /// The part that met the back of a one-sided surface.
    pub(crate) backs: f64,
    /// The part that met sides which the pilot has seen lit.
    pub(crate) lit: f64,
}

impl SideVotes {
    /// The part that met no active side.
    pub(crate) fn lost(self) -> f64 {
        self.escaped + self.backs
    }
}

/// The views of every surface: front and back.
pub(crate) struct Votes {
    views: Vec<[SideVotes; 2]>,
    one_sided: Vec<bool>,
}

impl Votes {
    pub(crate) fn take(scene: &Scene, pilot: &LightPilot) -> Self {
        let is_asked = |surface: &Surface| surface.sides() == Sides::Front;
        let asked = scene.surfaces().iter().filter(|surface| is_asked(surface)).count();
        let rays = (MOST_RAYS / (2 * asked).max(1)).clamp(LEAST_RAYS, RAYS) as u32;
        // Neither side of a two-sided surface is the wrong one.
        let views = (0..).zip(scene.surfaces()).map(|(number, surface)| match is_asked(surface) {
            true => [Side::Front, Side::Back].map(|side| view(scene, pilot, number, surface, side, rays)),
            false => [SideVotes::default(); 2],
        });
        Votes {
            views: views.collect(),
            one_sided: scene.surfaces().iter().map(|surface| surface.sides() == Sides::Front).collect(),
        }
    }

    pub(crate) fn front(&self, surface: u32) -> SideVotes {
        self.views[surface as usize][0]
    }

    pub(crate) fn is_one_sided(&self, surface: u32) -> bool {
        self.one_sided[surface as usize]
    }

    /// Whether the front of a surface sees a room with light in it, and its back sees nothing that reflects.
    pub(crate) fn is_right(&self, surface: u32) -> bool {
        let [front, back] = self.views[surface as usize];
        self.is_one_sided(surface) && front.lost() <= 0.5 && front.lit > 0.0 && back.lost() >= MOST
    }

    /// The one-sided surfaces whose back is where their front should be. Light arrives at the back, and one of these
    /// holds: the front sees nothing that reflects and the back does; the front looks out of the scene and the back
    /// into it; or the front sees darkness, as within a body that is inside out, and the back sees light. If most faces
    /// are flipped, no light arrives at any back, since all of it leaves the scene at once.
    pub(crate) fn flipped(&self, pilot: &LightPilot) -> Vec<u32> {
        let is_wrong = |surface: u32| {
            let [front, back] = self.views[surface as usize];
            let turned = front.lost() >= MOST && back.lost() <= 0.5;
            let outwards = front.escaped >= MOST && back.escaped <= 1.0 - MOST;
            let in_the_dark = front.lit == 0.0 && back.lit >= 0.5;
            self.is_one_sided(surface) && (turned || outwards || in_the_dark)
        };
        let wrong: Vec<u32> = (0..self.views.len() as u32).filter(|&surface| is_wrong(surface)).collect();
        let one_sided = self.one_sided.iter().filter(|one_sided| **one_sided).count();
        let all_are = Losses::of(pilot).at_once >= MOST && 2 * wrong.len() > one_sided;
        wrong.into_iter().filter(|&surface| all_are || pilot.back(surface) > 0.0).collect()
    }
}

fn view(
    scene: &Scene,
    pilot: &LightPilot,
    number: u32,
    surface: &Surface,
    side: Side,
    rays: u32,
) -> SideVotes {
    let mut draws = Draws::new(0x51DE ^ (u64::from(number) << 1) ^ (side == Side::Back) as u64);
    let mut view = SideVotes::default();
    for _ in 0..rays {
        let point = surface.point(surface.point_in_cell(0, [draws.uniform(), draws.uniform()]));
        let ray = Ray { origin: point, direction: surface.direction(side, draws.bits()), from: number };
        match scene.closest_hit(&ray) {
            None => view.escaped += 1.0 / f64::from(rays),
            Some(hit) => {
                let is_active = scene.surfaces()[hit.surface as usize].is_active(hit.side);
                view.backs += f64::from(u8::from(!is_active)) / f64::from(rays);
                view.lit += f64::from(u8::from(pilot.is_lit(hit.surface, hit.side))) / f64::from(rays);
            }
        }
    }
    view
}
