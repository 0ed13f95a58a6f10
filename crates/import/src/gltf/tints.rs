//! Colours of vertices, which multiply those of materials (specification, section 3.7.2.1): their mean does.

use std::collections::HashMap;

use radiosity::Spectrum;

use crate::mesh::Mesh;

/// The sums of the colours of faces, material by material.
#[derive(Default)]
pub(super) struct VertexTints {
    of_material: HashMap<u32, TintSum>,
}

/// The sum of some colours in linear light by area, the area, and whether any colour is not white.
#[derive(Default)]
struct TintSum {
    sum: [f64; 3],
    area: f64,
    coloured: bool,
}

impl VertexTints {
    /// Adds the triangles of a mesh from `before` on, whose vertices are numbered from `first`. A vertex without a colour is white.
    pub(super) fn add<const N: usize>(
        &mut self,
        mesh: &Mesh,
        before: usize,
        first: u32,
        colours: &[[f64; N]],
    ) {
        for triangle in &mesh.triangles[before..] {
            let of = self.of_material.entry(triangle.material).or_default();
            let area = mesh.area(triangle);
            of.area += area;
            // The mean of a colour that varies linearly is that of the corners.
            for corner in triangle.corners {
                let colour = colours.get((corner - first) as usize);
                for (channel, sum) in of.sum.iter_mut().enumerate() {
                    let own = colour.map_or(1.0, |colour| colour[channel].clamp(0.0, 1.0));
                    of.coloured |= own < 1.0;
                    *sum += own * area / 3.0;
                }
            }
        }
    }

    /// Multiplies what materials reflect by the mean over their faces.
    pub(super) fn apply(self, mesh: &mut Mesh) {
        let has_mean = |of: &TintSum| of.coloured && of.area > 0.0 && of.area.is_finite();
        for (number, TintSum { sum, area, .. }) in self.of_material.into_iter().filter(|(_, of)| has_mean(of))
        {
            let material = &mut mesh.materials[number as usize];
            let own = material.reflectance.channels();
            material.reflectance = Spectrum::rgb(std::array::from_fn(|c| own[c] * sum[c] / area));
            material.texture.get_or_insert_with(|| "colours of vertices".into());
        }
    }
}
