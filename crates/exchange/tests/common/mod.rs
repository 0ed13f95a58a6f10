//! Counted walks, and the factors that `exact` finds.
#![allow(dead_code, reason = "every test file uses its own part")]

use exact::Exact;
use exchange::ExchangeCounts;
use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    exchange::{ExchangeSpec, FactorKind, Segment, exchange_counts},
};

/// A scene whose faces belong to groups, all of which emit.
pub struct Grouped {
    pub scene: Scene,
    pub group_of_face: Vec<u32>,
    pub groups: usize,
}

impl Grouped {
    /// Every face is a group.
    pub fn by_face(spec: &SceneSpec) -> Self {
        Grouped::new(spec, |face, _| face as u32)
    }

    /// The faces of every surface are a group.
    pub fn by_surface(spec: &SceneSpec) -> Self {
        Grouped::new(spec, |_, surface| surface)
    }

    /// Groups by the numbers of faces and their surfaces.
    pub fn new(spec: &SceneSpec, group: impl Fn(usize, u32) -> u32) -> Self {
        let mut spec = spec.clone();
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 1.0.into());
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let group_of_face: Vec<u32> =
            scene.faces().iter().enumerate().map(|(i, face)| group(i, face.surface)).collect();
        let groups = 1 + *group_of_face.iter().max().unwrap() as usize;
        Grouped { scene, group_of_face, groups }
    }

    /// What each group is worth at births [m²].
    pub fn weights(&self, kind: FactorKind) -> Vec<f64> {
        let mut weights = vec![0.0; self.groups];
        for (face, &group) in self.scene.faces().iter().zip(&self.group_of_face) {
            weights[group as usize] += kind.weight(&face);
        }
        weights
    }

    /// Walks of every group, from its walk `first` on.
    pub fn count(&self, kind: FactorKind, seed: u64, first: u64, walks: u64) -> ExchangeCounts {
        let segments = (0..self.groups as u32).map(|group| Segment { group, first, walks }).collect();
        let groups = self.groups as u32;
        let spec = ExchangeSpec { kind, group_of_face: self.group_of_face.clone(), groups, segments };
        let all = spec.walks();
        let method = Method::shooting(EstimatorKind::Absorption);
        let experiment = Experiment::new(self.scene.clone(), method).unwrap().with_exchange(spec).unwrap();
        let mut board = experiment.board();
        // In three pieces, as leases may have it.
        for part in [0..all / 3, all / 3..all / 2, all / 2..all] {
            experiment.walk(&Sequence::new(seed), part, &mut board);
        }
        let mut counts = ExchangeCounts::none(self.groups);
        counts.add(&exchange_counts(&board.take().unwrap(), groups));
        counts
    }

    /// The factors without noise: G columns, then what escapes or ends on backs.
    pub fn truth(&self, spec: &SceneSpec, kind: FactorKind) -> Vec<Vec<f64>> {
        let mut spec = spec.clone();
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 1.0.into());
        let exact = Exact::of_scene(&spec).unwrap();
        let (faces, areas) = (exact.face_count(), exact.areas());
        let mut truth = vec![vec![0.0; self.groups + 1]; self.groups];
        for i in 0..faces {
            let row: Vec<f64> = match kind {
                FactorKind::FirstHit => (0..faces).map(|j| exact.exchange().form_factor(i, j)).collect(),
                FactorKind::Absorbed => {
                    let mut emittance = vec![0.0; faces];
                    emittance[i] = 1.0 / areas[i];
                    let incoming = exact.system().solve(&emittance).incoming;
                    incoming.iter().zip(exact.reflectance()).map(|(phi, r)| (1.0 - r) * phi).collect()
                }
            };
            let from = &mut truth[self.group_of_face[i] as usize];
            let weight = kind.weight(&self.scene.faces().get(i));
            row.iter().zip(&self.group_of_face).for_each(|(f, &to)| from[to as usize] += weight * f);
        }
        for (row, weight) in truth.iter_mut().zip(self.weights(kind)) {
            row.iter_mut().for_each(|factor| *factor /= weight);
            let lost = 1.0 - row.iter().sum::<f64>();
            row[self.groups] = lost;
        }
        truth
    }
}
