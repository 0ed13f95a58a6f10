//! What better ways through the tree could win: `radwalk-lab ceiling [TRIANGLES | MESH …]`.
//!
//! The rays of walks are traced as they are, with their distances known, with their leaves known, and sorted: rates of
//! tracing alone, by the least processor time of rounds in turn. Then: how many rays are at a node together.

use std::collections::HashMap;
use std::path::Path;

use super::meshes::grey_scene;
use super::rays::side_by_side;
use super::{Failure, processor_seconds};
use glam::DVec3;
use radiosity::{
    IndexChoice, Scene,
    instruments::{Foresight, Retracing, StepKind, TreeStep},
    rays::Ray,
};
use scenes::interior;

/// The number of rays that are traced.
const RAYS: usize = 1 << 19;

/// The number of timings of each way, of which the least counts: others use the machine.
const ROUNDS: usize = 15;

/// Rays that are taken together, to be sorted or to go down the tree as a stream.
const WINDOWS: [usize; 4] = [1 << 12, 1 << 14, 1 << 16, RAYS];

/// Rays in a packet, and lanes of a vector.
const PACKET: usize = 16;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let mut names = words.to_vec();
    if names.is_empty() {
        names.extend(["57000", "1000000"].map(String::from));
    }
    for name in names {
        let spec = match name.parse() {
            Ok(triangles) => interior(triangles),
            Err(_) => grey_scene(Path::new(&name))?,
        };
        println!("{} surfaces", spec.surfaces.len());
        measure(&Scene::build(&spec, IndexChoice::Tree)?)?;
    }
    Ok(())
}

fn measure(scene: &Scene) -> Result<(), Failure> {
    let rays = side_by_side(scene, 128, RAYS)?;
    let mut ways = vec![
        TraceOrder::new(scene, "as walks trace them", &rays, Foresight::Nothing)?,
        TraceOrder::new(scene, "distance known", &rays, Foresight::Distance)?,
        TraceOrder::new(scene, "leaf known", &rays, Foresight::Leaf)?,
    ];
    for window in WINDOWS {
        let (sorted, seconds) = timed_sort(&rays, window);
        let sorting =
            TraceOrder { sorting: seconds, ..TraceOrder::new(scene, "", &sorted, Foresight::Nothing)? };
        ways.push(TraceOrder { name: format!("sorted, {window} at a time"), ..sorting });
    }
    time_in_turn(&mut ways);
    println!("{:<26} M rays/s       ×  × sorting |  nodes  leaves  stack | rays at a node", "rays");
    let plain = ways[0].seconds;
    for way in &mut ways {
        println!("{}", way.row(plain));
    }
    println!(
        "rays of one octant, of n as walks trace them: at a node together, part of the lanes that they fill"
    );
    let octants: Vec<usize> = rays.iter().map(octant).collect();
    let steps = ways[0].retracing.steps(Foresight::Nothing);
    for window in WINDOWS {
        let (rays, filled) = company(&steps, |ray| (ray / window, octants[ray]));
        println!("{window:<26} {rays:>8.2} {filled:>7.2}");
    }
    Ok(())
}

/// A way to trace the rays.
struct TraceOrder<'a> {
    name: String,
    retracing: Retracing<'a>,
    foresight: Foresight,
    /// The processor time of sorting the rays [s].
    sorting: f64,
    /// The least processor time of tracing them [s].
    seconds: f64,
}

impl<'a> TraceOrder<'a> {
    fn new(scene: &'a Scene, name: &str, rays: &[Ray], foresight: Foresight) -> Result<Self, Failure> {
        let retracing = Retracing::new(scene, rays).ok_or("there is no tree")?;
        Ok(TraceOrder { name: name.into(), retracing, foresight, sorting: 0.0, seconds: f64::INFINITY })
    }

    /// Rates over that of a time for all rays, steps of a ray, and rays of a packet at a node that one of them visits.
    fn row(&mut self, plain: f64) -> String {
        let TraceOrder { name, seconds, sorting, .. } = self;
        let rate = RAYS as f64 / *seconds / 1e6;
        let [ratio, sorted] = [*seconds, *seconds + *sorting].map(|seconds| plain / seconds);
        let steps = self.retracing.steps(self.foresight);
        let [nodes, leaves, stack] = [StepKind::Node, StepKind::Leaf, StepKind::Stack]
            .map(|kind| steps.iter().filter(|step| step.kind == kind).count() as f64 / RAYS as f64);
        let together = company(&steps, |ray| (ray / PACKET, 0)).0;
        format!(
            "{name:<26} {rate:>8.2} {ratio:>7.2} {sorted:>10.2} | {nodes:>6.2} {leaves:>7.2} {stack:>6.2} | {together:>6.2}"
        )
    }
}

/// Traces the rays in every way, in turn; all must find the same hits.
fn time_in_turn(ways: &mut [TraceOrder]) {
    for _ in 0..ROUNDS {
        let mut digests = Vec::new();
        for way in &mut *ways {
            let start = processor_seconds();
            digests.push(way.retracing.trace(way.foresight));
            way.seconds = way.seconds.min(processor_seconds() - start);
        }
        assert!(digests.iter().all(|&digest| digest == digests[0]), "some way finds other hits");
    }
}

/// The rays, each `window` of them sorted by the octant of their direction, then by where they start, along a curve of
/// Morton; and the least processor time of sorting [s].
fn timed_sort(rays: &[Ray], window: usize) -> (Vec<Ray>, f64) {
    let min = rays.iter().fold(DVec3::INFINITY, |min, ray| min.min(ray.origin));
    let max = rays.iter().fold(DVec3::NEG_INFINITY, |max, ray| max.max(ray.origin));
    let scale = 1023.0 / (max - min).max_element();
    let key = |ray: &Ray| {
        let cell = (ray.origin - min) * scale;
        let place = [cell.x, cell.y, cell.z].map(|x| spread(x as u64));
        (octant(ray) as u64) << 30 | place[0] << 2 | place[1] << 1 | place[2]
    };
    let (mut sorted, mut order) = (rays.to_vec(), Vec::with_capacity(window));
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        let start = processor_seconds();
        for (part, sorted) in rays.chunks(window).zip(sorted.chunks_mut(window)) {
            order.clear();
            order.extend(part.iter().map(key).zip(0_u32..));
            order.sort_unstable();
            sorted.iter_mut().zip(&order).for_each(|(ray, &(_, i))| *ray = part[i as usize]);
        }
        least = least.min(processor_seconds() - start);
    }
    (sorted, least)
}

/// Which of its components are negative.
fn octant(ray: &Ray) -> usize {
    ray.direction.to_array().iter().fold(0, |bits, &x| bits << 1 | usize::from(x < 0.0))
}

/// The lowest ten bits, two zeros between each.
fn spread(x: u64) -> u64 {
    const STEPS: [(u32, u64); 4] = [(16, 0x0300_00FF), (8, 0x0300_F00F), (4, 0x030C_30C3), (2, 0x0924_9249)];
    STEPS.iter().fold(x, |x, (shift, mask)| (x | x << shift) & mask)
}

/// The mean number of rays of a group at a node that one of them visits, and the part of vectors of sixteen that they fill.
fn company(steps: &[TreeStep], group: impl Fn(usize) -> (usize, usize)) -> (f64, f64) {
    let mut visits = HashMap::<_, usize>::new();
    for step in steps.iter().filter(|step| step.kind == StepKind::Node) {
        *visits.entry((group(step.ray), step.place)).or_default() += 1;
    }
    let all: usize = visits.values().sum();
    let vectors: usize = visits.values().map(|rays| rays.div_ceil(PACKET)).sum();
    (all as f64 / visits.len() as f64, all as f64 / (PACKET * vectors) as f64)
}
