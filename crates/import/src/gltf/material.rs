//! The diffuse part of glTF's materials.

use std::collections::HashMap;

use glam::{DMat2, DVec2};
use radiosity::{Sides, Spectrum};

use super::json::{Document, MaterialJson, TextureUse};
use crate::mesh::{LostProperty, Material};
use crate::texture::{Placing, Wrap};

/// The materials in the order of the file.
pub(super) fn materials(document: &Document) -> Vec<Material> {
    document.materials.iter().enumerate().map(|(number, json)| material(number, json)).collect()
}

/// Reads a material without its textures. Its reflectance is the base colour; its emittance [W/m²] is
/// emissiveFactor × emissiveStrength, which the reader turns into an exitance where the file has lamps.
fn material(number: usize, json: &MaterialJson) -> Material {
    let strength = json.extensions.emissive.as_ref().and_then(|emissive| emissive.emissive_strength);
    let emittance = json.emissive_factor.map(|factor| factor * strength.unwrap_or(1.0));
    let name = json.name.clone().filter(|name| !name.is_empty());
    let [red, green, blue, _] = base(json).unwrap_or([1.0; 4]);
    Material {
        reflectance: Spectrum::rgb([red, green, blue]),
        emittance: Spectrum::rgb(emittance),
        sides: Some(if json.double_sided { Sides::Both } else { Sides::Front }),
        ..Material::unknown(name.unwrap_or_else(|| format!("material {number}")))
    }
}

/// Takes from a material what is no paint: metal, gloss and what passes. `means` are those of its textures; `None` where one could not be read.
pub(super) fn finish(
    json: &MaterialJson,
    means: &HashMap<TextureRole, Option<Spectrum>>,
    material: &mut Material,
) {
    let mirror = mirror(json, means);
    let own = material.reflectance.channels();
    let kept = 1.0 - mirror.unwrap_or(0.0).clamp(0.0, 1.0);
    material.reflectance = Spectrum::rgb(own.map(|channel| channel * kept));
    let extensions = &json.extensions;
    let is_coated = extensions.coat.as_ref().is_some_and(|coat| coat.clearcoat_factor > 0.0);
    if mirror != Some(0.0) || extensions.specular.is_some() || is_coated {
        material.loses(LostProperty::Mirror);
    }
    match transmitted(json, means) {
        Some(part) => material.passes(part.max(cut_out(json))),
        None => material.loses(LostProperty::Transparency),
    }
    let diffuse = extensions.diffuse_transmission.as_ref();
    if diffuse.is_some_and(|diffuse| diffuse.diffuse_transmission_factor > 0.0) {
        material.loses(LostProperty::Transparency);
    }
    if extensions.unlit.is_some() {
        material.loses(LostProperty::Unlit);
    }
}

/// The part of light that a material reflects like a mirror, by metal or by its specular colour; `None` where its texture could not be read.
/// A metallicFactor that is left out is 1 by the specification; files that leave it out without a texture hardly mean metal throughout.
fn mirror(json: &MaterialJson, means: &HashMap<TextureRole, Option<Spectrum>>) -> Option<f64> {
    if let Some(specular) = &json.extensions.specular {
        let mean = means.get(&TextureRole::Specular).copied().unwrap_or(Some(1.0.into()))?;
        let factor = specular.specular_factor.unwrap_or([1.0; 3]);
        return Some((0..3).map(|channel| factor[channel] * mean[channel]).fold(0.0, f64::max));
    }
    let factor = json.pbr_metallic_roughness.metallic_factor;
    match means.get(&TextureRole::Metal) {
        // Metal is in blue.
        Some(mean) => mean.map(|mean| factor.unwrap_or(1.0) * mean[2]),
        None => Some(factor.unwrap_or(0.0)),
    }
}

/// The part of light that passes a material as glass; `None` where its texture could not be read.
fn transmitted(json: &MaterialJson, means: &HashMap<TextureRole, Option<Spectrum>>) -> Option<f64> {
    let factor = json.extensions.transmission.as_ref().map_or(0.0, |some| some.transmission_factor);
    match means.get(&TextureRole::Transmission) {
        Some(mean) => mean.map(|mean| factor * mean[0]),
        None => Some(factor),
    }
}

/// The part that alpha cuts out of a material.
fn cut_out(json: &MaterialJson) -> f64 {
    let alpha = base(json).map_or(1.0, |[.., alpha]| alpha);
    match json.alpha_mode.as_deref() {
        Some("MASK") if alpha >= json.alpha_cutoff.unwrap_or(0.5) => 0.0,
        Some("MASK") => 1.0,
        _ if has_alpha(json) => 1.0 - alpha,
        _ => 0.0,
    }
}

/// The colour and alpha of a material without its texture.
fn base(json: &MaterialJson) -> Option<[f64; 4]> {
    match &json.extensions.specular {
        Some(specular) => specular.diffuse_factor,
        None => json.pbr_metallic_roughness.base_color_factor,
    }
}

/// Whether the alpha of the colour, or of its texture, means something.
pub(super) fn has_alpha(json: &MaterialJson) -> bool {
    json.alpha_mode.as_deref().is_some_and(|mode| mode != "OPAQUE")
}

/// What a texture says of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum TextureRole {
    Colour,
    Emission,
    Metal,
    Specular,
    Transmission,
}

/// The textures of a material that say anything of its light.
pub(super) fn textures(json: &MaterialJson) -> impl Iterator<Item = (TextureRole, &TextureUse)> {
    let pbr = &json.pbr_metallic_roughness;
    let (specular, transmission) = (json.extensions.specular.as_ref(), json.extensions.transmission.as_ref());
    let colour = match specular {
        Some(specular) => specular.diffuse_texture.as_ref(),
        None => pbr.base_color_texture.as_ref(),
    };
    let emits = json.emissive_factor.iter().any(|&factor| factor > 0.0);
    let is_metal = specular.is_none() && pbr.metallic_factor != Some(0.0);
    let passes = transmission.filter(|some| some.transmission_factor > 0.0);
    [
        (TextureRole::Colour, colour),
        (TextureRole::Emission, json.emissive_texture.as_ref().filter(|_| emits)),
        (TextureRole::Metal, pbr.metallic_roughness_texture.as_ref().filter(|_| is_metal)),
        (TextureRole::Specular, specular.and_then(|some| some.specular_glossiness_texture.as_ref())),
        (TextureRole::Transmission, passes.and_then(|some| some.transmission_texture.as_ref())),
    ]
    .into_iter()
    .filter_map(|(role, texture)| Some((role, texture?)))
}

/// The set of places that a texture takes, and the map of these before they are looked up (KHR_texture_transform: translation ×
/// rotation × scale).
pub(super) fn placing(document: &Document, texture: &TextureUse) -> (usize, Placing) {
    let sampler = document.textures.get(texture.index).and_then(|texture| texture.sampler);
    let sampler = sampler.and_then(|number| document.samplers.get(number));
    let wrap = sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t]).map(wrap);
    let placing = Placing { wrap, ..Placing::FROM_ABOVE };
    let Some(transform) = &texture.extensions.transform else {
        return (texture.tex_coord, placing);
    };
    let (sin, cos) = transform.rotation.sin_cos();
    let scale = DMat2::from_diagonal(DVec2::from_array(transform.scale.unwrap_or([1.0; 2])));
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let offset = DVec2::from_array(transform.offset);
    let placing = Placing { linear: rotation * scale, offset, ..placing };
    (transform.tex_coord.unwrap_or(texture.tex_coord), placing)
}

/// What a number of OpenGL says of an image beyond its edges (specification, section 5.26).
fn wrap(number: Option<u32>) -> Wrap {
    match number {
        Some(33_071) => Wrap::Clamp,
        Some(33_648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
