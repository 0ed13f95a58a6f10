//! The scorecard: configurations whose answer is known in closed form, walked.
//!
//! Standard errors are those that theory gives the walks, so that every row is judged by a normal deviate.

mod bodies;
mod cie;
mod closed_forms;
mod cones;
mod elements;
mod intervals;
mod shapes;

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_6};

use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Space,
    exchange::{ExchangeRows, FactorKind},
};
use stats::{ChiSquare, Measured};

use crate::claim::Claim;
use crate::lab::Lab;
use crate::papers::{Chapter, Findings};
use crate::walking;

/// All chapters, in the order of the page.
pub const CHAPTERS: [Chapter; 9] = [
    Chapter { name: "catalogue", title: "Form factors of the catalogue", run: catalogue },
    Chapter {
        name: "elements",
        title: "Factors of elements, strips and offset rectangles",
        run: elements::run,
    },
    Chapter { name: "bodies", title: "Spheres, cylinders and plates in a V", run: bodies::run },
    Chapter { name: "cones", title: "Cones, rings, tubes and cells that repeat", run: cones::run },
    Chapter { name: "cie", title: "Test cases of CIE 171", run: cie::run },
    Chapter { name: "enclosures", title: "Cavities, enclosures and streets", run: enclosures },
    Chapter { name: "intervals", title: "Intervals of factors and of heat", run: intervals::run },
    Chapter { name: "gebhart", title: "Heat between a cube and the cube around it", run: gebhart },
    Chapter { name: "closed", title: "Light in closed rooms", run: closed },
];

/// The fewest rows whose chi-square is judged: of ten its deviate is right within 0.2.
const FEWEST_SQUARES: usize = 10;

/// Walks that a thread counts at once.
const PIECE: u64 = 1 << 16;

/// A pair of groups whose factor is known.
struct KnownFactor {
    label: String,
    spec: SceneSpec,
    /// The group of each surface.
    group: fn(u32) -> u32,
    from: u32,
    /// A group; the number of groups for what ends on backs, one more for what escapes.
    to: u32,
    truth: f64,
    /// The steps along x and y at which the scene repeats; 0 where it does not.
    periods: [f64; 2],
}

impl KnownFactor {
    /// From the first surface to the second.
    fn of_surfaces(label: String, spec: SceneSpec, truth: f64) -> Self {
        KnownFactor { label, spec, group: |surface| surface, from: 0, to: 1, truth, periods: [0.0; 2] }
    }

    /// From a cavity to itself.
    fn to_itself(cavity: String, spec: SceneSpec, truth: f64) -> Self {
        let label = format!("{cavity}: to itself");
        KnownFactor { label, spec, group: |_| 0, from: 0, to: 0, truth, periods: [0.0; 2] }
    }

    /// The factor by walks of its first group, a row of sparse factors.
    fn measure(&self, lab: &Lab, kind: FactorKind, seed: u64) -> Claim {
        let walks: u64 = lab.pick(1 << 15, 1 << 22);
        let scene = Scene::build(&self.spec, IndexChoice::Auto).expect("the scene is valid");
        let scene = match self.periods {
            [0.0, 0.0] => scene,
            periods => scene.repeated(periods).expect("the scene is no longer than its periods"),
        };
        let group_of_face: Vec<u32> = scene.faces().iter().map(|face| (self.group)(face.surface)).collect();
        let groups = 1 + group_of_face.iter().max().expect("a scene has faces");
        let rows = ExchangeRows::new(scene, (kind, Space::Discrete), (group_of_face, groups), None)
            .expect("the groups are those of the scene");
        let sequence = Sequence::new(seed);
        let counts = lab.each(
            walks.div_ceil(PIECE) as usize,
            || rows.board(),
            |board, piece| {
                let first = piece as u64 * PIECE;
                rows.walk(&sequence, self.from, first..walks.min(first + PIECE), board);
                let met = board.take().0.into_iter().find(|&(column, _)| column == self.to);
                met.map_or(0, |(_, walks)| walks)
            },
        );
        let value = counts.into_iter().map(f64::from).sum::<f64>() / walks as f64;
        let standard_error = (self.truth * (1.0 - self.truth) / walks as f64).sqrt();
        Claim::equal(&self.label, Measured { value, standard_error }, self.truth)
    }
}

/// The claims of pairs, each with a seed of its own; and where there are enough of them one on their chi-square, which finds small errors of
/// many where no one shows.
fn measure(lab: &Lab, kind: FactorKind, pairs: &[KnownFactor]) -> Vec<Claim> {
    let mut claims: Vec<Claim> = (1..).zip(pairs).map(|(seed, pair)| pair.measure(lab, kind, seed)).collect();
    if claims.len() >= FEWEST_SQUARES {
        let statistic = claims.iter().filter_map(Claim::z).map(|z| z * z).sum();
        let value = ChiSquare { statistic, degrees: claims.len() as f64 }.z();
        let label = format!("chi-square {statistic:.1} of these {}, as a normal deviate", claims.len());
        claims.push(Claim::equal(label, Measured { value, standard_error: 1.0 }, 0.0));
    }
    claims
}

fn catalogue(lab: &Lab) -> Findings {
    let mut pairs = Vec::new();
    for (x, y) in [(1.0, 1.0), (0.2, 0.2), (5.0, 5.0), (1.0, 10.0), (0.1, 3.0)] {
        let truth = closed_forms::opposed_rectangles(x, y);
        let label = format!("opposed rectangles, {x} × {y} at distance 1");
        pairs.push(KnownFactor::of_surfaces(label, shapes::opposed(x, y), truth));
    }
    for (w, h) in [(1.0, 1.0), (1.0, 0.1), (0.1, 1.0), (3.0, 3.0), (0.5, 4.0)] {
        let truth = closed_forms::perpendicular_rectangles(w, h);
        let label = format!("perpendicular rectangles, widths {w} to {h}, common edge 1");
        pairs.push(KnownFactor::of_surfaces(label, shapes::perpendicular(w, h), truth));
    }
    for (r1, r2) in [(1.0, 1.0), (0.5, 2.0), (3.0, 1.0)] {
        pairs.push(KnownFactor {
            label: format!("coaxial discs, radii {r1} to {r2} at distance 1"),
            spec: shapes::discs(r1, r2),
            group: |surface| surface / shapes::SECTORS,
            from: 0,
            to: 1,
            truth: closed_forms::coaxial_discs(r1, r2),
            periods: [0.0; 2],
        });
    }
    for h in [0.25, 2.0] {
        let label = format!("endless strips, width 1 at distance {h}");
        pairs.push(KnownFactor::of_surfaces(label, shapes::strips(h), closed_forms::strips(h)));
    }
    for (angle, degrees) in [(FRAC_PI_6, 30), (FRAC_PI_2, 90), (2.0 * FRAC_PI_3, 120)] {
        let label = format!("endless plates with a common edge, {degrees}°");
        pairs.push(KnownFactor::of_surfaces(label, shapes::wedge(angle), closed_forms::wedge(angle)));
    }
    for [a, b, c] in [[1.0, 1.0, 1.0], [3.0, 4.0, 5.0], [2.0, 1.2, 1.0]] {
        let label = format!("endless prism, sides {a}, {b}, {c}: first to second");
        pairs.push(KnownFactor::of_surfaces(label, shapes::prism(a, b, c), closed_forms::prism(a, b, c)));
    }
    Findings {
        published: "J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*: C-11, C-14, C-41, C-1, C-3, and \
                    crossed strings (Hottel)."
            .into(),
        experiment: format!(
            "Walks from the first group of a pair end at their first hit. Discs are polygons of {} triangles, whose factors differ from \
             those of discs by less than 2·10⁻⁴ of themselves; what is endless is 10⁵ long.",
            shapes::SECTORS
        ),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
}

fn enclosures(lab: &Lab) -> Findings {
    let mut pairs = Vec::new();
    for depth in [0.5, 1.0, 3.0] {
        let cavity = format!("open box of 1 × 1 × {depth}");
        pairs.push(KnownFactor::to_itself(cavity, shapes::open_box(depth), 1.0 - 1.0 / (1.0 + 4.0 * depth)));
    }
    let pit = 4.0 * 0.5 * (0.25_f64 + 0.25).sqrt();
    pairs.push(KnownFactor::to_itself(
        "pit of four triangles, depth 0.5".into(),
        shapes::pit(0.5),
        1.0 - 1.0 / pit,
    ));
    for (from, to, truth) in [(1, 0, 0.25), (1, 1, 0.75)] {
        let to_what = if to == 0 { "the cube in it" } else { "itself" };
        pairs.push(KnownFactor {
            label: format!("cube of 2 around a cube of 1: to {to_what}"),
            spec: shapes::cube_in_cube([0.0; 2]),
            group: |surface| surface / 6,
            from,
            to,
            truth,
            periods: [0.0; 2],
        });
    }
    for cuts in [1, 3] {
        let mut sphere = shapes::icosphere(cuts, 0.0);
        let (area, opening) = shapes::areas(&sphere);
        sphere.surfaces.pop();
        let cavity = format!("icosphere of {} triangles, one of them open", 20 << (2 * cuts));
        pairs.push(KnownFactor::to_itself(cavity, sphere, 1.0 - opening / (area - opening)));
    }
    for h in [0.5, 2.0] {
        pairs.push(KnownFactor {
            label: format!("endless street between walls of height {h}: its floor to the sky"),
            spec: shapes::street(h),
            group: |surface| surface,
            from: 0,
            // What escapes.
            to: 3 + 1,
            truth: closed_forms::strips(h),
            periods: [0.0; 2],
        });
    }
    Findings {
        published: "A cavity of area A with a flat opening a meets itself with 1 − a/A. A convex body of area A₁ in an enclosure of A₂ is \
                    met with A₁/A₂. A street sees of the sky what a strip as wide as itself covers at the height of its walls."
            .into(),
        experiment: "Walks from the group end at their first hit.".into(),
        rows: measure(lab, FactorKind::FirstHit, &pairs),
        ..Findings::default()
    }
}

fn gebhart(lab: &Lab) -> Findings {
    let pairs: Vec<KnownFactor> = [[0.8, 0.8], [0.7, 0.4], [0.1, 0.3], [0.9, 0.05]]
        .into_iter()
        .map(|[e1, e2]| KnownFactor {
            label: format!("emissivities {e1} inside, {e2} outside: absorbed by the enclosure"),
            spec: shapes::cube_in_cube([1.0 - e1, 1.0 - e2]),
            group: |surface| surface / 6,
            from: 0,
            to: 1,
            truth: closed_forms::absorbed_by_enclosure(e1, e2, 0.25),
            periods: [0.0; 2],
        })
        .collect();
    Findings {
        published: "B. Gebhart 1961: B₁₂ of a convex body in an enclosure, from two equations with F₁₂ = 1 and F₂₁ = A₁/A₂.".into(),
        experiment: "Cubes of side 1 and 2, a patch a side: by symmetry all sides of a cube are alike, so that the equations are exact. \
                     Walks end where they are absorbed."
            .into(),
        rows: measure(lab, FactorKind::Absorbed, &pairs),
        ..Findings::default()
    }
}

fn closed(lab: &Lab) -> Findings {
    let mut rows = Vec::new();
    for (name, spec) in [
        ("cube, R = 0.5", furnace(shapes::enclosure([1.0; 3], 0.5))),
        ("cube, R = 0.9", furnace(shapes::enclosure([1.0; 3], 0.9))),
        ("box of 1 × 2 × 5, R = 0.7", furnace(shapes::enclosure([1.0, 2.0, 5.0], 0.7))),
        ("octahedron, R = 0.8", furnace(shapes::octahedron(0.8))),
        ("icosphere of 320 triangles, R = 0.9", furnace(shapes::icosphere(2, 0.9))),
    ] {
        rows.push(radiosity_of_furnace(lab, name, &spec));
    }
    for (seed, reflectance) in [(31, 0.2), (32, 0.5), (33, 0.9)] {
        rows.push(mean_of_room(lab, seed, reflectance));
    }
    Findings {
        published: "The furnace: where every surface has R and emits 1 − R, B = 1. CIE 171:2006, test case 5.8: in a closed room of \
                    reflectance ρ, the flux Φ of a lamp makes a mean illuminance of Φ/S/(1 − ρ) on its surfaces of area S."
            .into(),
        experiment: "Shooting walks, collision estimator. The furnace: B of the first patch, with the standard error that the walks \
                     show. The room of 4 × 4 × 3 with a lamp in a wall: arrivals a walk, whose numbers are geometric."
            .into(),
        rows,
        ..Findings::default()
    }
}

/// Every surface emits 1 − R.
fn furnace(mut spec: SceneSpec) -> SceneSpec {
    for surface in &mut spec.surfaces {
        surface.emittance = (1.0 - surface.reflectance[0]).into();
    }
    spec
}

fn radiosity_of_furnace(lab: &Lab, name: &str, spec: &SceneSpec) -> Claim {
    let experiment = shooting(spec);
    let tally = lab.tally(&experiment, 21, lab.pick(1 << 16, 1 << 23));
    let solution = radiosity::Solution::new(&experiment, &tally, 0.95);
    let known = walking::estimate(&solution, 0);
    let standard_error = known.std_error.expect("walks have met every patch");
    Claim::equal(format!("furnace, {name}: B"), Measured { value: known.radiosity, standard_error }, 1.0)
}

/// Mean illuminance over Φ/S: arrivals of a walk.
fn mean_of_room(lab: &Lab, seed: u64, reflectance: f64) -> Claim {
    let mut spec = shapes::enclosure([4.0, 4.0, 3.0], reflectance);
    spec.surfaces[1..].iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    let walks = lab.pick(1 << 16, 1 << 23);
    let counts = lab.tally(&shooting(&spec), seed, walks).counts;
    let value = counts.rays as f64 / walks as f64;
    let standard_error = reflectance.sqrt() / (1.0 - reflectance) / (walks as f64).sqrt();
    let label = format!("room, ρ = {reflectance}: mean illuminance over Φ/S");
    Claim::equal(label, Measured { value, standard_error }, 1.0 / (1.0 - reflectance))
}

fn shooting(spec: &SceneSpec) -> Experiment {
    walking::experiment(spec, Method::shooting(EstimatorKind::Collision)).expect("the scene is valid")
}
