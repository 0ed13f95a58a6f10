//! The sequences of walks must be as good as independent: intervals assume it.

use radiosity::{Sequence, WalkRng};
use stats::{chi_square_uniform, mean_squared_z};

fn uniform(rng: &mut WalkRng) -> f64 {
    rng.bits() as f64 / 2f64.powi(64)
}

/// 1,024 consecutive walks in lockstep: at every position the sum of their uniforms must vary as the sum of
/// independent ones. Over 20,000 positions the mean squared z of the sums has a standard error of √(2/20,000)
/// = 1 %; PCG64 placed 2⁶⁴ draws apart fails this by a factor of 2.7. |z| < 4: false-alarm rate 6·10⁻⁵ for
/// each seed, once and for all with these.
#[test]
fn sums_over_walks_in_lockstep_vary_as_independent_ones() {
    const WALKS: usize = 1024;
    for (seed, first) in [(1, 0), (42, 1 << 40), (7, 123_456_789)] {
        let mut walks: Vec<WalkRng> = Sequence::new(seed).walks_from(first).take(WALKS).collect();
        let sums = (0..20_000).map(|_| {
            let sum: f64 = walks.iter_mut().map(|walk| uniform(walk) - 0.5).sum();
            sum / (WALKS as f64 / 12.0).sqrt()
        });
        let measured = mean_squared_z(sums).unwrap();
        let z = measured.z(1.0);
        assert!(z.abs() < 4.0, "seed {seed}: mean squared z {measured:?} is {z:.1} σ off");
    }
}

/// Neighbouring walks' first draws fall into 64 × 64 cells evenly: χ² over 4,096 cells from 2²⁰ pairs, as a
/// standard normal. |z| < 4: false-alarm rate 6·10⁻⁵ for each of the three draws looked at.
#[test]
fn first_draws_of_neighbouring_walks_are_independent() {
    let pairs = 1 << 20;
    for draw in 0..3 {
        let mut cells = vec![0_u64; 4096];
        let firsts: Vec<u64> = Sequence::new(3)
            .walks_from(0)
            .take(2 * pairs)
            .map(|mut walk| {
                (0..draw).for_each(|_| {
                    walk.bits();
                });
                walk.bits() >> 58
            })
            .collect();
        for pair in firsts.chunks_exact(2) {
            cells[(pair[0] * 64 + pair[1]) as usize] += 1;
        }
        let z = chi_square_uniform(&cells).unwrap().z();
        assert!(z.abs() < 4.0, "draw {draw}: χ² is {z:.1} σ off");
    }
}

/// The low bits are used too (φ, and the second coordinate of points).
#[test]
fn low_bits_of_neighbouring_walks_are_independent() {
    let mut cells = vec![0_u64; 4096];
    let lows: Vec<u64> =
        Sequence::new(5).walks_from(9).take(1 << 20).map(|mut walk| walk.bits() & 63).collect();
    for pair in lows.chunks_exact(2) {
        cells[(pair[0] * 64 + pair[1]) as usize] += 1;
    }
    let z = chi_square_uniform(&cells).unwrap().z();
    assert!(z.abs() < 4.0, "χ² is {z:.1} σ off");
}
