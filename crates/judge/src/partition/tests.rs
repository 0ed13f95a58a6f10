//! The rule of choice, on light that is known.

use radiosity::Leaf;

use super::images::Images;
use super::*;

/// What a grid of 2^i × 2^j cells loses of smooth light that varies along u alone.
fn lost(basis: Basis, [i, _]: [u32; 2]) -> f64 {
    let h = 0.5_f64.powi(i as i32);
    match basis {
        Basis::Constant => 0.08 * h * h,
        Basis::Linear => 0.001 * h.powi(4),
    }
}

fn smooth(walks: f64) -> SurfaceLight {
    SurfaceLight::known([5, 5], |basis, levels| 1.0 - lost(basis, levels), [1.0, 3.0], walks)
}

/// Cells are doubled along the axis along which light varies, and as often as pays. With constants that is as often as is best. With
/// linear fits it may be once more: beyond what a pilot resolves there may be a shadow's edge.
#[test]
fn grids_follow_the_light() {
    for walks in [1e5, 1e6, 1e7, 1e8] {
        let light = smooth(walks / 8.0);
        for (basis, more) in [(Basis::Constant, 0), (Basis::Linear, 1)] {
            let choice = Candidates::new(std::slice::from_ref(&light), &[basis]).choose(walks);
            let Cut::Grid([nu, nv]) = choice.cuts[0] else { panic!("a quad") };
            assert_eq!(nv, 1, "{walks} {basis:?}");
            let error =
                |i: u32| light.noise[basis as usize] * f64::from(1 << i) / walks + lost(basis, [i, 0]);
            let best = (0..16).min_by(|&a, &b| error(a).total_cmp(&error(b))).expect("some");
            assert!((best..=best + more).contains(&nu.ilog2()), "{walks} {basis:?}: {nu}, best 2^{best}");
        }
    }
}

/// Smooth light is worth two more unknowns a patch; even light is not.
#[test]
fn the_basis_follows_the_light() {
    let choose = |light: SurfaceLight| {
        Candidates::new(std::slice::from_ref(&light), &[Basis::Constant, Basis::Linear]).choose(1e6)
    };
    assert_eq!(choose(smooth(1e5)).basis, Basis::Linear);
    let even = SurfaceLight::known([5, 5], |_, _| 1.0, [1.0, 3.0], 1e5);
    let choice = choose(even);
    assert_eq!((choice.basis, choice.cuts), (Basis::Constant, vec![Cut::Grid([1, 1])]));
}

/// Chance alone makes cells differ. Where nothing else does, surfaces stay whole, however fine the grids that were looked at: what a
/// pilot of 10⁵ walks catches beyond the mean is the noise of its estimates, ±√2·ν for each new coefficient.
#[test]
fn chance_is_not_taken_for_light() {
    let noise = [1.0, 3.0];
    let mut state = 7_u64;
    let mut sign = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if state >> 63 == 0 { 1.0 } else { -1.0 }
    };
    let mut lights = Vec::new();
    for _ in 0..20 {
        let signs: Vec<f64> = (0..72).map(|_| sign()).collect();
        let caught = |basis: Basis, [i, j]: [u32; 2]| {
            let unknowns = if basis == Basis::Constant { 1.0 } else { 3.0 };
            let new = unknowns * f64::from((1 << (i + j)) - 1);
            let sign = signs[(36 * usize::from(basis == Basis::Linear)) + (6 * i + j) as usize];
            1.0 + 1e-5 * sign * (2.0 * new).sqrt()
        };
        lights.push(SurfaceLight::known([5, 5], caught, noise, 1e5));
    }
    let candidates = Candidates::new(&lights, &[Basis::Constant, Basis::Linear]);
    let choice = candidates.choose(1e6);
    assert!(candidates.are_even() && choice.basis == Basis::Constant);
    assert!(choice.cuts.iter().all(|cut| *cut == Cut::Grid([1, 1])), "{:?}", choice.cuts);
}

/// The light of a symmetric scene hides from the first doubling along each axis: halves have equal means.
#[test]
fn symmetric_light_is_found_behind_the_first_doubling() {
    let part = |level: u32| match level {
        0 | 1 => 0.0,
        level => 0.1 * (1.0 - 0.25_f64.powi(level as i32 - 1)),
    };
    let caught = |_, [i, j]: [u32; 2]| 1.0 + part(i) + part(j);
    let light = SurfaceLight::known([5, 5], caught, [1.0, 3.0], 1e6);
    let choice = Candidates::new(std::slice::from_ref(&light), &[Basis::Constant]).choose(1e7);
    let Cut::Grid(cells) = choice.cuts[0] else { panic!("a quad") };
    assert!(cells.iter().all(|&n| n >= 16), "{cells:?}");
}

/// A target takes the fewest walks that a choice is foretold to reach it with, and the whole budget where none does.
#[test]
fn a_target_takes_the_fewest_walks() {
    let light = smooth(1e6);
    let candidates = Candidates::new(std::slice::from_ref(&light), &[Basis::Constant]);
    let choice = candidates.choose_for(1e-3, 1024.0, 1e9);
    assert!(choice.error() <= 1e-3 && candidates.choose(0.5 * choice.walks).error() > 1e-3);
    assert_eq!(candidates.choose_for(1e-9, 1024.0, 1e6).walks, 1e6);
}

/// What a pilot without noise would see of light on a surface of 1 m², on grids of up to 2⁶ × 2⁶ cells; what it takes for the noise of
/// an unknown is `noise`. Integrals are sums over the middles of 256² points.
fn images(light: impl Fn([f64; 2]) -> f64, noise: f64) -> Images {
    const N: usize = 256;
    const TOP: u32 = 6;
    let at = |i: usize| (i as f64 + 0.5) / N as f64;
    let mut images = Images::new([TOP; 2]);
    for [a, b] in images::levels([TOP; 2]) {
        let size = [N >> a, N >> b];
        let mut moments = vec![[0.0; 3]; 1 << (a + b)];
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let phi =
                |i: usize, size: usize| 3_f64.sqrt() * ((2 * (i % size) + 1) as f64 / size as f64 - 1.0);
            let value = light([at(i), at(j)]) / (N * N) as f64;
            let parts = [value, value * phi(i, size[0]), value * phi(j, size[1])];
            let cell = &mut moments[((i / size[0]) << b) + j / size[1]];
            cell.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        }
        let cells = f64::from(1 << (a + b));
        images.add_caught([a, b], moments.iter().map(|m| cells * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2])));
    }
    images.add_noise(std::iter::repeat_n(noise, 1 << (2 * TOP)));
    images.spread_noise();
    images
}

/// The edge of a shadow along a diagonal: rectangles are small there and large elsewhere, and err a third as much (in squares) as the best
/// grid.
#[test]
fn rectangles_follow_the_edge_of_a_shadow() {
    let images = images(|[u, v]| if u + 0.7 * v < 0.8 { 1.0 } else { 0.1 }, 0.5);
    let walks = 1e6;
    let tree = rectangles(&images, 0.25 * walks, walks);
    let whole: f64 = images.caught(images.top).iter().sum();
    let error = whole - tree.caught + tree.noise / walks;
    let of_grid = |[a, b]: [u32; 2]| {
        whole - images.caught([a, b]).iter().sum::<f64>() + 1.5 * f64::from(1 << (a + b)) / walks
    };
    let best = images::levels([6; 2]).map(of_grid).fold(f64::INFINITY, f64::min);
    assert!(error < best / 3.0, "{error} of {best}: {}", tree.leaves.text());
    let off = |leaf: &Leaf| {
        let [u, v] = [0, 1].map(|k| (f64::from(leaf.at[k]) + 0.5) / f64::from(leaf.grid()[k]));
        (u + 0.7 * v - 0.8).abs()
    };
    let mean_off = |cuts: std::ops::RangeInclusive<u32>| {
        let of = |leaf: &Leaf| cuts.contains(&(leaf.levels[0] + leaf.levels[1]));
        let offs: Vec<f64> = tree.leaves.iter().filter(of).map(|leaf| off(&leaf)).collect();
        (offs.len(), offs.iter().sum::<f64>() / offs.len() as f64)
    };
    let ((small, near), (large, far)) = (mean_off(9..=20), mean_off(0..=5));
    println!("{small} small ones, {large} large ones: {near}, {far}");
    assert!(small > 20 && large > 2 && near < far / 5.0, "{small}, {large}: {near}, {far}");
}

/// Light that varies along u alone is cut across u alone.
#[test]
fn rectangles_are_as_long_as_the_light_allows() {
    let images = images(|[u, _]| 1.0 + (6.0 * u).sin(), 1.0);
    let tree = rectangles(&images, 1e5, 4e5);
    assert!((4..40).contains(&tree.leaves.len()), "{}", tree.leaves.text());
    assert!(tree.leaves.iter().all(|leaf| leaf.levels[1] == 0), "{}", tree.leaves.text());
}

/// Where nothing varies, what a pilot sees gained is noise: of each unknown ν·(z² − 1), z standard normal. A cut is proven by chance in
/// few places: of 4096 cells, fewer than 200 leaves. Sums of twelve uniform numbers stand for normal ones.
#[test]
fn chance_cuts_few_rectangles() {
    let mut state = 5_u64;
    let mut normal = || {
        let uniform = |_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(uniform).sum::<f64>() - 6.0
    };
    let walks = 1e5;
    let cells = 1 << 12;
    // Moments of noise on the finest cells, and what fits catch on all grids.
    let fine: Vec<[f64; 3]> =
        (0..cells).map(|_| [normal(), normal() / 12_f64.sqrt(), normal() / 12_f64.sqrt()]).collect();
    let mut images = Images::new([6; 2]);
    for [a, b] in images::levels([6; 2]) {
        let size = [64_usize >> a, 64 >> b];
        let mut sums = vec![[0.0; 3]; 1 << (a + b)];
        for (cell, moments) in fine.iter().enumerate() {
            let [i, j] = [cell / 64, cell % 64];
            let place = |i: usize, size: usize| ((i % size) as f64 + 0.5) - 0.5 * size as f64;
            let sum = &mut sums[((i / size[0]) << b) + j / size[1]];
            sum[0] += moments[0];
            sum[1] += moments[1] + moments[0] * place(i, size[0]);
            sum[2] += moments[2] + moments[0] * place(j, size[1]);
        }
        let n = (size[0] * size[1]) as f64;
        // Orthonormal coefficients have the variance 1 for each cell.
        let caught = sums.iter().map(|[m, u, v]| {
            let [su, sv] = size.map(|size| 12.0 / (size * size) as f64);
            (m * m + su * u * u + sv * v * v) / n - 3.0
        });
        images.add_caught([a, b], caught.map(|energy| energy / walks));
    }
    images.add_noise(std::iter::repeat_n(1.0, cells));
    images.spread_noise();
    let tree = rectangles(&images, walks, 8.0 * walks);
    assert!(tree.leaves.len() < 200, "{}", tree.leaves.len());
}
