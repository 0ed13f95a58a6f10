//! From radiosity to light: colours, exposure, shades.

use radiosity::Scene;

/// What is seen beyond the scene, as light: a dark grey, so that black surfaces stand out from it.
pub(super) const BACKGROUND: f64 = 0.02;

/// The part of what is seen of the non-emitting patches that is at most as bright as [`EXPOSED_LIGHT`].
const EXPOSED_SHARE: f64 = 0.95;

/// The brightness that the exposure gives to this part at most, as light; 1 is white.
pub(super) const EXPOSED_LIGHT: f64 = 0.7;

/// Red, green, blue; 0 … 1. Of a grey scene the first counts.
pub(super) type Light = [f64; 3];

/// The mean of some lights, channel by channel.
pub(super) fn mean<'a>(lights: impl ExactSizeIterator<Item = &'a Light>) -> Light {
    let count = lights.len() as f64;
    let mut sum = [0.0; 3];
    for light in lights {
        (0..3).for_each(|c| sum[c] += light[c]);
    }
    (0..3).for_each(|c| sum[c] /= count);
    sum
}

/// The mean radiosity of samples that show the scene, over all samples, and the part of them that do.
pub(super) fn value<'a>(seen: impl ExactSizeIterator<Item = &'a Option<[f64; 3]>>) -> [f32; 4] {
    let count = seen.len() as f64;
    let (mut sum, mut shown) = ([0.0; 3], 0.0);
    for radiosity in seen.flatten() {
        (0..3).for_each(|c| sum[c] += radiosity[c]);
        shown += 1.0;
    }
    let [red, green, blue] = sum;
    [(red / count) as f32, (green / count) as f32, (blue / count) as f32, (shown / count) as f32]
}

/// B of a patch in three channels [W/m²].
pub(super) fn of_piece(scene: &Scene, radiosity: &[f64], piece: u32) -> [f64; 3] {
    let (channels, face) = (scene.channels(), scene.faces().face_of(piece) as usize);
    std::array::from_fn(|c| radiosity[face * channels + c.min(channels - 1)])
}

/// The exposure for the pieces that are seen, by their brightest channel, white being the colour of all emitted light together.
/// Where nothing but lamps shows any light, it is theirs.
pub(super) fn exposure(scene: &Scene, radiosity: &[f64], pieces: impl Iterator<Item = u32>) -> [f64; 3] {
    let mut seen = vec![0_usize; scene.faces().piece_count()];
    pieces.for_each(|piece| seen[piece as usize] += 1);
    let balance = white_balance(scene);
    let brightest = |piece| {
        let balanced = of_piece(scene, radiosity, piece).into_iter().zip(balance).map(|(b, gain)| b * gain);
        balanced.fold(0.0, f64::max)
    };
    let seen = (0..).zip(seen).filter(|&(_, count)| count > 0);
    let shown: Vec<(u32, (f64, usize))> =
        seen.map(|(piece, count)| (piece, (brightest(piece), count))).collect();
    let reflecting = shown.iter().filter(|&&(piece, _)| !scene.faces().piece(piece).emittance.is_lit());
    let reference = bright(reflecting.map(|&(_, values)| values).collect())
        .or_else(|| bright(shown.iter().map(|&(_, values)| values).collect()));
    balance.map(|gain| reference.map_or(1.0, |reference| gain * EXPOSED_LIGHT / reference))
}

/// The gains that make the emitted light white; 1 for a channel without any.
pub(super) fn white_balance(scene: &Scene) -> [f64; 3] {
    let power = std::array::from_fn(|c| scene.total_power(c.min(scene.channels() - 1)));
    let most = power.into_iter().fold(0.0, f64::max);
    power.map(|power| if power > 0.0 { most / power } else { 1.0 })
}

/// The value that [`EXPOSED_SHARE`] of the positive values stay below, each with how often it occurs; `None` where none is positive.
pub(super) fn bright(mut values: Vec<(f64, usize)>) -> Option<f64> {
    values.retain(|&(value, _)| value > 0.0);
    values.sort_unstable_by(|(a, _), (b, _)| a.total_cmp(b));
    let count: usize = values.iter().map(|&(_, count)| count).sum();
    let rank = ((count as f64 * EXPOSED_SHARE) as usize).min(count.checked_sub(1)?);
    let mut below = 0;
    let at_rank = values.iter().find(|&&(_, count)| {
        below += count;
        below > rank
    });
    at_rank.map(|&(value, _)| value)
}

/// Light to sRGB, both 0 … 1 (IEC 61966-2-1).
pub(super) fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// [`encode`] by a table, which is off by 2·10⁻⁵ at most, a two-hundredth of a shade of a picture.
pub(super) struct Shades(Vec<f64>);

impl Shades {
    /// Equal steps of light between the entries.
    const STEPS: usize = 4096;

    pub(super) fn new() -> Self {
        // One entry beyond white, so that white has a right neighbour.
        Shades((0..=Self::STEPS + 1).map(|step| encode(step as f64 / Self::STEPS as f64)).collect())
    }

    /// The shade of a light; black below 0, white above 1.
    pub(super) fn of(&self, light: f64) -> f64 {
        let place = light.clamp(0.0, 1.0) * Self::STEPS as f64;
        let step = place as usize;
        self.0[step] + (place - step as f64) * (self.0[step + 1] - self.0[step])
    }
}
