//! Reports on surfaces that coincide, in words.

use radiosity::{Scene, Side, surfaces::Overlap};
use report::words::counted;

/// The number of overlaps that are named.
const NAMED: usize = 10;

/// The part of a side that one surface must cover for the side to count as buried.
const BURIED: f64 = 1.0 - 1e-6;

/// The overlaps between coincident surfaces of a scene.
pub struct Coincident<'a> {
    scene: &'a Scene,
    planes: usize,
    /// The overlaps, the largest first.
    overlaps: Vec<Overlap>,
    /// The active sides that another surface covers wholly: surface and side.
    buried: Vec<(u32, Side)>,
}

impl<'a> Coincident<'a> {
    /// Finds the overlaps of a scene.
    pub fn of(scene: &'a Scene) -> Self {
        let mut coincident =
            Coincident { scene, planes: scene.stacks().len(), overlaps: vec![], buried: vec![] };
        for stack in scene.stacks() {
            for overlap in stack.overlaps(scene.surfaces()) {
                let Overlap { upper, lower, area } = overlap;
                // The upper surface's lower side touches the lower surface's upper side.
                let up = |surface: u32| scene.surfaces()[surface as usize].normal().dot(stack.normal) > 0.0;
                for (surface, faces_other) in [(upper, !up(upper)), (lower, up(lower))] {
                    let side = if faces_other { Side::Front } else { Side::Back };
                    let whole = area >= BURIED * scene.surfaces()[surface as usize].area();
                    if whole && scene.surfaces()[surface as usize].is_active(side) {
                        coincident.buried.push((surface, side));
                    }
                }
                coincident.overlaps.push(overlap);
            }
        }
        coincident.overlaps.sort_by(|a, b| b.area.total_cmp(&a.area));
        coincident.buried.sort_by_key(|&(surface, side)| (surface, side == Side::Back));
        coincident.buried.dedup();
        coincident
    }

    /// The part of the emitted power that buried faces emit.
    pub fn buried_power(&self) -> f64 {
        let faces = self.scene.faces();
        let power = |&(surface, side): &(u32, Side)| {
            let first = faces.first_piece_on(surface, side).unwrap_or(0);
            let cells = self.scene.surfaces()[surface as usize].cell_count();
            (first..first + cells).map(|piece| faces.piece(piece).power(0)).sum::<f64>()
        };
        let total = self.scene.total_power(0);
        if total > 0.0 { self.buried.iter().map(power).sum::<f64>() / total } else { 0.0 }
    }

    /// The report: pairs, areas and buried sides; no lines if no surfaces coincide.
    pub fn lines(&self) -> Vec<String> {
        if self.overlaps.is_empty() {
            return Vec::new();
        }
        let name = |surface: u32| format!("surface {}", self.scene.surface_name(surface));
        let area: f64 = self.overlaps.iter().map(|overlap| overlap.area).sum();
        let mut lines = vec![format!(
            "coincident: {} of surfaces in {}, {area:.6} m² in all; they are taken as layers, in which fronts of \
             one-sided surfaces are outermost",
            counted(self.overlaps.len() as u64, "overlap"),
            counted(self.planes as u64, "plane")
        )];
        let named = self.overlaps.iter().take(NAMED);
        lines.extend(named.map(|&Overlap { upper, lower, area }| {
            format!("coincident: {} on {}, {area:.6} m²", name(upper), name(lower))
        }));
        if self.overlaps.len() > NAMED {
            lines.push(format!("coincident: and {} smaller overlaps", self.overlaps.len() - NAMED));
        }
        if !self.buried.is_empty() {
            let named = self
                .buried
                .iter()
                .take(NAMED)
                .map(|&(surface, side)| format!("{} of {}", report::side_name(side), name(surface)));
            let more = if self.buried.len() > NAMED { ", …" } else { "" };
            lines.push(format!(
                "buried: {} that another surface covers wholly, so that no light of the room gets there: {}{more}",
                counted(self.buried.len() as u64, "side"),
                named.collect::<Vec<_>>().join(", ")
            ));
        }
        if self.buried_power() > 0.0 {
            lines.push(format!(
                "buried: {:.3} % of the light is emitted by such sides, and never seen; remove what covers them, or move it",
                100.0 * self.buried_power()
            ));
        }
        lines
    }
}
