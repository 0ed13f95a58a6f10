//! The rays of diffuse walks, by the public parts of the kernel.

use radiosity::{Scene, Sequence, Side, WalkRng, rays::Ray, surfaces::Face};

use super::Failure;

/// The emitting patches, and the cumulative sums of their powers.
pub struct Emitters {
    patches: Vec<usize>,
    cumulative: Vec<f64>,
}

impl Emitters {
    pub fn new(scene: &Scene) -> Self {
        let patches = scene.faces();
        let emitting: Vec<usize> = (0..patches.len()).filter(|&i| patches.get(i).power(0) > 0.0).collect();
        let mut total = 0.0;
        let cumulative = emitting
            .iter()
            .map(|&i| {
                total += patches.get(i).power(0);
                total
            })
            .collect();
        Emitters { patches: emitting, cumulative }
    }

    /// Chooses an emitter, with probability Φ_s/Φ_T.
    fn choose(&self, rng: &mut WalkRng) -> usize {
        let power = rng.pair()[0] * self.cumulative[self.cumulative.len() - 1];
        self.patches[self.cumulative.partition_point(|&sum| sum <= power).min(self.patches.len() - 1)]
    }
}

/// A discrete collision walk; calls back with each ray and the t of its hit.
pub fn walk(
    scene: &Scene,
    emitters: &Emitters,
    rng: &mut WalkRng,
    mut tell: impl FnMut(&Ray, Option<f64>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let Face { surface: mut number, mut side, patch, .. } = scene.faces().get(emitters.choose(rng));
    let mut cell = patch - scene.surfaces()[number as usize].piece(0, Side::Front);
    loop {
        let surface = &scene.surfaces()[number as usize];
        let origin = surface.point(surface.point_in_cell(cell, rng.pair()));
        let ray = Ray { origin, direction: surface.direction(side, rng.bits()), from: number };
        let hit = scene.closest_hit(&ray);
        tell(&ray, hit.map(|hit| hit.t))?;
        let Some(hit) = hit else { return Ok(()) };
        let surface = &scene.surfaces()[hit.surface as usize];
        if !surface.is_active(hit.side) || !surface.survives(rng.bits()) {
            return Ok(());
        }
        (number, cell, side) = (hit.surface, surface.cell_at(hit.uv), hit.side);
    }
}

/// Rays in the order in which `lanes` walks side by side trace them: a ray of each in turn, and another walk where one has
/// ended.
pub fn side_by_side(scene: &Scene, lanes: usize, count: usize) -> Result<Vec<Ray>, Failure> {
    let (emitters, sequence) = (Emitters::new(scene), Sequence::new(1));
    let mut numbers = sequence.walks_from(0);
    let mut walks = vec![Vec::new().into_iter(); lanes];
    let mut rays = Vec::with_capacity(count + lanes);
    while rays.len() < count {
        for lane in &mut walks {
            if lane.len() == 0 {
                let mut path = Vec::new();
                let mut rng = numbers.next().expect("there is no last walk");
                walk(scene, &emitters, &mut rng, |ray, _| {
                    path.push(*ray);
                    Ok(())
                })?;
                *lane = path.into_iter();
            }
            rays.extend(lane.next());
        }
    }
    rays.truncate(count);
    Ok(rays)
}
