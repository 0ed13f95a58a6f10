//! The diffuse part of glTF's materials.

use glam::{DMat2, DVec2};
use radiosity::{Sides, Spectrum};

use super::json::{Document, MaterialJson, TextureUse};
use crate::mesh::{LostProperty, Material};
use crate::texture::Placing;

/// The materials in the order of the file.
pub(super) fn materials(document: &Document) -> Vec<Material> {
    document.materials.iter().enumerate().map(|(number, json)| material(number, json)).collect()
}

/// Reads a material. Its reflectance is the part of the base colour that is no metal; its emittance [W/m²] is
/// emissiveFactor × emissiveStrength, which the reader turns into an exitance where the file has lamps.
fn material(number: usize, json: &MaterialJson) -> Material {
    let strength = json.extensions.emissive.as_ref().and_then(|emissive| emissive.emissive_strength);
    let emittance = json.emissive_factor.map(|factor| factor * strength.unwrap_or(1.0));
    let name = json.name.clone().filter(|name| !name.is_empty());
    let mut material = Material {
        emittance: Spectrum::rgb(emittance),
        sides: Some(if json.double_sided { Sides::Both } else { Sides::Front }),
        ..Material::unknown(name.unwrap_or_else(|| format!("material {number}")))
    };
    let [red, green, blue, alpha] = base(json).unwrap_or([1.0; 4]);
    let kept = 1.0 - metal(json);
    material.reflectance = Spectrum::rgb([red, green, blue].map(|channel| channel * kept));
    let transmitted = json.extensions.transmission.as_ref().map_or(0.0, |some| some.transmission_factor);
    let through = match json.alpha_mode.as_deref() {
        Some("MASK") if alpha >= json.alpha_cutoff.unwrap_or(0.5) => 0.0,
        Some("MASK") => 1.0,
        _ if has_alpha(json) => 1.0 - alpha,
        _ => 0.0,
    };
    material.passes(transmitted.max(through));
    if kept < 1.0 || json.extensions.specular.is_some() {
        material.loses(LostProperty::Mirror);
    }
    material
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

/// The textures of a material: that of its colour and that of its emission, where it emits.
pub(super) fn textures(json: &MaterialJson) -> [Option<&TextureUse>; 2] {
    let colour = match &json.extensions.specular {
        Some(specular) => specular.diffuse_texture.as_ref(),
        None => json.pbr_metallic_roughness.base_color_texture.as_ref(),
    };
    let emits = json.emissive_factor.iter().any(|&factor| factor > 0.0);
    [colour, json.emissive_texture.as_ref().filter(|_| emits)]
}

/// The set of places that a texture takes, and the map of these before they are looked up (KHR_texture_transform: translation ×
/// rotation × scale).
pub(super) fn placing(texture: &TextureUse) -> (usize, Placing) {
    let Some(transform) = &texture.extensions.transform else {
        return (texture.tex_coord, Placing::FROM_ABOVE);
    };
    let (sin, cos) = transform.rotation.sin_cos();
    let scale = DMat2::from_diagonal(DVec2::from_array(transform.scale.unwrap_or([1.0; 2])));
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let placing = Placing { linear: rotation * scale, offset: DVec2::from_array(transform.offset) };
    (transform.tex_coord.unwrap_or(texture.tex_coord), placing)
}

/// The part of a material that is metal and reflects like a mirror. A factor that is left out is 1 by the
/// specification; files that leave it out, or have a texture for it, hardly mean metal throughout.
fn metal(json: &MaterialJson) -> f64 {
    let pbr = &json.pbr_metallic_roughness;
    match pbr.metallic_factor {
        Some(metal) if pbr.metallic_roughness_texture.is_none() && json.extensions.specular.is_none() => {
            metal
        }
        _ => 0.0,
    }
}
