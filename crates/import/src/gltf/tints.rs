//! Colours of vertices, which multiply those of materials (specification, section 3.7.2.1): their mean does.

use std::collections::HashMap;

use radiosity::Spectrum;

use crate::mesh::Mesh;

/// The sums of the colours of vertices, material by material.
#[derive(Default)]
pub(super) struct VertexTints {
    of_material: HashMap<u32, TintSum>,
}

/// The sum of some colours in linear light, how many there are, and whether any is not white.
#[derive(Default)]
struct TintSum {
    sum: [f64; 3],
    vertices: f64,
    coloured: bool,
}

impl VertexTints {
    /// Adds the vertices of a primitive, which are white where they have no colours.
    pub(super) fn add<const N: usize>(&mut self, material: u32, vertices: usize, colours: &[[f64; N]]) {
        let of = self.of_material.entry(material).or_default();
        of.vertices += vertices as f64;
        let white = (vertices.saturating_sub(colours.len())) as f64;
        of.sum.iter_mut().for_each(|sum| *sum += white);
        for colour in colours.iter().take(vertices) {
            let own = || colour.iter().map(|channel| channel.clamp(0.0, 1.0));
            of.coloured |= own().take(3).any(|channel| channel < 1.0);
            of.sum.iter_mut().zip(own()).for_each(|(sum, channel)| *sum += channel);
        }
    }

    /// Multiplies what materials reflect by the mean of their vertices.
    pub(super) fn apply(self, mesh: &mut Mesh) {
        for (number, TintSum { sum, vertices, .. }) in
            self.of_material.into_iter().filter(|(_, of)| of.coloured)
        {
            let material = &mut mesh.materials[number as usize];
            let own = material.reflectance.channels();
            material.reflectance = Spectrum::rgb(std::array::from_fn(|c| own[c] * sum[c] / vertices));
            material.texture.get_or_insert_with(|| "colours of vertices".into());
        }
    }
}
