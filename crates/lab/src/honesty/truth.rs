//! What is true: exact solutions of the patches' system, and runs that are far longer.

use exact::Exact;
use radiosity::{Estimates, Scene, SceneSpec, Shape, Slopes};
use results::Kept;

use super::Failure;
use super::methods::METHODS;
use super::scenes::HonestyScene;

/// How many times longer than a run its reference is.
const LONGER: u64 = 256;
const LONGER_IN_ROOMS: u64 = 64;

/// Cells of the reference along each edge of a patch of a made scene, about how many a room has, and the walks of the reference.
const FINE: u32 = 4;
const FINE_OF_ROOM: f64 = 20_000.0;
const FINE_WALKS: u64 = 1 << 21;

/// B and H of every face and channel, channels of a face side by side, in the order of faces [W/m²], and the variance of H [(W/m²)²].
#[derive(Clone)]
pub struct FaceReference {
    pub light: Vec<[f64; 3]>,
}

impl FaceReference {
    /// The answer of discrete walks, exact in made scenes.
    pub fn discrete(site: &HonestyScene, spec: &SceneSpec, faces: usize) -> Result<Self, Failure> {
        if !site.made {
            return Self::by_run(site, 0, faces);
        }
        let channels = Exact::of_channels(spec, &|_| ())?;
        let of = |c: &Exact, i: usize| [c.solution().radiosity[i], c.solution().irradiance[i], 0.0];
        let light = (0..faces).flat_map(|i| channels.iter().map(move |c| of(c, i)).collect::<Vec<_>>());
        Ok(FaceReference { light: light.collect() })
    }

    /// The answer of continuous walks.
    pub fn continuous(site: &HonestyScene, faces: usize) -> Result<Self, Failure> {
        Self::by_run(site, 1, faces)
    }

    /// The answer of discrete walks in a room, by longer chains: walks that are 64 times longer than the plainest are hardly better than a short chain.
    pub fn of_chains(site: &HonestyScene, faces: usize) -> Result<Self, Failure> {
        let chains = METHODS.iter().position(|method| method.name == "chains").expect("chains are studied");
        Self::by_run(site, chains, faces)
    }

    fn by_run(site: &HonestyScene, method: usize, faces: usize) -> Result<Self, Failure> {
        let method = &METHODS[method];
        let longer = if site.made { LONGER } else { LONGER_IN_ROOMS };
        let kept = method.run(site, longer * method.paths(site, faces), 1 << 40, &[])?;
        Ok(FaceReference { light: light(&kept.estimates()) })
    }
}

/// B and H of every face and channel, and the variance of H; its own emittance where nothing is known.
fn light(estimates: &Estimates) -> Vec<[f64; 3]> {
    let channels = estimates.scene().channels();
    let of = |(_, face, known): (usize, radiosity::Face, Option<radiosity::Channels>)| {
        (0..channels).map(move |c| {
            let h = known.and_then(|known| known[c].irradiance).unwrap_or(0.0);
            let error = known.and_then(|known| known[c].irradiance_error).unwrap_or(0.0);
            [face.emittance[c] + face.reflectance[c] * h, h, error * error]
        })
    };
    estimates.iter().flat_map(of).collect()
}

/// The light on fine cells of the surfaces of a scene, by continuous walks.
pub struct Fine {
    scene: Scene,
    /// Reflected radiosity of every piece, and the variance of that, channels of a piece side by side.
    reflected: Vec<[f64; 2]>,
}

impl Fine {
    /// `None` of made scenes that are not parallelograms in grids.
    pub fn new(site: &HonestyScene, spec: &SceneSpec) -> Result<Option<Self>, Failure> {
        if !site.made {
            return Self::of_room(site, spec).map(Some);
        }
        let mut fine = spec.clone();
        for surface in &mut fine.surfaces {
            let Shape::Parallelogram { cells, .. } = &mut surface.shape else { return Ok(None) };
            let coarse = *cells;
            *cells = cells.map(|n| FINE * n);
            let part = |cell: u32, k: u32| {
                let (u, v) = (FINE * (cell / coarse[1]) + k / FINE, FINE * (cell % coarse[1]) + k % FINE);
                u * cells[1] + v
            };
            let emit = surface.cell_emittance.iter();
            surface.cell_emittance = emit
                .flat_map(|&(cell, e)| (0..FINE * FINE).map(move |k| (cell, k, e)))
                .map(|(cell, k, e)| (part(cell, k), e))
                .collect();
        }
        let folder = tempfile::tempdir()?;
        let site = HonestyScene::made(&site.name, "", &fine, folder.path())?;
        Self::of_run(&METHODS[1].run(&site, FINE_WALKS, 1 << 41, &[])?).map(Some)
    }

    /// The faces of a room, joined as the program joins them where it chooses patches, and cut to cells of one size.
    fn of_room(site: &HonestyScene, spec: &SceneSpec) -> Result<Self, Failure> {
        let area: f64 = spec.surfaces.iter().map(|surface| surface.shape.area()).sum();
        let size = format!("import.patch_size={}", (area / FINE_OF_ROOM).sqrt());
        Self::of_run(&METHODS[1].run(site, 2 * FINE_WALKS, 1 << 41, &["import.join=true".into(), size])?)
    }

    fn of_run(kept: &Kept) -> Result<Self, Failure> {
        let estimates = kept.estimates();
        let channels = estimates.scene().channels();
        let of = |(_, face, known): (usize, radiosity::Face, Option<radiosity::Channels>)| {
            (0..channels).map(move |c| match known {
                Some(known) => {
                    [known[c].radiosity - face.emittance[c], known[c].std_error.unwrap_or(0.0).powi(2)]
                }
                None => [0.0; 2],
            })
        };
        let reflected = estimates.iter().flat_map(of).collect();
        Ok(Fine { scene: kept.experiment.scene().clone(), reflected })
    }

    /// The relative L2 error of the reflected light that a run's outputs hold, all channels together: of its linear fits, or of the means of
    /// its patches. The reference's own variance is taken off.
    pub fn error(&self, kept: &Kept, linear: bool) -> f64 {
        let (estimates, mut wrong, mut light) = (kept.estimates(), 0.0, 0.0);
        let (ours, theirs) = (estimates.scene(), self.scene.faces());
        let channels = ours.channels();
        assert_eq!(ours.surfaces().len(), self.scene.surfaces().len(), "cells lie on the same surfaces");
        for number in 0..theirs.piece_count() as u32 {
            let cell = theirs.piece(number);
            let fine = &self.scene.surfaces()[cell.surface as usize];
            let local = number - fine.piece(0, cell.side);
            let uv = fine.point_in_cell(local, [0.5, 0.5]);
            let surface = &ours.surfaces()[cell.surface as usize];
            let piece = surface.piece(surface.cell_at(uv), cell.side);
            let face = ours.faces().face_of(piece) as usize;
            let emitted = ours.faces().get(face).emittance;
            let known = estimates.face(face);
            let slopes = if linear { estimates.slopes(face) } else { None };
            for c in 0..channels {
                let mean = known.map_or(0.0, |known| known[c].radiosity - emitted[c]);
                let slope = slopes.as_ref().map_or(0.0, |slopes| slope(&slopes[c], ours, piece, uv));
                let [truth, variance] = self.reflected[number as usize * channels + c];
                wrong += cell.area * ((mean + slope - truth).powi(2) - variance);
                light += cell.area * (truth * truth - variance);
            }
        }
        (wrong.max(0.0) / light).sqrt()
    }
}

/// What a fit adds to the mean at a place of a piece [W/m²].
fn slope(slopes: &Slopes, scene: &Scene, piece: u32, uv: [f64; 2]) -> f64 {
    let weights = scene.faces().corner_weights(piece, uv);
    let corners = scene.corners_on_fit(piece);
    let place = [0, 1].map(|k| corners.iter().zip(weights).map(|(corner, weight)| weight * corner[k]).sum());
    slopes.at(&[place])[0]
}
