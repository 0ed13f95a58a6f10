//! Fit: whether a method suits a scene, by what theory says of its variance before any walk is shot.

use radiosity::{Direction, EstimatorKind, Experiment, surfaces::Face};

/// The least factor in variance, or in the length of walks, by which another method must be better to be named.
const WORTH_NAMING: f64 = 10.0;

/// The least reflectance at which analog walks are called long.
const LONG_WALKS: f64 = 0.95;

/// The least part of the area that a walk may be expected to find by chance.
const FINDABLE: f64 = 1e-3;

/// The part of the area below which no usual number of walks hits a patch.
const HITTABLE: f64 = 1e-6;

/// The reasons that theory has against a method in a scene, each a sentence with a remedy.
pub fn misfits(experiment: &Experiment) -> Vec<String> {
    match experiment.method().direction() {
        // Chains aim their rays themselves, and use no estimators.
        None => Vec::new(),
        Some(Direction::Shooting) => [scoring(experiment), length(experiment), smallest(experiment)].concat(),
        Some(Direction::Gathering(_)) => {
            [scoring(experiment), length(experiment), emitters(experiment)].concat()
        }
    }
}

/// The reason against an estimator that scores rarely. Survival scores the part R of the events, and absorption the part
/// 1 − R: their variances are about 1/R and 1/(1 − R) times that of collision (S97 tables 3, 4). Shooting scores on
/// patches, gathering on emitters.
fn scoring(experiment: &Experiment) -> Vec<String> {
    let gathers = experiment.gathers();
    let Some(kind) = experiment.method().estimator_kind() else { return Vec::new() };
    let part = |face: &Face| kind.probability(face.reflectance.max());
    let patches = experiment.scene().faces().iter().enumerate();
    let scoring =
        patches.filter(|(_, p)| if gathers { p.emittance.is_lit() } else { p.reflectance.is_lit() });
    let worst = scoring.map(|(_, face)| (face.patch, part(&face))).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((patch, part)) = worst.filter(|&(_, part)| part > 0.0 && part * WORTH_NAMING <= 1.0) else {
        return Vec::new();
    };
    let what = if gathers { "the light of patch" } else { "patch" };
    vec![format!(
        "this estimator scores 1 in {times:.0} of the hits that tell of {what} {patch}: collision has up to {times:.0} times less variance; write estimator = \"collision\"",
        times = 1.0 / part
    )]
}

/// The reason against long walks: a walk takes up to 1/(1 − R) rays, and near R = 1 all of them tell little more than
/// one.
fn length(experiment: &Experiment) -> Vec<String> {
    let most = experiment.scene().max_reflectance().max();
    if most < LONG_WALKS || !experiment.method().estimator_kind().is_some_and(EstimatorKind::goes_on) {
        return Vec::new();
    }
    vec![format!(
        "reflectances reach {most}: a walk may take {:.0} rays, whose scores depend on each other; those of chains do not (walk = \"jacobi\")",
        1.0 / (1.0 - most)
    )]
}

/// The most patches that are too small to be hit before the scene counts as a mesh, where single patches are of no
/// interest.
const MESH: usize = 8;

/// The reason against very small patches: Sh91 assumes that areas differ by bounded factors.
fn smallest(experiment: &Experiment) -> Vec<String> {
    let patches = || experiment.scene().faces().iter();
    let area: f64 = patches().map(|patch| patch.area).sum();
    let receives = |(_, patch): &(usize, Face)| patch.reflectance.is_lit();
    let smallest = patches().enumerate().filter(receives).min_by(|a, b| a.1.area.total_cmp(&b.1.area));
    let part = |patch: &Face| patch.area / area;
    let Some((patch, share)) =
        smallest.map(|(_, p)| (p.patch, part(&p))).filter(|&(_, share)| share < HITTABLE)
    else {
        return Vec::new();
    };
    if patches().filter(|patch| patch.reflectance.is_lit() && part(patch) < HITTABLE).count() > MESH {
        return Vec::new();
    }
    vec![format!(
        "patch {patch} is {share:.1e} of the area, and about as rarely hit; let walks start on it (walk = \"gathering\", birth = {{ patches = [{patch}] }}), or use coarser patches there"
    )]
}

/// The reason against gathering with small emitters, which a gathering walk meets by chance.
fn emitters(experiment: &Experiment) -> Vec<String> {
    let patches = || experiment.scene().faces().iter();
    let area = |patches: &mut dyn Iterator<Item = Face>| patches.map(|p| p.area).sum::<f64>();
    let lit = area(&mut patches().filter(|patch| patch.emittance.is_lit())) / area(&mut patches());
    if lit >= FINDABLE {
        return Vec::new();
    }
    vec![format!(
        "emitters are {lit:.1e} of the area, and about as rarely met by gathering walks; shooting walks start there (walk = \"shooting\")"
    )]
}
