//! Links: which faces rays have joined, and how strongly.
//!
//! A ray from i meets j with probability F_ij. Of n_i rays from i and n_j from j, c_ij + c_ji join the two, and both
//! counts expect A_i·F_ij = A_j·F_ji times their density n/A of rays: K_ij = (c_ij + c_ji)/(n_i/A_i + n_j/A_j) is an
//! unbiased estimate of the exchange area A_i·F_ij, symmetric as that is.

use std::ops::AddAssign;
use std::sync::Mutex;

use super::faces::FaceTable;
use super::solve::Straight;
use crate::geometry::face::Face;
use crate::thread_pool::{PARTS_PER_THREAD, ThreadPool};

/// Sums over fewer ends of links are faster than threads are lent.
const FEW_LINKS: usize = 1 << 16;

/// b/R tells as little as b of a black face where R is less: links are solved to the noise of b, of which b there is hardly a part.
const NEARLY_BLACK: f64 = 1e-3;

/// Rays from one face that met another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link<W = u32> {
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) rays: W,
}

/// Counts links, in whole rays or in parts of them. The rays of a face come one after the other, so that one row of counts is
/// open at a time.
pub(crate) struct LinkTable<W = u32> {
    row: u32,
    counts: Vec<W>,
    touched: Vec<u32>,
    links: Vec<Link<W>>,
}

impl<W: Copy + Default + PartialEq + AddAssign> LinkTable<W> {
    /// No link yet, between `faces` faces.
    pub(crate) fn new(faces: usize) -> Self {
        LinkTable { row: 0, counts: vec![W::default(); faces], touched: Vec::new(), links: Vec::new() }
    }

    /// Counts rays from one face to another.
    #[inline(always)]
    pub(crate) fn count(&mut self, from: u32, to: u32, rays: W) {
        if from != self.row {
            self.end_row();
            self.row = from;
        }
        self.add(to, rays);
    }

    /// Counts rays from the face of the open row.
    #[inline(always)]
    fn add(&mut self, to: u32, rays: W) {
        let count = &mut self.counts[to as usize];
        if *count == W::default() {
            self.touched.push(to);
        }
        *count += rays;
    }

    /// The links of all rows that are closed.
    pub(crate) fn links(&self) -> &[Link<W>] {
        &self.links
    }

    /// Takes over the rows of a table whose rays come after those of this one. Both are closed.
    pub(crate) fn extend(&mut self, later: &LinkTable<W>) {
        self.links.extend_from_slice(&later.links);
    }

    /// Takes over the rows of a table that goes on where this one ends, perhaps in the middle of a row: that row becomes
    /// one, in the order that one table would have given it. Both are closed.
    pub(crate) fn join(&mut self, later: &LinkTable<W>) {
        let Some(&Link { from, .. }) = later.links.first() else { return };
        let begun = self.links.iter().rposition(|link| link.from != from).map_or(0, |last| last + 1);
        let cut = later.links.partition_point(|link| link.from == from);
        let (rest, whole) = later.links.split_at(cut);
        self.row = from;
        for link in self.links.split_off(begun).iter().chain(rest) {
            self.add(link.to, link.rays);
        }
        self.end_row();
        self.links.extend_from_slice(whole);
    }

    /// Closes the open row.
    pub(crate) fn end_row(&mut self) {
        for to in self.touched.drain(..) {
            let rays = std::mem::take(&mut self.counts[to as usize]);
            self.links.push(Link { from: self.row, to, rays });
        }
    }
}

/// All links of a chain with their exchange areas, face by face: each link stands with both of its ends.
pub(crate) struct Links<'a> {
    /// Where the links of each face begin; their number last.
    first: Vec<usize>,
    /// The other end of each link.
    other: Vec<u32>,
    /// K of each link [m²].
    exchange: Vec<f64>,
    /// Σ_j K_ij + A_i·(lost part): the area that face i exchanges through [m²]. It expects A_i.
    total: Vec<f64>,
    /// A_i × the part of the face's rays that escaped, that ended on backs [m²].
    lost: Vec<[f64; 2]>,
    pub(crate) faces: &'a FaceTable<'a>,
}

impl<'a> Links<'a> {
    /// Weighs the links of tables by what the faces have shot and lost.
    pub(crate) fn new(
        tables: &[&LinkTable],
        (shot, lost): (&[u32], &[[u32; 2]]),
        faces: &'a FaceTable<'a>,
    ) -> Self {
        let density: Vec<f64> =
            shot.iter().zip(&faces.areas).map(|(&shot, area)| f64::from(shot) / area).collect();
        let lost: Vec<[f64; 2]> = lost
            .iter()
            .zip(&density)
            .map(|(lost, density)| lost.map(|rays| if rays > 0 { f64::from(rays) / density } else { 0.0 }))
            .collect();
        let links = || tables.iter().flat_map(|table| table.links());
        let first = firsts(links(), density.len());
        // In the order of the links, so that sums over those of a face have one order.
        let mut next = first.clone();
        let (mut other, mut exchange) = (vec![0; first[density.len()]], vec![0.0; first[density.len()]]);
        let mut total: Vec<f64> =
            lost.iter().map(|[escaped, absorbed_back]| escaped + absorbed_back).collect();
        for link in links() {
            let (from, to) = (link.from as usize, link.to as usize);
            let k = f64::from(link.rays) / (density[from] + density[to]);
            for (end, far) in [(from, link.to), (to, link.from)] {
                (other[next[end]], exchange[next[end]]) = (far, k);
                next[end] += 1;
                total[end] += k;
            }
        }
        Links { first, other, exchange, total, lost, faces }
    }

    /// Σ_j K_ij + A_i·(lost part) [m²].
    pub(crate) fn total(&self) -> &[f64] {
        &self.total
    }

    /// Adds `sign`·Σ_j K_ij x_j to every y_i, C channels at a time: the way through the links costs more than the sums.
    /// Each sum is made by one thread, in the order of the links.
    pub(crate) fn add_incoming<const C: usize>(
        &self,
        sign: f64,
        x: &[[f64; C]],
        y: &mut [[f64; C]],
        pool: &dyn ThreadPool,
    ) {
        let parts = if self.other.len() < FEW_LINKS { 1 } else { pool.count() };
        if parts == 1 {
            return self.add_to_rows(sign, x, y, 0);
        }
        let rows = y.len().div_ceil(PARTS_PER_THREAD * parts);
        let parts: Vec<_> = y.chunks_mut(rows).map(Mutex::new).collect();
        pool.share(parts.len(), &|part| {
            let mut y = parts[part].lock().expect("no thread panics with it");
            self.add_to_rows(sign, x, &mut y, part * rows);
        });
    }

    /// Adds `sign`·Σ_j K_ij x_j to y, whose numbers are those of the faces from `row` on.
    fn add_to_rows<const C: usize>(&self, sign: f64, x: &[[f64; C]], y: &mut [[f64; C]], row: usize) {
        for (y, ends) in y.iter_mut().zip(self.first[row..].windows(2)) {
            let links = ends[0]..ends[1];
            let mut sum = *y;
            for (&other, k) in self.other[links.clone()].iter().zip(&self.exchange[links]) {
                let (x, k) = (x[other as usize], sign * k);
                for c in 0..C {
                    sum[c] += k * x[c];
                }
            }
            *y = sum;
        }
    }

    /// H of every face [W/m²] in one channel, given what goes along the links there: B, or b where H_d has the light that faces emit. Where a
    /// face reflects and does not emit along links, H = b/R, which conserves energy. An emitter's E would drown what comes in, and b
    /// of a black or nearly black face says nothing: there H is what comes along its links, over all of them, and H_d.
    pub(crate) fn irradiance(
        &self,
        channel: usize,
        direct: &Straight,
        radiosity: &[f64],
        pool: &dyn ThreadPool,
    ) -> Vec<f64> {
        let straight = direct.irradiance.as_ref().map(|h| &h[channel]);
        let faces = self.faces.list.iter().zip(radiosity).zip(self.incoming(radiosity, pool));
        let of_face = |(i, ((face, b), incoming)): (usize, ((&Face, &f64), f64))| {
            let reflectance = face.reflectance[channel];
            match reflectance >= NEARLY_BLACK && (direct.has_emitted || face.emittance[channel] == 0.0) {
                true => b / reflectance,
                false => straight.map_or(incoming, |straight| straight[i] + incoming),
            }
        };
        faces.enumerate().map(of_face).collect()
    }

    /// What comes along the links of each face, over all of them [W/m²].
    pub(super) fn incoming(&self, radiosity: &[f64], pool: &dyn ThreadPool) -> Vec<f64> {
        let mut incoming = vec![[0.0]; radiosity.len()];
        self.add_incoming(1.0, radiosity.as_chunks().0, &mut incoming, pool);
        let over_total =
            |([incoming], total): (&[f64; 1], &f64)| if *total > 0.0 { incoming / total } else { 0.0 };
        incoming.iter().zip(&self.total).map(over_total).collect()
    }

    /// Power that escapes and that ends on backs [W], given B.
    pub(crate) fn lost_power(&self, radiosity: &[f64]) -> [f64; 2] {
        [0, 1].map(|way| self.lost.iter().zip(radiosity).map(|(lost, b)| lost[way] * b).sum())
    }
}

/// Where the links of each face begin, both ends of each counted; their number last.
fn firsts<'a>(links: impl Iterator<Item = &'a Link>, faces: usize) -> Vec<usize> {
    let mut first = vec![0; faces + 1];
    for link in links {
        first[link.from as usize + 1] += 1;
        first[link.to as usize + 1] += 1;
    }
    for face in 0..faces {
        first[face + 1] += first[face];
    }
    first
}
