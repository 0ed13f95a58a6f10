//! What shines: bright pieces of faces, to which shadow rays go from every pixel.
//!
//! A lamp is chosen by going down a tree of boxes, at each node in proportion to a bound of the irradiance that each child brings
//! to the point (A. Conty Estevez & C. Kulla, *Importance sampling of many lights with adaptive tree splitting*, PACMCGIT 1(2), 2018; M.
//! Pharr, W. Jakob & G. Humphreys, *Physically based rendering*, 4th ed., §12.6.3).

use glam::DVec3;
use radiosity::{Scene, Side, surfaces::Surface};

use super::light::of_piece;

/// Emitters shine where their radiosity is above this many times the mean of what reflects only.
const BRIGHT_EMITTER: f64 = 3.0;

/// Pieces that only reflect shine above this many times the mean: what is next to a lamp.
const BRIGHT_REFLECTOR: f64 = 15.0;

/// Rays to lamps for each ray that gathers.
pub(super) const SHADOWS: u32 = 2;

/// In place of the number of a lamp.
const NONE: u32 = u32::MAX;

/// The lamps of a scene.
pub(super) struct Lamps {
    /// By piece: the lamp that it is, or is a part of; [`NONE`] for others.
    lamp_of: Vec<u32>,
    lamps: Vec<Lamp>,
    /// The tree; the root is the last.
    nodes: Vec<LampNode>,
    /// By node what is below it, apart from the rest, which a way down the tree does not read.
    children: Vec<Children>,
    /// By node, the one above it; the root is above itself.
    above: Vec<u32>,
    /// By lamp, its node.
    leaves: Vec<u32>,
}

/// A side of a surface that shines, or a cell of it.
struct Lamp {
    surface: u32,
    side: Side,
    /// `None` where all cells shine and emit alike.
    cell: Option<u32>,
    area: f64,
    /// B in three channels [W/m²].
    radiosity: [f64; 3],
}

/// A place on a lamp.
pub(super) struct Aim {
    pub(super) surface: u32,
    pub(super) side: Side,
    /// The direction from the point that is lit, length 1.
    pub(super) direction: DVec3,
    /// The irradiance that it brings if nothing is between, over the radiosity of the place, as [`Lamps::aim`] has it.
    pub(super) weight: f64,
}

/// By inner node of the tree, the chance of its left child as seen from one point. Each is computed where it is asked for: samples of
/// a pixel share the upper nodes.
pub(super) struct Odds {
    point: DVec3,
    normal: DVec3,
    /// The number of the point.
    number: u32,
    /// The number of the point that the chance is of, and the chance; NaN where neither child can light the point.
    left: Vec<(u32, f64)>,
}

impl Odds {
    pub(super) fn of(lamps: &Lamps) -> Self {
        let left = vec![(0, f64::NAN); lamps.nodes.len()];
        Odds { point: DVec3::ZERO, normal: DVec3::ZERO, number: 0, left }
    }

    /// Goes on to another point.
    pub(super) fn look_from(&mut self, point: DVec3, normal: DVec3) {
        (self.point, self.normal, self.number) = (point, normal, self.number + 1);
    }

    fn left(&mut self, lamps: &Lamps, node: usize, children: [u32; 2]) -> f64 {
        if self.left[node].0 != self.number {
            let [a, b] = children.map(|child| lamps.nodes[child as usize].bound(self.point, self.normal));
            self.left[node] = (self.number, a / (a + b));
        }
        self.left[node].1
    }
}

/// A part of the tree.
#[derive(Clone, Copy)]
struct LampNode {
    middle: DVec3,
    /// Half the diagonal of the box around the lamps [m].
    radius: f64,
    /// The cone that holds all normals: its axis, and the cosine of the angle between them.
    axis: DVec3,
    cos_cone: f64,
    sin_cone: f64,
    /// Power in all channels [W].
    power: f64,
}

#[derive(Clone, Copy)]
enum Children {
    Lamp(u32),
    Nodes([u32; 2]),
}

impl Lamps {
    /// The lamps of a scene with a radiosity for each face [W/m²], the channels of a face side by side.
    pub(super) fn new(scene: &Scene, radiosity: &[f64]) -> Self {
        let faces = scene.faces();
        let brightness = |piece: u32| of_piece(scene, radiosity, piece).into_iter().fold(0.0, f64::max);
        let (mut sum, mut area) = (0.0, 0.0);
        for piece in 0..faces.piece_count() as u32 {
            let face = faces.piece(piece);
            if !face.emittance.is_lit() && brightness(piece) > 0.0 {
                (sum, area) = (sum + face.area * brightness(piece), area + face.area);
            }
        }
        let mean = if area > 0.0 { sum / area } else { f64::INFINITY };
        let mut lamp_of = vec![NONE; faces.piece_count()];
        let mut lamps: Vec<Lamp> = Vec::new();
        for (number, surface) in (0..).zip(scene.surfaces()) {
            for side in [Side::Front, Side::Back].into_iter().filter(|side| surface.is_active(*side)) {
                let pieces = (0..surface.cell_count()).map(|cell| (cell, surface.piece(cell, side)));
                let (mut bright, mut shining): (Vec<Lamp>, Vec<u32>) = Default::default();
                for (cell, piece) in pieces {
                    let face = faces.piece(piece);
                    let least = if face.emittance.is_lit() { BRIGHT_EMITTER } else { BRIGHT_REFLECTOR };
                    if brightness(piece) > least * mean {
                        shining.push(piece);
                        let radiosity = of_piece(scene, radiosity, piece);
                        bright.push(Lamp {
                            surface: number,
                            side,
                            cell: Some(cell),
                            area: face.area,
                            radiosity,
                        });
                    }
                }
                let bright = whole(scene, bright);
                let is_whole = bright.len() < shining.len();
                for (k, piece) in (0..).zip(shining) {
                    lamp_of[piece as usize] = lamps.len() as u32 + if is_whole { 0 } else { k };
                }
                lamps.extend(bright);
            }
        }
        let (nodes, children, above) = Default::default();
        let mut tree = Lamps { lamp_of, lamps, nodes, children, above, leaves: Vec::new() };
        let leaves =
            (0..).zip(&tree.lamps).map(|(number, lamp)| (LampNode::of(scene, lamp), number)).collect();
        tree.grow(leaves);
        tree.above = (0..tree.nodes.len() as u32).collect();
        tree.leaves = vec![NONE; tree.lamps.len()];
        for (number, children) in (0..).zip(&tree.children) {
            match children {
                Children::Lamp(lamp) => tree.leaves[*lamp as usize] = number,
                Children::Nodes(children) => {
                    children.iter().for_each(|child| tree.above[*child as usize] = number);
                }
            }
        }
        tree
    }

    /// Whether a piece is a lamp, or a part of one.
    pub(super) fn has(&self, piece: u32) -> bool {
        self.lamp_of[piece as usize] != NONE
    }

    /// Whether nothing shines.
    pub(super) fn is_empty(&self) -> bool {
        self.lamps.is_empty()
    }

    /// Puts a tree over some leaves and returns the number of its root.
    fn grow(&mut self, mut leaves: Vec<(LampNode, u32)>) -> u32 {
        let (node, children) = match &leaves[..] {
            [] => return 0,
            &[(leaf, lamp)] => (leaf, Children::Lamp(lamp)),
            _ => {
                let middles = || leaves.iter().map(|leaf| leaf.0.middle);
                let (low, high) = (
                    middles().fold(DVec3::INFINITY, DVec3::min),
                    middles().fold(DVec3::NEG_INFINITY, DVec3::max),
                );
                let size = (high - low).to_array();
                let widest = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
                leaves.sort_by(|a, b| a.0.middle[widest].total_cmp(&b.0.middle[widest]));
                let right = leaves.split_off(leaves.len() / 2);
                let children = [self.grow(leaves), self.grow(right)];
                let [a, b] = children.map(|child| self.nodes[child as usize]);
                (a.joined(&b), Children::Nodes(children))
            }
        };
        self.nodes.push(node);
        self.children.push(children);
        self.nodes.len() as u32 - 1
    }

    /// The probability of a lamp by some odds.
    fn probability(&self, odds: &mut Odds, lamp: u32) -> f64 {
        let (mut node, mut probability) = (self.leaves[lamp as usize], 1.0);
        while self.above[node as usize] != node {
            let above = self.above[node as usize];
            if let Children::Nodes(children) = self.children[above as usize] {
                let left = odds.left(self, above as usize, children);
                probability *= if children[0] == node { left } else { 1.0 - left };
            }
            node = above;
        }
        if probability.is_nan() { 0.0 } else { probability }
    }

    /// The irradiance that a ray that gathers brings from the lamp that it meets, over the radiosity there, by the odds of its point; 0 where the piece is none. Rays that
    /// gather, of density cos θ / π, and those of [`Lamps::aim`] count by the balance heuristic (E. Veach & L. Guibas, *Optimally combining
    /// sampling techniques for Monte Carlo rendering*, SIGGRAPH 1995, eq. (11)): the former are right where a lamp is near, and the latter where it is far.
    pub(super) fn met(
        &self,
        scene: &Scene,
        odds: &mut Odds,
        piece: u32,
        direction: DVec3,
        distance: f64,
    ) -> f64 {
        let number = self.lamp_of[piece as usize];
        if number == NONE {
            return 0.0;
        }
        let lamp = &self.lamps[number as usize];
        let leaves = -scene.surfaces()[lamp.surface as usize].normal().dot(direction) * lamp.side.sign();
        let part = lamp.part(leaves, odds.normal.dot(direction), distance);
        balance(part, self.probability(odds, number))
    }

    /// A place on a lamp, from three numbers, by the odds of a place nearby in the same plane; `None` where no lamp can light the point.
    /// What it brings is part of the same sum as that of [`Lamps::met`], over one ray that gathers and [`SHADOWS`] like this.
    pub(super) fn aim(
        &self,
        scene: &Scene,
        odds: &mut Odds,
        point: DVec3,
        mut choice: f64,
        place: [f64; 2],
    ) -> Option<Aim> {
        let (mut node, mut probability) = (self.nodes.len().checked_sub(1)?, 1.0);
        let lamp = loop {
            match self.children[node] {
                Children::Lamp(lamp) => break &self.lamps[lamp as usize],
                Children::Nodes(children) => {
                    let left = odds.left(self, node, children);
                    if left.is_nan() {
                        return None;
                    }
                    let (child, first, part) =
                        if choice < left { (0, 0.0, left) } else { (1, left, 1.0 - left) };
                    node = children[child] as usize;
                    (choice, probability) = ((choice - first) / part, probability * part);
                }
            }
        };
        let normal = odds.normal;
        let surface = &scene.surfaces()[lamp.surface as usize];
        let way = surface.point(lamp.place(surface, place)) - point;
        let distance = way.length();
        let direction = way / distance;
        let (leaves, arrives) = (-surface.normal().dot(direction) * lamp.side.sign(), normal.dot(direction));
        if !(leaves > 0.0 && arrives > 0.0) {
            return None;
        }
        let weight = balance(lamp.part(leaves, arrives, distance), probability);
        Some(Aim { surface: lamp.surface, side: lamp.side, direction, weight })
    }
}

/// The cells of a side that shine as one lamp where they are all of them and emit alike.
fn whole(scene: &Scene, bright: Vec<Lamp>) -> Vec<Lamp> {
    let Some(&Lamp { surface, side, .. }) = bright.first() else { return bright };
    let emittance = |lamp: &Lamp| {
        scene.faces().piece(scene.surfaces()[surface as usize].piece(lamp.cell.unwrap_or(0), side)).emittance
    };
    let is_whole = bright.len() == scene.surfaces()[surface as usize].cell_count() as usize;
    let is_even =
        emittance(&bright[0]).is_lit() && bright.iter().all(|lamp| emittance(lamp) == emittance(&bright[0]));
    if bright.len() == 1 || !is_whole || !is_even {
        return bright;
    }
    let area: f64 = bright.iter().map(|lamp| lamp.area).sum();
    let radiosity =
        std::array::from_fn(|c| bright.iter().map(|lamp| lamp.area * lamp.radiosity[c]).sum::<f64>() / area);
    vec![Lamp { surface, side, cell: None, area, radiosity }]
}

/// The part of what a lamp brings, over its radiosity, that counts for one of the rays that may find it: `part` is what brings it all if the lamp were of one point
/// (its density over that of a ray that gathers is the inverse), `probability` that of aiming at it.
fn balance(part: f64, probability: f64) -> f64 {
    part / (part + f64::from(SHADOWS) * probability)
}

impl Lamp {
    /// A cos θ cos θ′ / π d²: the form factor of the lamp if all of it were where it is met.
    fn part(&self, leaves: f64, arrives: f64, distance: f64) -> f64 {
        self.area * leaves.max(0.0) * arrives.max(0.0) / (std::f64::consts::PI * distance * distance)
    }

    /// The local coordinates of a uniform point of it, from two uniforms.
    fn place(&self, surface: &Surface, place: [f64; 2]) -> [f64; 2] {
        match self.cell {
            Some(cell) => surface.point_in_cell(cell, place),
            None if surface.is_triangle() && place[0] + place[1] > 1.0 => place.map(|x| 1.0 - x),
            None => place,
        }
    }
}

impl LampNode {
    fn of(scene: &Scene, lamp: &Lamp) -> Self {
        let surface = &scene.surfaces()[lamp.surface as usize];
        let corners = match lamp.cell {
            Some(cell) => {
                let corners = scene.faces().piece_corners(surface.piece(cell, lamp.side));
                corners.into_iter().map(|corner| corner - scene.origin()).collect()
            }
            None => surface.outline(),
        };
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        LampNode {
            middle,
            radius,
            axis: scene.surfaces()[lamp.surface as usize].normal() * lamp.side.sign(),
            cos_cone: 1.0,
            sin_cone: 0.0,
            power: lamp.area * lamp.radiosity.iter().sum::<f64>(),
        }
    }

    /// The node above two.
    fn joined(&self, other: &LampNode) -> LampNode {
        let way = other.middle - self.middle;
        let distance = way.length();
        let radius = (0.5 * (distance + self.radius + other.radius)).max(self.radius).max(other.radius);
        let part = if distance > 0.0 { ((radius - self.radius) / distance).clamp(0.0, 1.0) } else { 0.0 };
        let axis = (self.axis * self.power + other.axis * other.power).normalize_or_zero();
        let reach = |node: &LampNode| {
            (node.axis.dot(axis).clamp(-1.0, 1.0).acos() + node.cos_cone.clamp(-1.0, 1.0).acos())
                .min(std::f64::consts::PI)
        };
        let cone = if axis == DVec3::ZERO { std::f64::consts::PI } else { reach(self).max(reach(other)) };
        LampNode {
            middle: self.middle + way * part,
            radius,
            axis,
            cos_cone: cone.cos(),
            sin_cone: cone.sin(),
            power: self.power + other.power,
        }
    }

    /// A bound of the irradiance at a point, up to a constant; 0 only where it is 0.
    fn bound(&self, point: DVec3, normal: DVec3) -> f64 {
        let way = self.middle - point;
        let squared = way.length_squared();
        let far = squared.max(self.radius * self.radius);
        if squared <= self.radius * self.radius {
            return self.power / far;
        }
        let inverse = 1.0 / squared.sqrt();
        // The box is seen within an angle of this sine about its middle.
        let sin_box = self.radius * inverse;
        let cos_box = (1.0 - sin_box * sin_box).max(0.0).sqrt();
        let leaves = less(-way.dot(self.axis) * inverse, self.cos_cone, self.sin_cone);
        let leaves = less(leaves, cos_box, sin_box);
        let arrives = less(way.dot(normal) * inverse, cos_box, sin_box);
        if leaves > 0.0 && arrives > 0.0 { self.power * leaves * arrives / far } else { 0.0 }
    }
}

/// The cosine of an angle less another, at least 0: of the one the cosine, of the other cosine and sine.
fn less(cos: f64, cos_by: f64, sin_by: f64) -> f64 {
    if cos >= cos_by { 1.0 } else { cos * cos_by + (1.0 - cos * cos).max(0.0).sqrt() * sin_by }
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, Scene, SceneSpec, rays::Ray};

    use super::super::numbers::{Use, point, unit};
    use super::*;
    use crate::scenes::quad;

    /// A point close below a corner of one lamp and far below that of another: both kinds of rays together bring what form factors say, by
    /// numbers that are spread evenly. The error of 2¹⁶ such samples is some 10⁻⁴.
    #[test]
    fn rays_that_gather_and_rays_to_lamps_add_up_to_form_factors() {
        let floor = quad("floor", [[-9., -9., 0.], [9., -9., 0.], [-9., 9., 0.]], [1, 1], 0.5);
        let mut near = quad("near", [[0., 0., 0.1], [0., 1., 0.1], [1., 0., 0.1]], [1, 1], 0.0);
        let mut far = quad("far", [[-2., 0., 2.], [-2., 1., 2.], [0., 0., 2.]], [1, 1], 0.0);
        (near.emittance, far.emittance) = (1.0.into(), 3.0.into());
        let scene = Scene::build(&SceneSpec::new(vec![floor, near, far]), IndexChoice::Auto).unwrap();
        let lamps = Lamps::new(&scene, &[0.01, 1.0, 3.0]);
        let mut odds = Odds::of(&lamps);
        let (place, floor) = (DVec3::ZERO - scene.origin(), &scene.surfaces()[0]);
        odds.look_from(place, DVec3::Z);
        let emitted = |surface: u32| [0.0, 1.0, 3.0][surface as usize];
        let (samples, mut sum) = (1 << 16, 0.0);
        for index in 0..samples {
            let [polar, turn] = point(index, Use::Direction);
            let direction = floor.direction(Side::Front, u64::from(polar) << 32 | u64::from(turn));
            let gathers = Ray { origin: place, direction, from: 0 };
            if let Some(hit) = scene.closest_hit(&gathers).filter(|hit| hit.side == Side::Front) {
                let piece = scene.surfaces()[hit.surface as usize].piece(0, hit.side);
                sum += emitted(hit.surface) * lamps.met(&scene, &mut odds, piece, direction, hit.t);
            }
            for (choice, of) in point(index, Use::Lamp).into_iter().zip([Use::OnLamp, Use::OnSecond]) {
                let on = point(index, of).map(unit);
                let Some(aim) = lamps.aim(&scene, &mut odds, place, unit(choice), on) else { continue };
                let to = Ray { origin: place, direction: aim.direction, from: 0 };
                if scene.closest_hit(&to).is_some_and(|hit| hit.surface == aim.surface) {
                    sum += emitted(aim.surface) * aim.weight;
                }
            }
        }
        // Of a rectangle above a corner: a and b are its sides over the distance.
        let corner = |a: f64, b: f64| {
            let half = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
            (half(a, b) + half(b, a)) / (2.0 * std::f64::consts::PI)
        };
        let (found, truth) = (sum / f64::from(samples), corner(10.0, 10.0) + 3.0 * corner(1.0, 0.5));
        assert!((found - truth).abs() < 1e-3 * truth, "{found} {truth}");
    }
}
