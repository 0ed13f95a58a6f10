//! Lights without area (KHR_lights_punctual), as small surfaces that send the same flux.

use std::f64::consts::{FRAC_PI_4, PI};

use glam::{DAffine3, DVec3};
use radiosity::{Sides, Spectrum};

use super::json::LightJson;
use crate::mesh::{Material, Mesh, MeshParts, Triangle};
use crate::tally::NoteCounts;

/// The radius of a substitute, in parts of the diagonal of the scene.
const RADIUS: f64 = 0.003;

/// A light on its way to a surface.
#[derive(Clone, Debug)]
pub(super) struct PunctualLight {
    name: String,
    at: DVec3,
    /// The axis of a spot; `None` of a light that shines all around.
    axis: Option<DVec3>,
    /// The flux [lm].
    flux: Spectrum,
}

impl PunctualLight {
    /// Reads a light, whose intensity I is in cd. Its flux is 4π·I all around, and 2π(1 − cos θ)·I in a cone of half angle θ. A
    /// directional light has no place, and is counted as left out.
    pub(super) fn of(json: &LightJson, node: &str, place: &DAffine3, tally: &mut NoteCounts) -> Option<Self> {
        let intensity = json.intensity.unwrap_or(1.0);
        let (solid, axis) = match json.kind.as_str() {
            "point" => (4.0 * PI, None),
            "spot" => {
                let half = json.spot.outer_cone_angle.unwrap_or(FRAC_PI_4);
                (2.0 * PI * (1.0 - half.cos()), Some(place.matrix3 * DVec3::NEG_Z))
            }
            _ => {
                tally.count("directional lights left out; --sky=10000 gives light from outside");
                return None;
            }
        };
        let flux = json.color.unwrap_or([1.0; 3]).map(|channel| channel * intensity * solid);
        let (at, flux) = (place.translation, Spectrum::rgb(flux));
        let finite = at.is_finite() && flux.channels().iter().all(|flux| (0.0..f64::MAX).contains(flux));
        let name = json.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| node.to_owned());
        let axis = axis.map(DVec3::normalize_or_zero);
        let aimed = axis.is_none_or(|axis| axis.is_normalized());
        (finite && aimed && flux.is_lit()).then_some(PunctualLight { name, at, axis, flux })
    }
}

/// Adds a surface for each light: an icosahedron all around, an octagon for a spot. Each has a black material of its own.
pub(super) fn substitute(
    lights: &[PunctualLight],
    mesh: &mut Mesh,
    parts: &mut MeshParts,
    tally: &mut NoteCounts,
) {
    if lights.is_empty() {
        return;
    }
    let low = mesh.positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = mesh.positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let radius = RADIUS * (high - low).length();
    if !(radius.is_finite() && radius > 0.0) {
        return;
    }
    mesh.luminous = true;
    for light in lights {
        tally.count("lights without area, for which small surfaces send the same flux (lm)");
        let material = mesh.materials.len() as u32;
        mesh.materials.push(Material {
            reflectance: Spectrum::BLACK,
            power: Some(light.flux),
            sides: Some(Sides::Front),
            ..Material::unknown(light.name.clone())
        });
        parts.enter(mesh, &light.name);
        let first = mesh.positions.len() as u32;
        let (corners, faces) = light.axis.map_or_else(icosahedron, octagon);
        mesh.positions.extend(corners.iter().map(|corner| light.at + *corner * radius));
        for corners in faces {
            let (part, face) = parts.next_face(mesh, "light");
            let corners = corners.map(|corner| first + corner);
            mesh.triangles.push(Triangle { corners, part, face, material, line: 0 });
        }
    }
}

/// A regular icosahedron of radius 1, fronts outwards.
fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let long = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for [a, b] in [[1.0, long], [-1.0, long], [1.0, -long], [-1.0, -long]] {
        let corner = DVec3::new(0.0, a, b).normalize();
        corners.extend([corner, DVec3::new(corner.z, 0.0, corner.y), DVec3::new(corner.y, corner.z, 0.0)]);
    }
    // Neighbours are 2/√(1 + φ²) apart, all others farther.
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 1.2;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outwards =
                        (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]) > 0.0;
                    let [b, c] = if outwards { [b, c] } else { [c, b] };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    (corners, faces)
}

/// A regular octagon of radius 1, its front to `axis`.
fn octagon(axis: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (u, v) = axis.any_orthonormal_pair();
    let corner = |i: u32| {
        let (sin, cos) = (f64::from(i) * FRAC_PI_4).sin_cos();
        u * cos + v * sin
    };
    ((0..8).map(corner).collect(), (2..8).map(|i| [0, i - 1, i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn substitutes_are_closed_or_flat_and_face_outwards() {
        let (corners, faces) = icosahedron();
        assert_eq!((corners.len(), faces.len()), (12, 20));
        let normal = |corners: &[DVec3], [a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
            (b - a).cross(c - a)
        };
        let sum: DVec3 = faces.iter().map(|&face| normal(&corners, face)).sum();
        assert!(sum.length() < 1e-12, "{sum}");
        assert!(faces.iter().all(|&face| normal(&corners, face).dot(corners[face[0] as usize]) > 0.0));
        let axis = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let (corners, faces) = octagon(axis);
        assert!(faces.iter().all(|&face| normal(&corners, face).normalize().distance(axis) < 1e-12));
    }
}
