//! Sixteen f32 lanes side by side, or four groups of four, on each instruction set.
//!
//! All of this is culling: a lane may be rounded differently from one instruction set to the next (fused or
//! not) without a trace in the answer, since `wavefront.rs` allows for either.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub(super) use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub(super) use neon::Neon;

/// Sixteen of a vector: children of a node.
pub(crate) const LANES: usize = 16;

/// A vector in memory.
pub(crate) type Row = [f32; LANES];

/// Sixteen of a group: facets of a leaf.
pub(crate) const GROUP: usize = 4;

/// Groups of a vector.
pub(crate) const GROUPS: usize = LANES / GROUP;

/// A group in memory.
pub(crate) type Quad = [f32; GROUP];

/// The bits of a key that number a lane.
const LANE_BITS: u32 = LANES as u32 - 1;

/// Sixteen f32 lanes. Comparisons with a NaN are false.
pub(crate) trait Sixteen: Copy {
    /// A truth value for each lane.
    type Mask: Copy;

    fn splat(x: f32) -> Self;
    fn load(row: &Row) -> Self;
    /// A group of each.
    fn groups(quads: [&Quad; GROUPS]) -> Self;
    /// Lane `i` of each group in all of its lanes.
    fn spread(self, i: usize) -> Self;
    fn store(self, to: &mut Row);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// self · factor + addend, fused or not.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// self · factor − subtrahend, fused or not.
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self;
    /// 1/self within 1.1 · 2⁻²⁴ of itself; infinite or NaN for 0.
    fn recip(self) -> Self;
    fn min(self, other: Self) -> Self;
    /// The greater; +0 for zeros of either sign against +0.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// `self` in the lanes where `sign` is negative, else 0.
    fn where_negative(self, sign: Self) -> Self;
    /// 0 in the lanes of a mask.
    fn zero_where(self, mask: Self::Mask) -> Self;
    fn le(self, other: Self) -> Self::Mask;
    /// Whether the bits of a lane differ.
    fn differs(self, other: Self) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Bit i: lane i.
    fn bits(mask: Self::Mask) -> u32;
    /// The least lane of a mask in each group; infinite where there is none.
    fn least_of_groups(self, mask: Self::Mask) -> Self;
    /// The keys of the lanes of a mask, as bits, and [`NO_KEY`] elsewhere. The key of a lane that is not negative is its bits,
    /// the last four of them replaced by the lane's number.
    fn keys(self, mask: Self::Mask) -> Self;
    /// The least of keys.
    fn least(self) -> u32;
    /// Keys with [`NO_KEY`] in place of one.
    fn without(self, key: u32) -> Self;
    /// Bit i: the key of lane i is below a limit, which [`NO_KEY`] is not.
    fn below(self, limit: u32) -> u32;
    /// Writes the lanes of one group whose bits are set to the front of `to`, in order.
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad);
}

/// COMPRESS_GROUP[bits]: the set lanes of four in order.
static COMPRESS_GROUP: [[i32; GROUP]; 1 << GROUP] = {
    let mut table = [[0; GROUP]; 1 << GROUP];
    let mut bits = 0;
    while bits < table.len() {
        let (mut lane, mut next) = (0, 0);
        while lane < GROUP {
            if bits >> lane & 1 == 1 {
                table[bits][next] = lane as i32;
                next += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    table
};

/// The lane that a key names.
#[inline(always)]
pub(crate) fn lane_of(key: u32) -> usize {
    (key & LANE_BITS) as usize
}

/// What is greater than every key: a positive integer and no number.
pub(crate) const NO_KEY: u32 = i32::MAX as u32;

/// Plain Rust, which compilers turn into whatever vectors the target has.
#[derive(Clone, Copy)]
pub(in crate::simd) struct Portable(Row);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Portable(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Sixteen for Portable {
    /// All ones or none.
    type Mask = [u32; LANES];

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; LANES])
    }
    #[inline(always)]
    fn load(row: &Row) -> Self {
        Portable(*row)
    }
    #[inline(always)]
    fn groups(quads: [&Quad; GROUPS]) -> Self {
        Portable(std::array::from_fn(|i| quads[i / GROUP][i % GROUP]))
    }
    #[inline(always)]
    fn spread(self, i: usize) -> Self {
        Portable(std::array::from_fn(|lane| self.0[lane / GROUP * GROUP + i]))
    }
    #[inline(always)]
    fn store(self, to: &mut Row) {
        *to = self.0;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        self.mul(factor).add(addend)
    }
    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        self.mul(factor).sub(subtrahend)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(1.0).zip(self, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Portable(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn where_negative(self, sign: Self) -> Self {
        self.zip(sign, |a, s| f32::from_bits(a.to_bits() & ((s.to_bits() as i32) >> 31) as u32))
    }
    #[inline(always)]
    fn zero_where(self, mask: [u32; LANES]) -> Self {
        Portable(std::array::from_fn(|i| f32::from_bits(self.0[i].to_bits() & !mask[i])))
    }
    #[inline(always)]
    fn le(self, other: Self) -> [u32; LANES] {
        std::array::from_fn(|i| if self.0[i] <= other.0[i] { u32::MAX } else { 0 })
    }
    #[inline(always)]
    fn differs(self, other: Self) -> [u32; LANES] {
        std::array::from_fn(|i| if self.0[i].to_bits() == other.0[i].to_bits() { 0 } else { u32::MAX })
    }
    #[inline(always)]
    fn and(a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(a: [u32; LANES], b: [u32; LANES]) -> [u32; LANES] {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(mask: [u32; LANES]) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | mask[i] & 1 << i)
    }
    #[inline(always)]
    fn least_of_groups(self, mask: [u32; LANES]) -> Self {
        let value = |i: usize| if mask[i] == 0 { f32::INFINITY } else { self.0[i] };
        let least = |first: usize| {
            (first..first + GROUP)
                .fold(f32::INFINITY, |least, i| if value(i) < least { value(i) } else { least })
        };
        Portable(std::array::from_fn(|i| least(i / GROUP * GROUP)))
    }
    #[inline(always)]
    fn keys(self, mask: [u32; LANES]) -> Self {
        let key = |i: usize| self.0[i].to_bits() & !LANE_BITS | i as u32;
        Portable(std::array::from_fn(|i| f32::from_bits(if mask[i] == 0 { NO_KEY } else { key(i) })))
    }
    #[inline(always)]
    fn least(self) -> u32 {
        self.0.iter().fold(NO_KEY, |least, key| least.min(key.to_bits()))
    }
    #[inline(always)]
    fn without(self, key: u32) -> Self {
        Portable(self.0.map(|lane| if lane.to_bits() == key { f32::from_bits(NO_KEY) } else { lane }))
    }
    #[inline(always)]
    fn below(self, limit: u32) -> u32 {
        (0..LANES).fold(0, |bits, i| bits | u32::from(self.0[i].to_bits() < limit) << i)
    }
    #[inline(always)]
    fn compress_group(group: &Quad, bits: u32, to: &mut Quad) {
        *to = COMPRESS_GROUP[bits as usize].map(|lane| group[lane as usize]);
    }
}
