//! From radiosity to light: colours, exposure, shades.

use radiosity::Scene;

/// What is seen beyond the scene, as light: a dark grey, so that black surfaces stand out from it.
pub(super) const BACKGROUND: f64 = 0.02;

/// The part of what is seen of the non-emitting patches that is at most as bright as [`EXPOSED_LIGHT`].
const EXPOSED_SHARE: f64 = 0.95;

/// The brightness that the exposure gives to this part at most, as light; 1 is white.
pub(super) const EXPOSED_LIGHT: f64 = 0.7;

/// Red, green, blue; 0 … 1. Equal where the scene is grey.
pub(super) type Light = [f64; 3];

/// The mean of some lights, channel by channel.
pub(super) fn mean(lights: &[Light]) -> Light {
    std::array::from_fn(|c| lights.iter().map(|light| light[c]).sum::<f64>() / lights.len() as f64)
}

/// The mean radiosity of samples that show the scene, over all samples, and the part of them that do.
pub(super) fn value(seen: &[Option<[f64; 3]>]) -> [f32; 4] {
    let count = seen.len() as f64;
    let shown = || seen.iter().flatten();
    std::array::from_fn(|c| match c {
        3 => (shown().count() as f64 / count) as f32,
        _ => (shown().map(|radiosity| radiosity[c]).sum::<f64>() / count) as f32,
    })
}

/// B of a patch in three channels [W/m²].
pub(super) fn of_piece(scene: &Scene, radiosity: &[f64], piece: u32) -> [f64; 3] {
    let (channels, face) = (scene.channels(), scene.faces().face_of(piece) as usize);
    std::array::from_fn(|c| radiosity[face * channels + c.min(channels - 1)])
}

/// The exposure for the pieces that are seen, by their brightest channel, white being the colour of all emitted light together.
/// Where nothing but lamps shows any light, it is theirs.
pub(super) fn exposure(
    scene: &Scene,
    radiosity: &[f64],
    pieces: impl Iterator<Item = u32> + Clone,
) -> [f64; 3] {
    let balance = white_balance(scene);
    let reflecting = pieces.clone().filter(|&piece| !scene.faces().piece(piece).emittance.is_lit());
    let brightest = |piece| {
        let balanced = of_piece(scene, radiosity, piece).into_iter().zip(balance).map(|(b, gain)| b * gain);
        balanced.fold(0.0, f64::max)
    };
    let reference =
        bright(reflecting.map(brightest).collect()).or_else(|| bright(pieces.map(brightest).collect()));
    balance.map(|gain| reference.map_or(1.0, |reference| gain * EXPOSED_LIGHT / reference))
}

/// The gains that make the emitted light white; 1 for a channel without any.
pub(super) fn white_balance(scene: &Scene) -> [f64; 3] {
    let power = std::array::from_fn(|c| scene.total_power(c.min(scene.channels() - 1)));
    let most = power.into_iter().fold(0.0, f64::max);
    power.map(|power| if power > 0.0 { most / power } else { 1.0 })
}

/// The value that [`EXPOSED_SHARE`] of the values stay below; `None` where none is positive.
pub(super) fn bright(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|&value| value > 0.0);
    let rank = (values.len() as f64 * EXPOSED_SHARE) as usize;
    let last = values.len().checked_sub(1)?;
    Some(*values.select_nth_unstable_by(rank.min(last), f64::total_cmp).1)
}

/// Light to sRGB, both 0 … 1 (IEC 61966-2-1).
pub(super) fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}
