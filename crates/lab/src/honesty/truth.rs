//! What is true: exact solutions of the patches' system, and runs that are far longer.

use exact::Exact;
use radiosity::{Estimates, Scene, SceneSpec, Side, linear::Slopes, surfaces::Face};
use results::StoredRun;

use super::Failure;
use super::methods::METHODS;
use super::scenes::HonestyScene;

/// How many times longer than a run its reference is.
const LONGER: u64 = 256;
const LONGER_IN_ROOMS: u64 = 64;

/// The walks of a reference whose patches are chosen for them, at least, and the places along each edge of one of its patches.
const FINE_WALKS: u64 = 1 << 21;
const PLACES: u32 = 4;

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
    let of = |(_, face, known): (usize, radiosity::surfaces::Face, Option<radiosity::methods::Channels>)| {
        (0..channels).map(move |c| {
            let h = known.and_then(|known| known[c].irradiance).unwrap_or(0.0);
            let error = known.and_then(|known| known[c].irradiance_error).unwrap_or(0.0);
            [face.emittance[c] + face.reflectance[c] * h, h, error * error]
        })
    };
    estimates.iter().flat_map(of).collect()
}

/// The light of a scene by a far longer run: linear fits on patches that a pilot has chosen for that run, which are the smaller the steeper the light is.
pub struct Fine {
    kept: StoredRun,
    /// The places that it is held against, one in the middle of each part of every piece.
    places: Vec<SurfaceSample>,
    linear: bool,
}

/// A place on a surface: its side and local coordinates, the area that it stands for [m²], and the light reflected there with its variance, by channel.
struct SurfaceSample {
    surface: u32,
    side: Side,
    uv: [f64; 2],
    area: f64,
    reflected: Vec<[f64; 2]>,
}

impl Fine {
    /// The light of a scene with a given number of faces.
    pub fn new(site: &HonestyScene, faces: usize) -> Result<Self, Failure> {
        let chosen = METHODS.iter().find(|method| method.chooses()).expect("patches are chosen");
        let walks = FINE_WALKS.max(LONGER_IN_ROOMS * chosen.paths(site, faces));
        let kept = chosen.run(site, walks, 1 << 41, &[])?;
        let mut fine = Fine { linear: is_linear(&kept), kept, places: Vec::new() };
        let (estimates, mut places) = (fine.kept.estimates(), Vec::new());
        let faces = estimates.scene().faces();
        for face in 0..faces.len() {
            let light = fine.light_on(&estimates, face);
            let share = faces.get(face).area / f64::from(PLACES * PLACES);
            for number in faces.pieces(face) {
                let piece = faces.piece(number);
                // Groups of many small pieces need no more places on each.
                let parts = (piece.area / share).sqrt().ceil().clamp(1.0, f64::from(PLACES)) as u32;
                places.extend(fine.places_on(&estimates, (number, &piece), parts, &light));
            }
        }
        fine.places = places;
        Ok(fine)
    }

    /// Of each channel of a face: b in the mean, the variance of the fit over the face, and the slopes.
    fn light_on(&self, estimates: &Estimates, face: usize) -> Vec<(f64, f64, Option<Slopes>)> {
        let (known, emitted) = (estimates.face(face), estimates.scene().faces().get(face).emittance);
        let slopes = if self.linear { estimates.slopes(face) } else { None };
        let of = |c: usize| {
            let fit = estimates.experiment().fit(estimates.tally(), face, c);
            let variance = fit.map_or(0.0, |fit| fit.mean_variance + fit.slope_variance);
            let mean = known.map_or(0.0, |known| known[c].radiosity - emitted[c]);
            (mean, variance, slopes.as_ref().map(|slopes| slopes[c]))
        };
        (0..estimates.scene().channels()).map(of).collect()
    }

    fn places_on(
        &self,
        estimates: &Estimates,
        (number, piece): (u32, &Face),
        parts: u32,
        light: &[(f64, f64, Option<Slopes>)],
    ) -> Vec<SurfaceSample> {
        let scene = estimates.scene();
        let surface = &scene.surfaces()[piece.surface as usize];
        let cell = number - scene.faces().first_piece_on(piece.surface, piece.side).expect("it has a piece");
        let middles = (0..parts).flat_map(|i| (0..parts).map(move |j| [i, j]));
        let sample = |at: [u32; 2]| {
            let uv = surface.point_in_cell(cell, at.map(|i| (f64::from(i) + 0.5) / f64::from(parts)));
            let reflected = light.iter().map(|(mean, variance, slopes)| {
                [mean + slopes.as_ref().map_or(0.0, |slopes| slope(slopes, scene, number, uv)), *variance]
            });
            let area = piece.area / f64::from(parts * parts);
            SurfaceSample {
                surface: piece.surface,
                side: piece.side,
                uv,
                area,
                reflected: reflected.collect(),
            }
        };
        middles.map(sample).collect()
    }

    /// The relative L2 error of the reflected light that a run's outputs hold, all channels together: of its linear fits, or of the means of
    /// its patches. The reference's own variance is taken off.
    pub fn error(&self, kept: &StoredRun, linear: bool) -> f64 {
        let (estimates, mut wrong, mut light) = (kept.estimates(), 0.0, 0.0);
        let ours = estimates.scene();
        let surfaces = self.kept.experiment.scene().surfaces().len();
        assert_eq!(ours.surfaces().len(), surfaces, "places lie on the same surfaces");
        for SurfaceSample { surface: number, side, uv, area, reflected } in &self.places {
            let surface = &ours.surfaces()[*number as usize];
            let piece = surface.piece(surface.cell_at(*uv), *side);
            let face = ours.faces().face_of(piece) as usize;
            let emitted = ours.faces().get(face).emittance;
            let known = estimates.face(face);
            let slopes = if linear { estimates.slopes(face) } else { None };
            for (c, [truth, variance]) in reflected.iter().enumerate() {
                let mean = known.map_or(0.0, |known| known[c].radiosity - emitted[c]);
                let slope = slopes.as_ref().map_or(0.0, |slopes| slope(&slopes[c], ours, piece, *uv));
                wrong += area * ((mean + slope - truth).powi(2) - variance);
                light += area * (truth * truth - variance);
            }
        }
        (wrong.max(0.0) / light).sqrt()
    }
}

/// Whether what a run's outputs show are linear fits.
pub fn is_linear(kept: &StoredRun) -> bool {
    kept.settings.forecast.is_some_and(|forecast| forecast.linear)
}

/// What a fit adds to the mean at a place of a piece [W/m²].
fn slope(slopes: &Slopes, scene: &Scene, piece: u32, uv: [f64; 2]) -> f64 {
    let weights = scene.faces().corner_weights(piece, uv);
    let corners = scene.corners_on_fit(piece);
    let place = [0, 1].map(|k| corners.iter().zip(weights).map(|(corner, weight)| weight * corner[k]).sum());
    slopes.at(&[place])[0]
}
