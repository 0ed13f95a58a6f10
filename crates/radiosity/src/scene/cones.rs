//! Births of light in cones, many side by side: at lamps that shine alike in every direction, at spots, and from the discs of distant lamps.
//!
//! Light of one intensity is uniform in the cosine to the aim. Beside its full cone the intensity of a spot is t², t being linear in the cosine:
//! the largest of three uniform numbers has that density.

use super::tables::{LampRays, OF_LAMP, from_lamps};
use crate::geometry::lamp::Emission;
use crate::random::rng::units;
use crate::random::sampling::cosine_directions;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::simd::table::Table;

/// 2³².
const WORD: f64 = 4_294_967_296.0;

/// The cones of the lamps of a scene, as births need them.
#[derive(Clone, Debug)]
pub(crate) struct LightCones {
    /// Of each lamp: its position, or three times the radius of the disc of a distant one; its axes in the scene; and its [`cone`].
    lamps: Table<OF_LAMP>,
    /// Where light of distant lamps sets out; `None` without one.
    discs: Option<Discs>,
}

/// Where light of distant lamps sets out.
#[derive(Clone, Copy, Debug)]
struct Discs {
    /// The box that it sets out from, least and greatest coordinates [m]; `None`: from the discs themselves.
    room: Option<[[f64; 3]; 2]>,
}

/// The cone of a lamp, in cosines to the aim: the width of its full part, the flux of both parts over 2π and the intensity, the least cosine, and
/// the width of the fading part. Where nothing fades 0 stands for the flux, so that the full part is chosen; of parallel light both parts are the
/// aim. The least cosine of a distant lamp is 1, which no spot has. The first width of a lamp with a table, which has no cone, is negative.
fn cone(emission: Emission) -> [f64; 4] {
    match emission {
        Emission::Table(_) => [-1.0, 0.0, 0.0, 0.0],
        Emission::Uniform => [2.0, 0.0, -1.0, 0.0],
        Emission::Spot { inner, outer } => {
            let (full, fading) = (1.0 - inner, (inner - outer) / 3.0);
            [full, full + fading, outer, inner - outer]
        }
        Emission::Distant { rim } => [1.0 - rim, 0.0, 1.0, 0.0],
    }
}

impl LightCones {
    /// The cones of lamps, and of each twelve numbers more: its position, or three times the radius of its disc [m], and its axes in the scene.
    /// `None` without a cone. Light of distant lamps sets out where it enters the `room`, if there is one.
    pub(super) fn new(
        lamps: impl Iterator<Item = (Emission, [f64; OF_LAMP - 4])>,
        room: Option<[[f64; 3]; 2]>,
    ) -> Option<Self> {
        let (mut rows, mut has_cones, mut has_discs) = (Vec::new(), false, false);
        for (emission, numbers) in lamps {
            has_cones |= !matches!(emission, Emission::Table(_));
            has_discs |= matches!(emission, Emission::Distant { .. });
            let mut row = [0.0; OF_LAMP];
            row[..12].copy_from_slice(&numbers);
            row[12..].copy_from_slice(&cone(emission));
            rows.push(row);
        }
        has_cones.then(|| LightCones { lamps: Table::new(rows), discs: has_discs.then_some(Discs { room }) })
    }

    /// What the cones take of memory [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.lamps.bytes()
    }

    /// The rays of the births of a batch from place `begin` on at lamps with cones, made of three times 64 random bits, from number `from` on.
    /// Rays of births at lamps with tables stay; others get some ray.
    pub(crate) fn bear(
        &self,
        isa: Isa,
        (lamps, begin): (&[u32; WIDTH], usize),
        bits: [&[u64; WIDTH]; 3],
        rays: (&mut LampRays, usize),
    ) {
        let cones = self;
        on_isa!(isa, bear_all(
            cones: &LightCones,
            lamps: &[u32; WIDTH],
            begin: usize,
            bits: [&[u64; WIDTH]; 3],
            rays: (&mut LampRays, usize),
        ));
    }

    /// Origin [m] and direction of a birth at a lamp with a cone.
    pub(super) fn bear_one(&self, lamp: usize, [place, point, direction]: [u64; 3]) -> [f64; 6] {
        ray(*self.lamps.row(lamp as u32), self.discs, [&[place], &[point], &[direction]])
    }

    /// The direction alone of such a birth at a distant lamp.
    pub(super) fn direction_of_distant(&self, lamp: usize, bits: u64) -> [f64; 3] {
        let [.., x, y, z] = ray(*self.lamps.row(lamp as u32), None, [&[0], &[0], &[bits]]);
        [x, y, z]
    }
}

#[inline(always)]
fn bear_all<R: Real>(
    cones: &LightCones,
    lamps: &[u32; WIDTH],
    begin: usize,
    [places, points, directions]: [&[u64; WIDTH]; 3],
    (rays, from): (&mut LampRays, usize),
) {
    // One lamp alone is looked up once.
    let (is_alone, alone) = (cones.lamps.len() == 1, R::rows(&cones.lamps, &[0; WIDTH]));
    for first in (begin / R::N * R::N..WIDTH).step_by(R::N) {
        let lamp = if is_alone { alone } else { R::rows(&cones.lamps, &lamps[first..]) };
        let bits = [&places[first..], &points[first..], &directions[first..]];
        let ray = ray(lamp, cones.discs, bits);
        let [.., full, _, _, _] = lamp;
        let has_cone = R::splat(0.0).le(full);
        for axis in 0..6 {
            let row = &mut rays[axis][from + first..];
            R::select(has_cone, ray[axis], R::load(row)).store(row);
        }
    }
}

/// Origin and direction of births at N lamps with cones, of which some may be distant.
#[inline(always)]
fn ray<R: Real>(
    lamp: [R; OF_LAMP],
    discs: Option<Discs>,
    [places, points, directions]: [&[u64]; 3],
) -> [R; 6] {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let [.., full, flux, outer, width] = lamp;
    let [x, y, _] = cosine_directions::<R>(directions);
    // The azimuth does not depend on x² + y², which is uniform.
    let square = x * x + y * y;
    let u = R::select(square.lt(one), square, one);
    let cosine = cosine([full, flux, outer, width], u, [places, points]);
    let scale = ((one - cosine * cosine).max(zero) / square).sqrt();
    let mut ray = from_lamps(lamp, [x * scale, y * scale, R::splat(-1.0) * cosine]);
    if let Some(Discs { room }) = discs {
        let [rx, ry, rz, dx, dy, dz] = ray;
        let way = [dx, dy, dz];
        let mut origin = on_discs([rx, ry, rz], way, points);
        if let Some(room) = room {
            origin = entered(room, (origin, way), R::splat(4.0) * rx);
        }
        let is_distant = one.le(outer);
        for axis in 0..3 {
            ray[axis] = R::select(is_distant, origin[axis], ray[axis]);
        }
    }
    ray
}

/// The cosines to the aim at which uniform numbers and twice 64 random bits bear light.
#[inline(always)]
fn cosine<R: Real>([full, flux, outer, width]: [R; 4], u: R, [choices, others]: [&[u64]; 2]) -> R {
    let [a, b] = units::<R>(others);
    let [high, low] = R::load_halves(choices);
    let choice = high * R::splat(WORD) + low;
    let is_full = (choice * flux).lt(full * R::splat(WORD * WORD));
    R::select(is_full, R::splat(1.0) - full * u, outer + width * u.max(a).max(b))
}

/// Where rays in these directions begin that come from discs of these radii [m], twice as far away as the scene reaches: outside of it on every
/// side.
#[inline(always)]
fn on_discs<R: Real>(radius: [R; 3], [x, y, z]: [R; 3], points: &[u64]) -> [R; 3] {
    let (one, minus, two) = (R::splat(1.0), R::splat(-1.0), R::splat(2.0));
    let [s, t, _] = cosine_directions::<R>(points);
    // Two directions across (T. Duff et al., Building an Orthonormal Basis, Revisited, JCGT 2017). The reciprocal tells −0 from 0.
    let sign = R::select((one / z).lt(R::splat(0.0)), minus, one);
    let a = minus / (sign + z);
    let b = x * y * a;
    let across = [one + sign * x * x * a, sign * b, minus * sign * x];
    let along = [b, sign + y * y * a, minus * y];
    let (way, mut origin) = ([x, y, z], radius);
    for axis in 0..3 {
        origin[axis] = radius[axis] * (across[axis] * s + along[axis] * t - two * way[axis]);
    }
    origin
}

/// Where rays enter a box. One that misses it begins this `far` on, behind all that it could have met.
#[inline(always)]
fn entered<R: Real>([least, most]: [[f64; 3]; 2], (mut origin, way): ([R; 3], [R; 3]), far: R) -> [R; 3] {
    let (mut enters, mut leaves) = (R::splat(f64::NEG_INFINITY), R::splat(f64::INFINITY));
    for axis in 0..3 {
        // Closures would not be compiled for the instruction set.
        let a = (R::splat(least[axis]) - origin[axis]) / way[axis];
        let b = (R::splat(most[axis]) - origin[axis]) / way[axis];
        let is_first = a.lt(b);
        enters = enters.max(R::select(is_first, a, b));
        let last = R::select(is_first, b, a);
        leaves = R::select(last.lt(leaves), last, leaves);
    }
    let begin = R::select(enters.lt(leaves), enters, far);
    for axis in 0..3 {
        origin[axis] = origin[axis] + begin * way[axis];
    }
    origin
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::rng::{Sequence, unit_32};

    /// Births of a spot have the flux of its intensity in each of eight parts: χ² of seven degrees of freedom, above 26 once in 2,000 times.
    #[test]
    fn births_of_spots_have_their_intensity() {
        const BIRTHS: usize = 100_000;
        let (inner, outer) = (0.8, 0.2);
        let flux = |cosine: f64| match cosine >= inner {
            true => 1.0 - cosine,
            false => {
                1.0 - inner + (inner - outer) / 3.0 * (1.0 - ((cosine - outer) / (inner - outer)).powi(3))
            }
        };
        let mut rng = Sequence::new(5).walk(0);
        let mut counts = [0.0; 8];
        for _ in 0..BIRTHS {
            let u = unit_32(rng.bits() as u32);
            let cosine = cosine(cone(Emission::Spot { inner, outer }), u, [&[rng.bits()], &[rng.bits()]]);
            assert!((outer..=1.0).contains(&cosine), "{cosine}");
            counts[(8.0 * flux(cosine) / flux(outer)).min(7.0) as usize] += 1.0;
        }
        let expected = BIRTHS as f64 / 8.0;
        let chi_squared: f64 = counts.iter().map(|n| (n - expected).powi(2) / expected).sum();
        assert!(chi_squared < 26.0, "{chi_squared}: {counts:?}");
    }

    /// Each instruction set finds what one birth alone does, of lamps of all kinds, and leaves rays of lamps with tables as they are.
    #[test]
    fn instruction_sets_bear_alike() {
        let axes = [1.0, 2.0, 3.0, 0.0, 0.6, 0.8, 1.0, 0.0, 0.0, 0.0, 0.8, -0.6];
        let level = [3.0, 3.0, 3.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0];
        let spot = |inner: f64, outer: f64| (Emission::Spot { inner, outer }, axes);
        let kinds = [
            (Emission::Uniform, axes),
            spot(0.9, 0.25),
            (Emission::Table(0), axes),
            spot(1.0, -1.0),
            (Emission::Distant { rim: 0.9 }, level),
            (Emission::Distant { rim: 1.0 }, level),
        ];
        let mut rng = Sequence::new(8).walk(0);
        let room = [[-1.0, -2.0, -1.5], [0.5, 2.0, 1.0]];
        for (list, room) in [(&kinds[..1], None), (&kinds[1..4], None), (&kinds, None), (&kinds, Some(room))]
        {
            let cones = LightCones::new(list.iter().copied(), room).unwrap();
            for begin in [0, 77, WIDTH - 1] {
                let lamp: [u32; WIDTH] = std::array::from_fn(|i| (i % list.len()) as u32);
                let bits: [[u64; WIDTH]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| rng.bits()));
                for isa in Isa::available() {
                    let mut rays = [[5.0; 2 * WIDTH]; 6];
                    cones.bear(isa, (&lamp, begin), bits.each_ref(), (&mut rays, WIDTH));
                    for i in begin..WIDTH {
                        let expected = match list[lamp[i] as usize].0 {
                            Emission::Table(_) => [5.0; 6],
                            _ => cones.bear_one(lamp[i] as usize, bits.map(|row| row[i])),
                        };
                        assert_eq!(
                            rays.map(|row| row[WIDTH + i]),
                            expected,
                            "{isa:?}, {:?}",
                            list[lamp[i] as usize]
                        );
                    }
                }
            }
        }
    }
}
