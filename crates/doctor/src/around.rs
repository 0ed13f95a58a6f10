//! What there is around places: rooms with ceilings or a sky, for scenes without lamps; and the side of a sheet that looks into a
//! room, for lamps whose file does not say where they shine.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use parallel::run_on_all_cores;
use radiosity::{
    IndexChoice, Scene, SceneError, SceneSpec, Side,
    rays::{Hit, Lookout, Ray},
};

use crate::pilot::{Draws, extent};

/// The places within the bounds of a scene from which it is looked at, and the rays from each.
const PLACES: u32 = 512;
const RAYS: u32 = 64;

/// The part of its rays that leaves the scene from a place outside.
const OUTSIDE: f64 = 0.5;

/// The mean part of rays that leaves through openings, from which what may be a room or a body is open: a small window in a large room. Cracks between
/// surfaces are far below.
const OPENING: f64 = 0.005;

/// The same for what is as large as rooms: doors and windows leave it a room, which has lamps. A sky would light the outside of its walls far more than what is
/// in it.
const OPEN_ROOM: f64 = 0.2;

/// The least part of all places that is a room, and that rooms are together.
const LEAST_ROOM: f64 = 0.03;
const LEAST_ROOMS: f64 = 0.15;

/// The least part of fronts in what a room shows. The inside of a solid body shows backs alone.
const FRONTS: f64 = 0.08;

/// The least thickness of what has an inside, in parts of its length.
const FLAT: f64 = 1e-3;

/// The distance of an assumed lamp from its ceiling, in parts of the height, and the half of its edge, in parts of that of a square
/// floor, which is as large as what the lamp lights.
const BELOW: f64 = 0.02;
const HALF_EDGE: f64 = 0.12;

/// A lamp lights a square of floor with edges of this many heights, and nothing that is as far away; no room has more lamps.
const SPACING: f64 = 2.0;
const MOST_LAMPS: usize = 32;

/// The places near the middle of a lamp's floor that are tried, and the steps in which these floors are shared out (S. P. Lloyd, IEEE Trans. Inf. Theory 28 (1982)).
const TRIED: usize = 16;
const SHARES: usize = 8;

/// A scene, looked at from places and surfaces.
pub struct Around {
    scene: Scene,
}

/// What a scene without lamps is like.
#[derive(Clone, Debug, PartialEq)]
pub enum Lightless {
    /// It has closed rooms.
    Rooms(Vec<ClosedRoom>),
    /// It lies under a sky, or opens to one; the mean part of directions within its bounds that leads out.
    Open(f64),
}

/// A room, which may have doors and windows.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedRoom {
    /// The area of its floor [m²].
    pub floor: f64,
    /// Places for lamps below the ceiling, one at least: a corner and its neighbours, the front downwards [m].
    pub lamps: Vec<[DVec3; 3]>,
}

/// A place with a ceiling above and a floor below it.
#[derive(Clone, Copy, Debug)]
struct Column {
    /// Where it meets the ceiling [m].
    ceiling: DVec3,
    /// From the floor to the ceiling [m].
    height: f64,
}

/// The side of a sheet that looks into a room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shine {
    /// The front does.
    Front,
    /// The back does.
    Back,
    /// Both do, or neither.
    Either,
}

/// A place, and what its rays met.
struct ProbePoint {
    point: DVec3,
    escaped: f64,
    fronts: f64,
}

impl Around {
    /// Makes ready to look at a scene, which need not have light.
    ///
    /// # Errors
    /// What [`Scene::build`] refuses but for missing light.
    pub fn of(spec: &SceneSpec) -> Result<Self, SceneError> {
        let mut lit = spec.clone();
        for surface in &mut lit.surfaces {
            (surface.reflectance, surface.emittance) = (0.5.into(), 0.0.into());
            surface.cell_emittance.clear();
        }
        // A scene has a lamp, and this one no more than it must.
        if let Some(first) = lit.surfaces.first_mut() {
            first.emittance = 1.0.into();
        }
        Ok(Around { scene: Scene::build_on(&lit, IndexChoice::Draft, &run_on_all_cores)? })
    }

    /// Finds the rooms of a scene, or that it is open. `is_room` says whether its size is that of rooms: then a closed hull whose
    /// fronts look outwards is taken for a room, not for a body.
    pub fn lightless(&self, is_room: bool) -> Lightless {
        let (low, high) = self.bounds();
        if (high - low).min_element() < FLAT * (high - low).max_element() {
            return Lightless::Open(1.0);
        }
        let places = self.look_around();
        let mean = |places: &[&ProbePoint], of: fn(&ProbePoint) -> f64| {
            places.iter().map(|place| of(place)).sum::<f64>() / places.len().max(1) as f64
        };
        let inside: Vec<&ProbePoint> = places.iter().filter(|place| place.escaped < OUTSIDE).collect();
        let part = |count: usize| count as f64 / f64::from(PLACES);
        let (mut closed, mut opened, mut rooms) = (0.0, 0.0, Vec::new());
        for room in self.connected(&inside) {
            let share = part(room.len());
            let is_body = !is_room && mean(&room, |place| place.fronts) < FRONTS;
            if share < LEAST_ROOM || is_body {
                continue;
            }
            if mean(&room, |place| place.escaped) >= if is_room { OPEN_ROOM } else { OPENING } {
                opened += share;
            } else if let Some(room) = self.room(&room) {
                closed += share;
                rooms.push(room);
            }
        }
        match closed >= LEAST_ROOMS && closed >= opened {
            true => Lightless::Rooms(rooms),
            false => Lightless::Open(mean(&places.iter().collect::<Vec<_>>(), |place| place.escaped)),
        }
    }

    /// Looks around from places that fill the bounds of the scene evenly: an additive recurrence (Roberts 2018).
    fn look_around(&self) -> Vec<ProbePoint> {
        // The root of x⁴ = x + 1.
        const RATIO: f64 = 1.220_744_084_605_76;
        let (low, high) = self.bounds();
        let mut lookout = Lookout::new(&self.scene);
        let directions: Vec<DVec3> = (0..RAYS).map(|i| on_sphere(i, RAYS)).collect();
        let place = |number: u32| {
            let along = |axis: i32| (0.5 + f64::from(number) / RATIO.powi(axis)).fract();
            let part = DVec3::new(along(1), along(2), along(3)) * 0.98 + DVec3::splat(0.01);
            let point = low + (high - low) * part;
            let ray = |&direction: &DVec3| Ray { origin: point, direction, from: Ray::FREE };
            let rays: Vec<Ray> = directions.iter().map(ray).collect();
            let hits = lookout.closest_hits(&rays);
            let met = hits.iter().flatten().count();
            let fronts = hits.iter().flatten().filter(|hit| hit.side == Side::Front).count();
            ProbePoint {
                point,
                escaped: 1.0 - met as f64 / f64::from(RAYS),
                fronts: fronts as f64 / met.max(1) as f64,
            }
        };
        (0..PLACES).map(place).collect()
    }

    fn bounds(&self) -> (DVec3, DVec3) {
        let corners = self.scene.surfaces().iter().flat_map(|surface| surface.outline());
        corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), corner| {
            (low.min(corner), high.max(corner))
        })
    }

    /// Groups places that see each other, perhaps over others.
    fn connected<'a>(&self, places: &[&'a ProbePoint]) -> Vec<Vec<&'a ProbePoint>> {
        let mut group: Vec<usize> = (0..places.len()).collect();
        fn root(group: &mut [usize], mut of: usize) -> usize {
            while group[of] != of {
                group[of] = group[group[of]];
                of = group[of];
            }
            of
        }
        for a in 0..places.len() {
            for b in a + 1..places.len() {
                let [of_a, of_b] = [a, b].map(|place| root(&mut group, place));
                if of_a != of_b && self.sees(places[a].point, places[b].point) {
                    group[of_b] = of_a;
                }
            }
        }
        let mut groups: Vec<Vec<&ProbePoint>> = vec![Vec::new(); places.len()];
        for (number, place) in places.iter().enumerate() {
            groups[root(&mut group, number)].push(place);
        }
        groups.retain(|group| !group.is_empty());
        groups
    }

    fn sees(&self, from: DVec3, to: DVec3) -> bool {
        let distance = from.distance(to);
        self.along(from, (to - from) / distance).is_none_or(|hit| hit.t > distance)
    }

    fn along(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.scene.closest_hit(&Ray { origin, direction, from: Ray::FREE })
    }

    /// The room of some places, with lamps that share out its floor; `None` where there is no ceiling above any of them.
    fn room(&self, places: &[&ProbePoint]) -> Option<ClosedRoom> {
        let column = |place: &&ProbePoint| {
            let [up, down] =
                [DVec3::Z, DVec3::NEG_Z].map(|way| self.along(place.point, way).map(|hit| hit.t));
            Some(Column { ceiling: place.point + DVec3::Z * up?, height: up? + down? })
        };
        let columns: Vec<Column> = places.iter().filter_map(column).collect();
        let (low, high) = self.bounds();
        // Each place stands for as much of the volume.
        let volume = (high - low).element_product() / f64::from(PLACES);
        let floor: f64 = columns.iter().map(|column| volume / column.height).sum();
        let height = volume * columns.len() as f64 / floor;
        let reach = SPACING * height;
        let fewest = (floor / reach.powi(2)).round().clamp(1.0, MOST_LAMPS as f64) as usize;
        let is_far = |share: &Vec<Column>| {
            let middle = middle_of(share);
            share.iter().any(|column| column.ceiling.truncate().distance(middle) > reach)
        };
        let mut shares = shared_out(&columns, fewest);
        while shares.iter().any(is_far) && shares.len() < MOST_LAMPS.min(columns.len()) {
            shares = shared_out(&columns, shares.len() + 1);
        }
        let half = HALF_EDGE * (floor / shares.len() as f64).sqrt();
        let lamps: Vec<[DVec3; 3]> = shares.iter().filter_map(|share| self.lamp(share, half)).collect();
        (!lamps.is_empty()).then_some(ClosedRoom { floor, lamps })
    }

    /// A place for a lamp with edges of twice `half`, if there is room for it, near the middle of some columns and where they are high.
    fn lamp(&self, columns: &[Column], half: f64) -> Option<[DVec3; 3]> {
        let middle = middle_of(columns);
        let score = |column: &Column| column.height - 0.5 * column.ceiling.truncate().distance(middle);
        let mut best: Vec<&Column> = columns.iter().collect();
        best.sort_by(|a, b| score(b).total_cmp(&score(a)));
        let tried = best.into_iter().take(TRIED).map(|&Column { ceiling, height }| {
            let centre = ceiling - DVec3::Z * (BELOW * height);
            let clear = (0..16).map(|i| {
                let (sin, cos) = (TAU * f64::from(i) / 16.0).sin_cos();
                self.along(centre, DVec3::new(cos, sin, 0.0)).map_or(f64::INFINITY, |hit| hit.t)
            });
            (centre, half.min(0.4 * clear.fold(f64::INFINITY, f64::min)))
        });
        // The first that has room for half of it, else the largest.
        let mut largest: Option<(DVec3, f64)> = None;
        for (centre, fits) in tried {
            if fits > largest.map_or(0.0, |(_, fits)| fits) {
                largest = Some((centre, fits));
            }
            if fits >= 0.5 * half {
                break;
            }
        }
        let (centre, half) = largest?;
        let corner = centre + self.scene.origin() - DVec3::new(half, half, 0.0);
        let [u, v] = [DVec3::X, DVec3::Y].map(|axis| corner + axis * (2.0 * half));
        Some([corner, v, u])
    }

    /// Says for some surfaces which side looks into a room, and not at something close by, at other surfaces that `is_own`, or
    /// out of the scene.
    pub fn shine(&self, surfaces: &[u32], is_own: impl Fn(u32) -> bool) -> Vec<Shine> {
        let close = 0.02 * extent(&self.scene);
        let far = |hit: Hit| hit.t >= close && !is_own(hit.surface);
        let decide = |[front, back]: [f64; 2]| match () {
            () if back > 2.0 * front + 0.05 => Shine::Back,
            () if front > 2.0 * back + 0.05 => Shine::Front,
            () => Shine::Either,
        };
        self.of_sides(surfaces, far).map(decide).collect()
    }

    /// Says for some shells which side of their surfaces alone looks out: the rays of the other one meet surfaces that `is_own` and little else.
    pub fn shells(&self, shells: &[Vec<u32>], is_own: impl Fn(u32) -> bool) -> Vec<Shine> {
        /// The part of the rays within that a shell holds at least, and the part of those outside that meet other things at least.
        const SHUT: f64 = 0.8;
        const OUT: f64 = 0.05;
        let all = shells.concat();
        let mut own = self.of_sides(&all, |hit| is_own(hit.surface));
        let mut others = self.of_sides(&all, |hit| !is_own(hit.surface));
        let mut decide = |shell: &Vec<u32>| {
            let areas: Vec<f64> =
                shell.iter().map(|&number| self.scene.surfaces()[number as usize].area()).collect();
            let mean = |of_sides: &mut dyn Iterator<Item = [f64; 2]>| {
                let mut sums = [0.0; 2];
                for (area, sides) in areas.iter().zip(of_sides) {
                    sums = [0, 1].map(|side| sums[side] + area * sides[side]);
                }
                sums.map(|sum| sum / areas.iter().sum::<f64>())
            };
            let (own, others) = (mean(&mut own), mean(&mut others));
            match [0, 1].map(|side| own[side] >= SHUT && others[1 - side] >= OUT) {
                [true, false] => Shine::Back,
                [false, true] => Shine::Front,
                _ => Shine::Either,
            }
        };
        shells.iter().map(&mut decide).collect()
    }

    /// The parts of the rays from the front and the back of each of some surfaces that meet what `counts`.
    fn of_sides(&self, surfaces: &[u32], counts: impl Fn(Hit) -> bool) -> impl Iterator<Item = [f64; 2]> {
        // Fewer than 4 rays of a side say nothing.
        const MOST_RAYS: usize = 400_000;
        let rays = (MOST_RAYS / (2 * surfaces.len()).max(1)).clamp(4, 32);
        let part = move |number: u32, side: Side| {
            let surface = &self.scene.surfaces()[number as usize];
            let mut draws = Draws::new(0xA2D ^ (u64::from(number) << 1) ^ (side == Side::Back) as u64);
            let counted = (0..rays).filter(|_| {
                let origin = surface.point(surface.point_in_cell(0, [draws.uniform(), draws.uniform()]));
                let ray = Ray { origin, direction: surface.direction(side, draws.bits()), from: number };
                self.scene.closest_hit(&ray).is_some_and(&counts)
            });
            counted.count() as f64 / rays as f64
        };
        surfaces.iter().map(move |&number| [Side::Front, Side::Back].map(|side| part(number, side)))
    }
}

/// Columns by what is nearest to one of `count` middles, seen from above. The first middles are as far from each other as can be.
fn shared_out(columns: &[Column], count: usize) -> Vec<Vec<Column>> {
    let at = |column: &Column| column.ceiling.truncate();
    let apart = |place: DVec2, middles: &[DVec2]| {
        middles.iter().map(|middle| middle.distance(place)).fold(f64::INFINITY, f64::min)
    };
    let mut middles = vec![middle_of(columns)];
    while middles.len() < count.min(columns.len()) {
        let farthest =
            columns.iter().map(at).max_by(|&a, &b| apart(a, &middles).total_cmp(&apart(b, &middles)));
        middles.extend(farthest);
    }
    let mut shares = Vec::new();
    for _ in 0..SHARES {
        shares = vec![Vec::new(); middles.len()];
        for column in columns {
            let distance = |&i: &usize| middles[i].distance(at(column));
            let nearest = (0..middles.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            shares[nearest.expect("there is a middle")].push(*column);
        }
        shares.retain(|share| !share.is_empty());
        middles = shares.iter().map(|share| middle_of(share)).collect();
    }
    shares
}

/// The middle of some columns, seen from above.
fn middle_of(columns: &[Column]) -> DVec2 {
    columns.iter().map(|column| column.ceiling.truncate()).sum::<DVec2>() / columns.len().max(1) as f64
}

/// Direction i of a number that are spread evenly: the spiral of Fibonacci.
fn on_sphere(i: u32, of: u32) -> DVec3 {
    // The root of x² = x + 1.
    const GOLDEN: f64 = 1.618_033_988_749_895;
    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(of);
    let (sin, cos) = (TAU * f64::from(i) / GOLDEN).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z).normalize()
}
