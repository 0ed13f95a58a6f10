//! What a camera sees in the middle of each pixel, and what stands between the middles: slats, rails and legs may be thinner than a pixel.

use parallel::on_all_cores;
use radiosity::Scene;

use super::spot::{BAND, Spot};
use crate::camera::Camera;

/// The ways from a pixel to those beside it: along rows, columns, and the diagonals down to the right and to the left.
pub(super) const AXES: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [-1, 1]];

/// Samples along each side of a pixel that an edge goes through.
const FINE: u32 = 4;

/// Where a pixel is looked at for what is thinner than a pixel, and may miss its middle: four places, no two of them in one row or column of
/// the quarters of the pixel.
const PROBES: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];

/// Looks on the way from the middle of a pixel to that of the next.
const BETWEEN: usize = 16;

/// Pixels that are looked at together.
pub(super) const AT_ONCE: usize = 256;

/// The cosine between the normals of surfaces that go on one into the other.
const GOES_ON: f64 = 0.98;

/// What is in sight in a picture.
pub(super) struct Sights {
    pub(super) camera: Camera,
    /// What is seen in the middle of the pixels.
    pub(super) spots: Vec<Spot>,
    /// By pixel, whether something is in sight in it that the middles of it and of the pixels around miss.
    has_thin: Vec<bool>,
    /// By pixel, bit k: whether such a thing stands between it and the next along axis k of [`AXES`].
    parted: Vec<u8>,
}

/// A scene in front of a camera.
#[derive(Clone, Copy)]
struct SceneView<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    spots: &'a [Spot],
    is_lit: bool,
}

impl Sights {
    /// What a camera sees. `is_lit` is whether the light between pieces of a surface is known.
    pub(super) fn new(camera: Camera, scene: &Scene, is_lit: bool) -> Self {
        let [width, height] = camera.size.map(|side| side as usize);
        let bands = height.div_ceil(BAND);
        let rows = |band: usize| band * BAND..((band + 1) * BAND).min(height);
        let middles = on_all_cores(bands, |band| {
            let points = rows(band).flat_map(|y| (0..width).map(move |x| [x, y].map(|at| at as f64 + 0.5)));
            Spot::seen_by(&camera, scene, &points.collect::<Vec<_>>())
        });
        let spots = middles.concat();
        let view = SceneView { scene, camera: &camera, spots: &spots, is_lit };
        let thin = on_all_cores(bands, |band| {
            let thin = view.thin(rows(band));
            let parted = view.parted(&thin);
            (thin, parted)
        });
        let (mut has_thin, mut parted) = (vec![false; spots.len()], vec![0; spots.len()]);
        for (thin, between) in thin {
            thin.into_iter().for_each(|[x, y]| has_thin[y * width + x] = true);
            between.into_iter().for_each(|(pixel, axis)| parted[pixel] |= 1 << axis);
        }
        Sights { camera, spots, has_thin, parted }
    }

    /// Whether something is in sight in a pixel that the middles of it and of the pixels around miss.
    pub(super) fn has_thin(&self, pixel: usize) -> bool {
        self.has_thin[pixel]
    }

    /// Whether such a thing stands between a pixel and the next along an axis.
    pub(super) fn are_parted(&self, pixel: usize, axis: usize) -> bool {
        self.parted[pixel] >> axis & 1 == 1
    }
}

impl SceneView<'_> {
    /// The pixels of some rows with something in sight that the middles of them and of the pixels around miss. It is followed from pixel to
    /// pixel, and from edges on, since it may be too thin to be found everywhere.
    fn thin(&self, rows: std::ops::Range<usize>) -> Vec<[usize; 2]> {
        let width = self.camera.size[0] as usize;
        let all: Vec<[usize; 2]> = rows.clone().flat_map(|y| (0..width).map(move |x| [x, y])).collect();
        let mut thin = self.with_more(&all, &PROBES);
        if !self.is_lit {
            return thin;
        }
        let is_edge = |&&[x, y]: &&[usize; 2]| {
            let own = &self.spots[y * width + x];
            self.around([x, y]).any(|other| !self.goes_on(own, &self.spots[other]))
        };
        let mut is_known = vec![false; all.len()];
        let edges: Vec<[usize; 2]> = all.iter().filter(is_edge).copied().collect();
        let index = |[x, y]: [usize; 2]| (y - rows.start) * width + x;
        thin.iter().for_each(|&pixel| is_known[index(pixel)] = true);
        let mut latest = [edges, thin.clone()].concat();
        while !latest.is_empty() {
            let beside: Vec<[usize; 2]> = latest
                .iter()
                .flat_map(|&pixel| self.around(pixel).map(|other| [other % width, other / width]))
                .filter(|pixel| rows.contains(&pixel[1]))
                .filter(|&pixel| !std::mem::replace(&mut is_known[index(pixel)], true))
                .collect();
            latest = self.with_more(&beside, &fine_places());
            thin.extend(&latest);
        }
        thin
    }

    /// Between which pixels and the next, at some with thin things and around them, along which axis, something stands that neither middle shows.
    fn parted(&self, thin: &[[usize; 2]]) -> Vec<(usize, usize)> {
        let [width, height] = self.camera.size.map(|side| side as usize);
        let next = |own: usize, way: [isize; 2]| {
            let x = (own % width).checked_add_signed(way[0]).filter(|x| *x < width)?;
            Some((own / width).checked_add_signed(way[1]).filter(|y| *y < height)? * width + x)
        };
        let pairs_of = |own: usize| {
            AXES.into_iter().enumerate().flat_map(move |(axis, [right, down])| {
                let ahead = next(own, [right, down]).map(|other| [own, other, axis]);
                let behind = next(own, [-right, -down]).map(|other| [other, own, axis]);
                [ahead, behind].into_iter().flatten()
            })
        };
        let mut pairs: Vec<[usize; 3]> =
            thin.iter().flat_map(|&pixel| self.around(pixel)).flat_map(pairs_of).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs.retain(|&[own, other, _]| self.goes_on(&self.spots[own], &self.spots[other]));
        let way = |&[own, _, axis]: &[usize; 3]| {
            let (x, y) = ((own % width) as f64 + 0.5, (own / width) as f64 + 0.5);
            (0..BETWEEN).map(move |k| {
                let part = (k as f64 + 0.5) / BETWEEN as f64;
                [x + AXES[axis][0] as f64 * part, y + AXES[axis][1] as f64 * part]
            })
        };
        let of_some = |some: &[[usize; 3]]| {
            let points: Vec<[f64; 2]> = some.iter().flat_map(way).collect();
            let spots = Spot::seen_by(self.camera, self.scene, &points);
            let is_parted = |(&[own, other, axis], spots): (&[usize; 3], &[Spot])| {
                let ends = [own, other].map(|pixel| self.spots[pixel]);
                let is_of_ends = |spot: &Spot| ends.iter().any(|end| self.shows(end, spot));
                spots.iter().any(|spot| !is_of_ends(spot)).then_some((own, axis))
            };
            some.iter().zip(spots.chunks_exact(BETWEEN)).filter_map(is_parted).collect::<Vec<_>>()
        };
        pairs.chunks(AT_ONCE).flat_map(of_some).collect()
    }

    /// Those of some pixels that show something, in some places of the pixel, that the middles of them and of those around miss.
    fn with_more(&self, pixels: &[[usize; 2]], places: &[[f64; 2]]) -> Vec<[usize; 2]> {
        let width = self.camera.size[0] as usize;
        let has_more = |(&[x, y], spots): (&[usize; 2], &[Spot])| {
            let own = &self.spots[y * width + x];
            let is_more = |spot: &Spot| {
                !self.shows(own, spot)
                    && !self.around([x, y]).any(|other| self.shows(&self.spots[other], spot))
            };
            spots.iter().any(is_more).then_some([x, y])
        };
        let of_some = |some: &[[usize; 2]]| {
            let points: Vec<[f64; 2]> = some.iter().flat_map(|&pixel| within(pixel, places)).collect();
            let spots = Spot::seen_by(self.camera, self.scene, &points);
            some.iter().zip(spots.chunks_exact(places.len())).filter_map(has_more).collect::<Vec<_>>()
        };
        pixels.chunks(AT_ONCE).flat_map(of_some).collect()
    }

    /// The pixels around one, and itself.
    fn around(&self, pixel: [usize; 2]) -> impl Iterator<Item = usize> {
        around(self.camera.size, pixel)
    }

    /// Whether the middle of a pixel shows what is seen elsewhere.
    fn shows(&self, middle: &Spot, spot: &Spot) -> bool {
        spot.is_beside(middle) || self.goes_on(middle, spot)
    }

    fn goes_on(&self, a: &Spot, b: &Spot) -> bool {
        if self.is_lit { goes_on(self.scene, a, b) } else { a == b }
    }
}

/// The pixels around one, and itself, in a picture of some width and height.
pub(super) fn around(size: [u32; 2], [x, y]: [usize; 2]) -> impl Iterator<Item = usize> {
    let [width, height] = size.map(|side| side as usize);
    (y.saturating_sub(1)..(y + 2).min(height))
        .flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
}

/// Whether two spots are on one surface to the eye.
pub(super) fn goes_on(scene: &Scene, a: &Spot, b: &Spot) -> bool {
    let (Some(one), Some(other)) = (a.piece(), b.piece()) else { return a == b };
    if a == b {
        return true;
    }
    let [one, other] = [one, other].map(|piece| scene.faces().piece(piece));
    let [n, m] =
        [&one, &other].map(|face| scene.surfaces()[face.surface as usize].normal() * face.side.sign());
    let way = other.centroid - one.centroid;
    (one.reflectance, one.emittance) == (other.reflectance, other.emittance)
        && n.dot(m) >= GOES_ON
        && n.dot(way).abs() <= 0.1 * way.length()
}

/// Where a pixel with edges is looked at: in a cell of the pixel each, no two of them in one row or column. Of a slat as many as it covers are on it.
pub(super) fn fine_places() -> Vec<[f64; 2]> {
    let offset = |cell: u32, within: u32| (f64::from(cell * FINE + within) + 0.5) / f64::from(FINE * FINE);
    let at = |k: u32| (k % FINE, k / FINE);
    (0..FINE * FINE).map(at).map(|(i, j)| [offset(i, j), offset(j, i)]).collect()
}

/// Some places of a pixel, as points of the picture.
pub(super) fn within([x, y]: [usize; 2], places: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> {
    places.iter().map(move |[right, down]| [x as f64 + right, y as f64 + down])
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use job::Stand;
    use radiosity::{IndexChoice, SceneSpec};

    use super::*;
    use crate::scenes::quad;

    /// A slat a tenth of a pixel thick, which slopes across a wall: in each column some middle shows it, or it stands between two of them, and it is found
    /// nowhere else.
    #[test]
    fn a_slat_thinner_than_a_pixel_is_found_all_along() {
        let wall = [[-2.0, 1.0, -2.0], [3.0, 1.0, -2.0], [-2.0, 1.0, 3.0]];
        let slat = [[-1.0, 0.9, 0.45], [2.0, 0.9, 0.55], [-1.0, 0.9, 0.452]];
        let mut surfaces = vec![quad("wall", wall, [1, 1], 0.5), quad("slat", slat, [1, 1], 0.2)];
        surfaces[0].emittance = 1.0.into();
        let scene = Scene::build(&SceneSpec::new(surfaces), IndexChoice::Auto).unwrap();
        let (eye, look_at) = (DVec3::new(0.5, -1.0, 0.5), DVec3::new(0.5, 1.0, 0.5));
        let stand = Stand { eye, look_at, up: Some(DVec3::Z), fov: 40.0 };
        let [width, height] = [96, 72];
        let view =
            job::View { stand: Some(stand), size: Some([width as u32, height as u32]), ..Default::default() };
        let sights = Sights::new(Camera::of_view(&scene, &view, |_| true), &scene, true);
        let mut between = 0;
        for x in 0..width {
            let parted: Vec<usize> = (0..height).filter(|y| sights.are_parted(y * width + x, 1)).collect();
            let shown: Vec<usize> =
                (0..height).filter(|y| sights.spots[y * width + x].surface == 1).collect();
            assert_eq!(parted.len() + shown.len(), 1, "column {x}: {parted:?} {shown:?}");
            between += parted.len();
            let at = [parted, shown].concat()[0];
            for y in (0..height).filter(|y| y.abs_diff(at) > 2) {
                let pixel = y * width + x;
                assert!(
                    !sights.has_thin(pixel) && (0..AXES.len()).all(|axis| !sights.are_parted(pixel, axis))
                );
            }
        }
        assert!(between > 2 * width / 3, "{between}");
    }
}
