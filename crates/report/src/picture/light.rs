//! From radiosity to light: colours, exposure, shades.

use radiosity::Scene;

/// What is seen beyond the scene, as light: a dark grey, so that black surfaces stand out from it.
pub(super) const BACKGROUND: f64 = 0.02;

/// The lightness of the middle pixel, where no part of the picture becomes too bright by it; 1 is white paper.
const MIDDLE: f64 = 0.3;

/// The part of the pixels that is not too bright, and how light the brightest of them are at least and at most.
const BRIGHT_SHARE: f64 = 0.95;
pub(super) const BRIGHT: [f64; 2] = [0.75, 1.8];

/// How many times as light as a dark pixel a bright one is to be, and the greatest power that the ratio is raised to for that.
const CONTRAST: f64 = 3.0;
const MOST_POWER: f64 = 3.0;

/// The part of the pixels that are dark.
const DARK_SHARE: f64 = 0.05;

/// Light up to here is shown as it is.
pub(super) const SHOULDER: f64 = 0.5;

/// Light from here on is white.
pub(super) const SHINING: f64 = 6.0;

/// Red, green, blue; 0 … 1. Of a grey scene the first counts.
pub(super) type Rgb = [f64; 3];

/// The mean of some lights, channel by channel.
pub(super) fn mean(lights: impl ExactSizeIterator<Item = Rgb>) -> Rgb {
    let count = lights.len() as f64;
    let mut sum = [0.0; 3];
    for light in lights {
        (0..3).for_each(|c| sum[c] += light[c]);
    }
    sum.map(|sum| sum / count)
}

/// The mean radiosity of samples [W/m²], those beyond the scene being dark.
pub(super) fn value(seen: &[Option<[f64; 3]>]) -> [f32; 3] {
    std::array::from_fn(|c| {
        let sum: f64 = seen.iter().flatten().map(|radiosity| radiosity[c]).sum();
        (sum / seen.len() as f64) as f32
    })
}

/// B of a patch in three channels [W/m²].
pub(super) fn of_piece(scene: &Scene, radiosity: &[f64], piece: u32) -> [f64; 3] {
    let (channels, face) = (scene.channels(), scene.faces().face_of(piece) as usize);
    std::array::from_fn(|c| radiosity[face * channels + c.min(channels - 1)])
}

/// The exposure for pixels of these brightnesses, those of emitters apart; white is the colour of all emitted light together.
/// The middle one of the pixels is as light as [`MIDDLE`], as far as their brightest keep within [`BRIGHT`].
/// Where nothing but lamps shows any light, it is theirs that counts.
pub(super) fn exposure(scene: &Scene, [reflecting, emitting]: &[Vec<f64>; 2]) -> [f64; 3] {
    let of = |values: &[f64]| {
        let [middle, bright] = [0.5, BRIGHT_SHARE].map(|share| rank(values, share));
        Some((MIDDLE / middle?).clamp(BRIGHT[0] / bright?, BRIGHT[1] / bright?))
    };
    let exposure = of(reflecting).or_else(|| rank(emitting, BRIGHT_SHARE).map(|bright| BRIGHT[0] / bright));
    white_balance(scene).map(|gain| gain * exposure.unwrap_or(1.0))
}

/// A curve that darkens what is darker than the bright pixels of a scene whose surfaces differ little in brightness.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contrast {
    /// The light that is kept as it is, with all above it.
    pub(super) bright: f64,
    /// The power that light is raised to, as a part of `bright`.
    pub(super) power: f64,
}

impl Contrast {
    /// The curve that changes nothing.
    pub(super) const NONE: Self = Contrast { bright: 1.0, power: 1.0 };

    /// The curve for pixels of these lights, those of reflecting surfaces.
    pub(super) fn of(lights: &[f64]) -> Self {
        let [Some(dark), Some(bright)] = [DARK_SHARE, BRIGHT_SHARE].map(|share| rank(lights, share)) else {
            return Contrast::NONE;
        };
        // Of an even scene there is no contrast to raise.
        let power = if bright > dark { CONTRAST.ln() / (bright / dark).ln() } else { 1.0 };
        Contrast { bright, power: power.clamp(1.0, MOST_POWER) }
    }

    /// Light by the curve; its colour is kept.
    pub(super) fn bend(&self, light: Rgb) -> Rgb {
        let part = light.into_iter().fold(0.0, f64::max) / self.bright;
        if self.power == 1.0 || part >= 1.0 {
            return light;
        }
        let gain = part.powf(self.power - 1.0);
        light.map(|light| light * gain)
    }
}

/// The brightest channel in white light.
pub(super) fn balanced(radiosity: [f64; 3], gains: [f64; 3]) -> f64 {
    radiosity.into_iter().zip(gains).map(|(b, gain)| b * gain).fold(0.0, f64::max)
}

/// The gains that make the emitted light white; 1 for a channel without any.
pub(super) fn white_balance(scene: &Scene) -> [f64; 3] {
    let power = std::array::from_fn(|c| scene.total_power(c.min(scene.channels() - 1)));
    let most = power.into_iter().fold(0.0, f64::max);
    power.map(|power| if power > 0.0 { most / power } else { 1.0 })
}

/// The value that a share of the positive values stay below; `None` where none is positive.
pub(super) fn rank(values: &[f64], share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.iter().copied().filter(|value| *value > 0.0).collect();
    let rank = ((values.len() as f64 * share) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Light as a picture shows it: as it is up to [`SHOULDER`], then less and less brighter, up to [`SHINING`], which is white. The
/// brightest channel is bent so, the others keep their part of it, and what shines turns white.
pub(super) fn tone(light: Rgb) -> Rgb {
    let peak = light.into_iter().fold(0.0, f64::max);
    if peak <= SHOULDER {
        return light;
    }
    let slope = (SHINING - SHOULDER) / (1.0 - SHOULDER);
    let part = ((peak - SHOULDER) / (SHINING - SHOULDER)).min(1.0);
    let bent = SHOULDER + (1.0 - SHOULDER) * slope * part / (1.0 + (slope - 1.0) * part);
    let white = bent * part;
    light.map(|light| light / peak * bent * (1.0 - part) + white)
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
