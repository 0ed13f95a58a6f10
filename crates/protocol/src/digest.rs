//! Linear digests of tallies: Σ c_i·t_i modulo a prime, over all counts and sums t_i of a tally.
//!
//! The digest of merged tallies is the sum of their digests. So the digests of single leases, kept by the ledger, add
//! up to that of the final tally, through any order of arrival, merges, stops and restarts; and an audit that traces
//! one lease anew can compare it with its digest without any other lease. A tally that differs has another digest but
//! for one chance in 2⁶¹ (Carter & Wegman, J. Comput. Syst. Sci. 18 (1979) 143–154, for coefficients drawn at random;
//! here they are drawn once for each scene, so that digests of all seeds add up). Digests protect against faults, not
//! against an attacker who knows the coefficients and forges a result on purpose.

use radiosity::{Counts, Tally};

/// The modulus of all digests: 2⁶¹ − 1, a prime.
const MODULUS: u64 = (1 << 61) - 1;

/// The digest of a tally, below 2⁶¹ − 1; that of an empty tally is 0.
pub type Digest = u64;

/// The coefficients of one scene's digests.
#[derive(Clone, Copy, Debug)]
pub struct Digester {
    key: [u64; 2],
}

impl Digester {
    /// The coefficients for a scene with this hash.
    pub fn new(scene_hash: &[u8; 32]) -> Self {
        let bytes = blake3::derive_key("radwalk 2026 coefficients of linear digests", scene_hash);
        let word = |from: usize| u64::from_le_bytes(bytes[from..from + 8].try_into().expect("eight bytes"));
        Digester { key: [word(0), word(8)] }
    }

    /// The digest of a tally.
    pub fn digest(&self, tally: &Tally) -> Digest {
        self.digest_sums(&tally.counts, tally.sums().iter().copied())
    }

    /// The digest of a tally that is given by its counts and sums.
    pub fn digest_sums(&self, counts: &Counts, sums: impl Iterator<Item = u128>) -> Digest {
        let terms = counts.to_array().into_iter().chain(sums).enumerate();
        terms
            .filter(|&(_, sum)| sum != 0)
            .fold(0, |digest, (i, sum)| add(digest, times(self.coefficient(i as u64), remainder(sum))))
    }

    /// Coefficient c_i: the finaliser of splitmix64 (Steele, Lea & Flood, OOPSLA 2014), keyed before and in between.
    fn coefficient(&self, i: u64) -> u64 {
        let mixed = |z: u64| {
            let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        };
        let once = mixed(self.key[0].wrapping_add(i.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        mixed(once ^ self.key[1]) % MODULUS
    }
}

/// Whether a number can be a digest: it is below 2⁶¹ − 1.
pub fn is_one(number: u64) -> bool {
    number < MODULUS
}

/// The digest of two merged tallies, by their digests.
pub fn add(a: Digest, b: Digest) -> Digest {
    (a + b) % MODULUS
}

fn times(a: u64, b: u64) -> u64 {
    remainder(u128::from(a) * u128::from(b))
}

/// The remainder modulo 2⁶¹ − 1: the three digits of base 2⁶¹ add up to it.
fn remainder(x: u128) -> u64 {
    let digit = |shift: u32| (x >> shift) as u64 & MODULUS;
    (digit(0) + digit(61) + digit(122)) % MODULUS
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::Layout;

    const PAIR: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };

    fn tally(walks: u64, sums: [u128; 4]) -> Tally {
        let counts = Counts { walks, rays: 3 * walks, ..Counts::default() };
        Tally::from_parts(counts, 2, PAIR, sums.to_vec()).unwrap()
    }

    #[test]
    fn remainders_are_those_of_division() {
        for x in [0, 1, u128::from(MODULUS), u128::from(MODULUS) + 1, 1 << 61, 1 << 122, u128::MAX, 12 << 70]
        {
            assert_eq!(u128::from(remainder(x)), x % u128::from(MODULUS), "{x}");
        }
    }

    #[test]
    fn digests_add_up_as_tallies_do() {
        let digester = Digester::new(&[7; 32]);
        let (a, b) = (tally(10, [1, 2, 3, 1 << 100]), tally(99, [u128::MAX >> 1, 0, 5, 1 << 90]));
        let mut both = a.clone();
        both.merge(&b).unwrap();
        assert_eq!(digester.digest(&both), add(digester.digest(&a), digester.digest(&b)));
        assert_eq!(digester.digest(&Tally::new(2, PAIR)), 0);
    }

    #[test]
    fn any_change_of_a_bit_and_any_swap_shows() {
        let digester = Digester::new(&[7; 32]);
        let sums = [1, 2, 3, 4];
        let whole = digester.digest(&tally(10, sums));
        for place in 0..4 {
            for bit in 0..128 {
                let mut changed = sums;
                changed[place] ^= 1 << bit;
                assert_ne!(digester.digest(&tally(10, changed)), whole, "bit {bit} of sum {place}");
            }
        }
        assert_ne!(digester.digest(&tally(11, sums)), whole);
        assert_ne!(digester.digest(&tally(10, [2, 1, 3, 4])), whole);
        assert_ne!(Digester::new(&[8; 32]).digest(&tally(10, sums)), whole, "each scene has its own");
    }
}
