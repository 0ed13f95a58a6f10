//! Numbers for the rays of pixels: one sequence along the Z-order of the pixels, so that the numbers of a pixel, those of each
//! aligned block of pixels and those of the picture are all spread evenly (A. Ahmed & P. Wonka, *Screen-space blue-noise diffusion of
//! Monte Carlo sampling error via hierarchical ordering of pixels*, ACM TOG 39(6), 2020).

/// What numbers are for.
#[derive(Clone, Copy)]
pub(super) enum Use {
    /// The place in the pixel.
    Place = 1,
    /// The direction of a gathering ray.
    Direction,
    /// The choice of two lamps.
    Lamp,
    /// The place on the first lamp, and on the second.
    OnLamp,
    OnSecond,
    /// The same for the rays from a place close by.
    NextDirection,
    NextLamp,
    OnNextLamp,
    OnNextSecond,
}

/// The number of a pixel in Z-order.
pub(super) fn z_order([x, y]: [u32; 2]) -> u32 {
    spread(x) | spread(y) << 1
}

/// 16 bits with a gap after each.
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x00FF_00FF;
    let x = (x | x << 4) & 0x0F0F_0F0F;
    let x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

/// Two numbers of 32 bits: a point of the sequence of Sobol' in two dimensions, shuffled and scrambled for its use (B. Burley,
/// *Practical hash-based Owen scrambling*, JCGT 9(4), 2020).
pub(super) fn point(index: u32, of: Use) -> [u32; 2] {
    let seed = (of as u32).wrapping_mul(0x9E37_79B9);
    let index = scrambled(index.reverse_bits(), seed ^ 0x55AA_1234);
    // The second matrix of Sobol' is Pascal's triangle modulo 2.
    let second = index ^ index >> 16;
    let second = second ^ (second & 0xFF00_FF00) >> 8;
    let second = second ^ (second & 0xF0F0_F0F0) >> 4;
    let second = second ^ (second & 0xCCCC_CCCC) >> 2;
    let second = second ^ (second & 0xAAAA_AAAA) >> 1;
    [scrambled(index, seed ^ 0x2545_F491), scrambled(second, seed ^ 0x8F1B_BCDC)]
}

/// A number of 32 bits as one in (0, 1).
pub(super) fn unit(bits: u32) -> f64 {
    (f64::from(bits) + 0.5) / 4_294_967_296.0
}

/// Owen's scrambling by a hash, of a number whose bits are reversed; it turns its bits round (S. Laine & T. Karras,
/// *Stratified sampling for stochastic transparency*, EGSR 2011; constants of N. Vegdahl).
fn scrambled(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    (x ^ x.wrapping_mul(0x53A2_2864)).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each aligned block of 4 × 4 pixels with one point each has one point in each of 16 cells, whichever way the cells are cut.
    #[test]
    fn blocks_of_pixels_are_spread_evenly() {
        for of in [Use::Place, Use::Direction, Use::Lamp, Use::OnLamp, Use::OnSecond] {
            for block in 0..50 {
                for bits in 0..=4 {
                    let cells = (0..16).map(|k| {
                        let [a, b] = point(16 * block + k, of).map(u64::from);
                        (a >> (32 - bits)) << (4 - bits) | b >> (28 + bits)
                    });
                    let mut cells: Vec<u64> = cells.collect();
                    cells.sort_unstable();
                    assert_eq!(cells, (0..16).collect::<Vec<_>>(), "block {block}, {bits} bits");
                }
            }
        }
    }

    #[test]
    fn z_order_visits_blocks_one_after_the_other() {
        assert_eq!([[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [3, 5]].map(z_order), [0, 1, 2, 3, 4, 39]);
    }
}
