//! The diffuse part of glTF's materials.

use radiosity::{Sides, Spectrum};

use super::json::{Document, MaterialJson};
use crate::in_words;
use crate::mesh::Material;

/// The materials in the order of the file.
pub(super) fn materials(document: &Document) -> Vec<Material> {
    document.materials.iter().enumerate().map(|(number, json)| material(number, json)).collect()
}

/// Reads a material. Its reflectance is the part of the base colour that is no metal; its emittance [W/m²] is
/// emissiveFactor × emissiveStrength.
fn material(number: usize, json: &MaterialJson) -> Material {
    let mut dropped = Vec::new();
    let reflectance = reflectance(json, &mut dropped);
    let strength = json.extensions.emissive.as_ref().and_then(|emissive| emissive.emissive_strength);
    let emittance = json.emissive_factor.map(|factor| factor * strength.unwrap_or(1.0));
    if json.emissive_texture.is_some() {
        dropped.push("its emission texture (emissiveFactor is taken as written)".into());
    }
    if let Some(transmission) = &json.extensions.transmission {
        dropped.push(format!("transmission {}", transmission.transmission_factor));
    }
    Material {
        name: json
            .name
            .clone()
            .filter(|name| !name.is_empty())
            .unwrap_or_else(|| format!("material {number}")),
        reflectance,
        emittance: Spectrum::rgb(emittance),
        sides: Some(if json.double_sided { Sides::Both } else { Sides::Front }),
        dropped,
    }
}

fn reflectance(json: &MaterialJson, dropped: &mut Vec<String>) -> Spectrum {
    let pbr = &json.pbr_metallic_roughness;
    let (base, texture, kept) = match &json.extensions.specular {
        Some(specular) => {
            let amount = specular.specular_factor.unwrap_or([1.0; 3]);
            dropped.push(format!("specular reflectance {}", in_words(Spectrum::rgb(amount))));
            (specular.diffuse_factor, &specular.diffuse_texture, 1.0)
        }
        None => (pbr.base_color_factor, &pbr.base_color_texture, 1.0 - metal(json, dropped)),
    };
    let [red, green, blue, alpha] = base.unwrap_or([1.0; 4]);
    if texture.is_some() {
        dropped.push("its colour texture (the colour factor is taken as written)".into());
    }
    if json.alpha_mode.as_deref().is_some_and(|mode| mode != "OPAQUE") && alpha < 1.0 {
        dropped.push(format!("transparency {}", 1.0 - alpha));
    }
    Spectrum::rgb([red, green, blue].map(|channel| channel * kept))
}

/// The part of a material that is metal and reflects like a mirror. A factor that is left out is 1 by the
/// specification; files that leave it out, or have a texture for it, hardly mean metal throughout.
fn metal(json: &MaterialJson, dropped: &mut Vec<String>) -> f64 {
    let pbr = &json.pbr_metallic_roughness;
    match pbr.metallic_factor {
        Some(0.0) => 0.0,
        Some(metal) if pbr.metallic_roughness_texture.is_none() => {
            dropped.push(format!("mirror reflection of metal: {metal} of its colour"));
            metal
        }
        _ => {
            dropped.push(
                "how much of it is metal (taken as none: metallicFactor is missing or textured)".into(),
            );
            0.0
        }
    }
}
