//! Tests of walks against a second tracer: brute force in f64 with its own random numbers, directions and triangle
//! test. It shares only the definition of a scene with the kernel. If surfaces coincide, it moves them apart by gaps of
//! 10⁻⁷ m.

use crate::common::{collision, experiment, quad, surface, walk};
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, Estimates, Experiment, IndexChoice, Method, Scene, SceneSpec, Shape, Sides,
    Space, SurfaceSpec, Walks, methods::Solve,
};
use stats::{normal_quantile, student_quantile};

/// Splitmix64 (Steele, Lea & Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, number: usize) -> usize {
        (self.unit() * number as f64) as usize
    }
}

/// A triangle, or the half of a parallelogram.
struct Triangle {
    a: DVec3,
    ab: DVec3,
    ac: DVec3,
    normal: DVec3,
    /// The number of the surface that the triangle is, or is half of.
    surface: usize,
}

impl Triangle {
    /// The t of the hit and whether the front was met: Möller & Trumbore, *Fast, minimum storage ray–triangle
    /// intersection* (1997).
    fn meet(&self, origin: DVec3, direction: DVec3) -> Option<(f64, bool)> {
        let p = direction.cross(self.ac);
        let determinant = self.ab.dot(p);
        let from_a = origin - self.a;
        let u = from_a.dot(p) / determinant;
        let q = from_a.cross(self.ab);
        let v = direction.dot(q) / determinant;
        let t = self.ac.dot(q) / determinant;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        (inside && t > 1e-10).then_some((t, determinant > 0.0))
    }
}

/// A tracer of surfaces of one patch each, all grey and of one reflectance.
struct Tracer<'a> {
    surfaces: &'a [SurfaceSpec],
    triangles: Vec<Triangle>,
    /// The cumulative power of each surface's front and back [W].
    power: Vec<f64>,
}

impl<'a> Tracer<'a> {
    /// A tracer of a scene; `lifts` are the distances by which surfaces are moved along their normals [m].
    fn new(spec: &'a SceneSpec, lifts: &[f64]) -> Self {
        let mut triangles = Vec::new();
        for (number, (surface, lift)) in spec.surfaces.iter().zip(lifts).enumerate() {
            let (corner, u, v) = surface.shape.edges();
            let normal = u.cross(v).normalize();
            let a = corner + normal * *lift;
            let mut push = |a, ab, ac| triangles.push(Triangle { a, ab, ac, normal, surface: number });
            push(a, u, v);
            if matches!(surface.shape, Shape::Parallelogram { .. }) {
                push(a + u + v, -u, -v);
            }
        }
        let power = spec.surfaces.iter().scan(0.0, |sum, surface| {
            *sum += surface.shape.area() * surface.emittance[0] * surface.sides.count();
            Some(*sum)
        });
        Tracer { surfaces: &spec.surfaces, power: power.collect(), triangles }
    }

    /// Adds the faces that a continuous walk meets: surfaces, and whether their fronts.
    fn walk(&self, random: &mut Random, hits: &mut Vec<(usize, bool)>) {
        hits.clear();
        let lot = random.unit() * self.power.last().unwrap();
        let source = self.power.partition_point(|&sum| sum <= lot);
        let halves: Vec<&Triangle> = self.triangles.iter().filter(|t| t.surface == source).collect();
        let triangle = halves[(random.unit() * halves.len() as f64) as usize];
        let (mut r, mut s) = (random.unit(), random.unit());
        if r + s > 1.0 {
            (r, s) = (1.0 - r, 1.0 - s);
        }
        let mut origin = triangle.a + triangle.ab * r + triangle.ac * s;
        let back = self.surfaces[source].sides == Sides::Both && random.unit() < 0.5;
        let mut normal = if back { -triangle.normal } else { triangle.normal };
        loop {
            let direction = cosine(normal, random);
            let met = self.triangles.iter().filter_map(|t| Some((t.meet(origin, direction)?, t)));
            let Some(((t, front), triangle)) = met.min_by(|a, b| a.0.0.total_cmp(&b.0.0)) else { return };
            let surface = &self.surfaces[triangle.surface];
            if !front && surface.sides == Sides::Front {
                return;
            }
            hits.push((triangle.surface, front));
            if random.unit() >= surface.reflectance[0] {
                return;
            }
            origin += direction * t;
            normal = if front { triangle.normal } else { -triangle.normal };
        }
    }
}

/// A cosine-distributed direction: a point of the sphere that touches the plane (Sh91).
fn cosine(normal: DVec3, random: &mut Random) -> DVec3 {
    let (z, turn) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
    let r = (1.0 - z * z).sqrt();
    let on_sphere = DVec3::new(r * turn.cos(), r * turn.sin(), z);
    (normal * (1.0 + 1e-12) + on_sphere).normalize()
}

/// H·A/Φ_T of the fronts and backs of all surfaces by `walks` walks, each with its standard error.
fn traced(tracer: &Tracer, walks: u64, seed: u64) -> Vec<[[f64; 2]; 2]> {
    let mut sums = vec![[[0.0_f64; 2]; 2]; tracer.surfaces.len()];
    let (mut random, mut hits) = (Random(seed), Vec::new());
    for _ in 0..walks {
        tracer.walk(&mut random, &mut hits);
        hits.sort_unstable();
        for visits in hits.chunk_by(|a, b| a == b) {
            let (surface, front) = visits[0];
            let [sum, squares] = &mut sums[surface][usize::from(!front)];
            *sum += visits.len() as f64;
            *squares += (visits.len() as f64).powi(2);
        }
    }
    let n = walks as f64;
    let estimate = |[sum, squares]: [f64; 2]| [sum / n, (squares - sum * sum / n).sqrt() / n];
    sums.into_iter().map(|faces| faces.map(estimate)).collect()
}

/// The 200 faces that the kernel has found brightest: mean squared z of the differences, 1 in the mean with a standard
/// error of √(2/200) = 0.1 were they independent (visits on neighbours correlate a little), and how many lie within
/// 1.96 standard errors. Six of the former: false-alarm rate 4·10⁻⁵ each, once and for all with these seeds.
#[track_caller]
fn assert_alike(name: &str, spec: &SceneSpec, lifts: &[f64], walks: u64) {
    let tracer = Tracer::new(spec, lifts);
    let found = traced(&tracer, walks, 11);
    let experiment = experiment(spec, IndexChoice::Auto, collision(Space::Continuous));
    let tally = walk(&experiment, 12, 0..walks);
    let power = experiment.scene().total_power(0);
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let mut faces: Vec<(u128, f64)> = estimates
        .known()
        .filter_map(|(_, face, known)| {
            let side = usize::from(face.side == radiosity::Side::Back);
            let [truth, error] = found[face.surface as usize][side];
            let scale = face.area / power;
            let (h, h_error) = (known[0].irradiance?, known[0].irradiance_error?);
            Some((known[0].hits, (h * scale - truth) / (h_error * scale).hypot(error)))
        })
        .collect();
    faces.sort_by_key(|face| std::cmp::Reverse(face.0));
    let z: Vec<f64> = faces.iter().take(200).map(|&(_, z)| z).collect();
    let squared = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    let within = z.iter().filter(|z| z.abs() < 1.96).count();
    println!("{name}: {} faces, mean squared z {squared:.3}, {within} within 1.96", z.len());
    assert!(z.len() == 200 && faces[199].0 >= 10, "{name}: {:?}", faces[199]);
    assert!((squared - 1.0).abs() < 0.45, "{name}: mean squared z {squared}");
    assert!(within >= 176, "{name}: {within} of 200");
}

#[test]
fn a_furnished_room_is_as_a_second_tracer_finds_it() {
    let room = scenes::interior(3_000);
    let lifts = vec![0.0; room.surfaces.len()];
    assert_alike("interior", &grey(room), &lifts, 12_000);
}

/// A box of 64 × 6 tiles, each written twice, back to back.
#[test]
fn a_box_of_doubled_tiles_is_as_a_second_tracer_finds_it() {
    let mut spec = SceneSpec::new(vec![]);
    let mut lifts = Vec::new();
    for wall in crate::common::box_walls(DVec3::new(2.0, 1.0, 1.5), [1, 1]) {
        let (corner, u, v) = wall.edges();
        for i in 0..64 {
            let (du, dv) = (u / 8.0, v / 8.0);
            let c = corner + du * f64::from(i / 8) + dv * f64::from(i % 8);
            for (shape, lift) in [(quad(c, du, dv, [1, 1]), 0.0), (quad(c, dv, du, [1, 1]), 1e-7)] {
                spec.surfaces.push(surface(shape, 0.7));
                lifts.push(lift);
            }
        }
    }
    spec.surfaces[2 * 40].emittance = 3.0.into();
    spec.surfaces[2 * 300].emittance = 5.0.into();
    assert_alike("doubled tiles", &spec, &lifts, 40_000);
}

/// Triangles of all sizes in random poses, slivers among them, in a box. Half of them are written twice: the second,
/// two-sided as the first, lies below it.
#[test]
fn a_soup_of_triangles_is_as_a_second_tracer_finds_it() {
    let mut random = Random(5);
    let mut spec = SceneSpec::new(vec![]);
    let mut lifts = Vec::new();
    for wall in crate::common::box_walls(DVec3::ONE, [1, 1]) {
        spec.surfaces.push(surface(wall, 0.8));
        lifts.push(0.0);
    }
    spec.surfaces[1].emittance = 1.0.into();
    for _ in 0..700 {
        let mut vector = |size: f64| DVec3::from_array([0; 3].map(|_| size * (random.unit() - 0.5)));
        let a = DVec3::splat(0.5) + vector(0.9);
        let (ab, ac) = (vector(0.2), vector(0.2));
        let size = random.unit().powi(3);
        let sliver = if random.unit() < 0.2 { 1e-3 } else { 1.0 };
        let shape = Shape::Triangle { a, b: a + ab * size, c: a + ac * size * sliver, rows: 1 };
        let triangle = SurfaceSpec { sides: Sides::Both, ..surface(shape, 0.5) };
        spec.surfaces.push(triangle.clone());
        lifts.push(0.0);
        if random.unit() < 0.5 {
            spec.surfaces.push(triangle);
            lifts.push(-1e-7);
        }
    }
    assert_alike("soup", &spec, &lifts, 50_000);
}

/// A closed box with twelve things in it, all drawn at random: walls of one metre or a thousand, things that touch a wall or each
/// other along an edge, twins in one plane, slivers of 1 : 1000, panels nearly as large as the room, lamps among them.
fn cluttered(random: &mut Random) -> SceneSpec {
    let size = if random.unit() < 0.5 { 1.0 } else { 1000.0 };
    let walls = crate::common::box_walls(DVec3::splat(size), [2, 2]);
    let mut spec =
        SceneSpec::new(walls.into_iter().map(|wall| surface(wall, 0.3 + 0.6 * random.unit())).collect());
    spec.surfaces[random.below(6)].emittance = 1.0.into();
    for number in 0..12 {
        let mut vector =
            |length: f64| DVec3::from_array([0; 3].map(|_| length * size * (random.unit() - 0.5)));
        let corner = DVec3::splat(0.5 * size) + vector(0.5);
        let (u, v) = (vector(0.3), vector(0.3));
        let shape = match (random.below(5), spec.surfaces.last().map(|last| last.shape.clone())) {
            (0, Some(Shape::Parallelogram { corner, corner_u, .. })) if number > 0 => {
                // Its first edge is that of the one before.
                let middle = DVec3::splat(0.5 * size);
                quad(corner, corner_u - corner, (middle - 0.5 * (corner + corner_u)) * 0.4 + v * 0.02, [1, 1])
            }
            (1, Some(twin)) if number > 0 => twin,
            (2, _) => Shape::Triangle { a: corner, b: corner + u, c: corner + u * 0.7 + v * 1e-3, rows: 1 },
            (3, _) => {
                let [x, y] = [0.98, 0.9].map(|part| part * size);
                quad(
                    DVec3::new(0.01 * size, 0.05 * size, (0.1 + 0.8 * random.unit()) * size),
                    DVec3::X * x,
                    DVec3::Y * y,
                    [1, 2],
                )
            }
            // It stands on the floor.
            _ => quad(DVec3 { z: 0.0, ..corner }, DVec3 { z: 0.0, ..u }, DVec3::Z * 0.4 * size, [1, 1]),
        };
        let mut thing = SurfaceSpec { sides: Sides::Both, ..surface(shape, 0.9 * random.unit()) };
        if random.unit() < 0.2 {
            thing.emittance = random.unit().into();
        }
        spec.surfaces.push(thing);
    }
    spec
}

/// In each of 24 scenes drawn at random shooting walks agree with gathering walks, and with chains, which share neither births nor
/// scores: the largest of all differences stays below the limit of a false alarm in 10,000 (Šidák; Student's t of the 31 degrees of
/// freedom of chains), and nothing is lost. Faces of 100 scores and more count.
#[test]
fn methods_agree_in_scenes_drawn_at_random() {
    let mut compared = 0;
    for seed in 0..24 {
        let spec = cluttered(&mut Random(seed));
        let faces =
            experiment(&spec, IndexChoice::Auto, collision(Space::Discrete)).scene().faces().len() as u64;
        let gathering = Walks { direction: Direction::Gathering(Birth::Area), ..collision(Space::Discrete) };
        let chains = Chains { rays: 64 * faces, solve: Solve::Links, linear: false, final_gather: vec![] };
        let methods: [(Method, u64); 3] =
            [(collision(Space::Discrete).into(), 40_000), (gathering.into(), 80_000), (chains.into(), 32)];
        let mut found = Vec::new();
        for (number, (method, walks)) in methods.into_iter().enumerate() {
            let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
            let experiment = Experiment::new(scene, method).unwrap();
            let tally = walk(&experiment, 7 + number as u64, 0..walks);
            let counts = tally.counts;
            assert_eq!((counts.escaped, counts.truncated), (0, 0), "seed {seed}");
            let estimates = Estimates::new(&experiment, &tally, 0.95);
            let radiosities: Vec<_> =
                estimates.iter().map(|(_, _, known)| known.map(|known| known[0])).collect();
            found.push(radiosities);
        }
        let enough = |number: usize, i: usize| {
            found[number][i].filter(|estimate| {
                estimate.effective_scores >= 100.0 || (number == 2 && estimate.hits >= 3200)
            })
        };
        for other in [1, 2] {
            let z = (0..found[0].len()).filter_map(|i| {
                let (a, b) = (enough(0, i)?, enough(other, i)?);
                let error = a.std_error?.hypot(b.std_error?);
                (error > 0.0).then(|| (i, (a.radiosity - b.radiosity) / error))
            });
            let z: Vec<(usize, f64)> = z.collect();
            let p = 1.0 - 0.5e-4 / (24.0 * 2.0 * z.len().max(1) as f64);
            let limit = if other == 2 { student_quantile(p, 31) } else { normal_quantile(p) };
            for (i, z) in &z {
                assert!(z.abs() < limit, "seed {seed}: face {i} of method {other} is off by {z} of {limit}");
            }
            compared += z.len();
        }
    }
    println!("{compared} faces were compared");
    assert!(compared > 1000, "{compared}");
}

/// The scene of the first channel, with each surface as one patch.
fn grey(spec: SceneSpec) -> SceneSpec {
    let mut grey = spec.channel(0);
    for surface in &mut grey.surfaces {
        assert!(surface.cell_emittance.is_empty());
        match &mut surface.shape {
            Shape::Parallelogram { cells, .. } => *cells = [1, 1],
            Shape::Triangle { rows, .. } => *rows = 1,
            Shape::Divided { .. } => panic!("scenes are written with grids"),
        }
    }
    grey
}
