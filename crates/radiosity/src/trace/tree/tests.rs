//! The wide tree finds the very hits that meeting every facet finds, on every instruction set.

use std::sync::Mutex;

use glam::{DMat3, DVec3, Vec3Swizzles};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

use super::layout::{CHILDREN, Item, LEVELS};
use super::{BinaryTree, Effort, Tree, WIDTH as LANES};
use crate::executor::in_turn;
use crate::random::rng::{Sequence, WalkRng};
use crate::simd::batch::WIDTH;
use crate::simd::isa::Isa;
use crate::trace::Index;
use crate::trace::flat::Flat;
use crate::trace::ray::{Hits, Ray, Rays};
use crate::{IndexChoice, Scene, SceneSpec, Shape, Sides, SurfaceSpec};

fn point(rng: &mut WalkRng) -> DVec3 {
    let ([x, y], [z, _]) = (rng.pair(), rng.pair());
    DVec3::new(x, y, z) * 2.0 - 1.0
}

/// Triangles and parallelograms of one and two sides: of all sizes, slivers, some twice, some coplanar.
fn crowd(count: usize, seed: u64) -> Vec<SurfaceSpec> {
    let mut rng = Sequence::new(seed).walk(0);
    let mut surfaces: Vec<SurfaceSpec> = vec![];
    while surfaces.len() < count {
        let size = 10f64.powf(-3.0 * rng.pair()[0]);
        let (a, u) = (point(&mut rng), size * point(&mut rng));
        let thin = if rng.bits().is_multiple_of(4) { 1e-5 } else { 1.0 };
        let v = 0.7 * u + size * thin * point(&mut rng);
        let shape = match rng.bits() % 3 {
            0 => Shape::Parallelogram { corner: a, corner_u: a + u, corner_v: a + v, cells: [1, 1] },
            1 => Shape::Triangle { a, b: a + u, c: a + v, rows: 1 },
            _ => {
                // On the floor, and over its neighbours: t is the same for all that a ray meets there.
                let floor = DVec3::new(a.x, a.y, -1.0);
                Shape::Triangle { a: floor, b: floor + 0.3 * DVec3::X, c: floor + 0.3 * DVec3::Y, rows: 1 }
            }
        };
        let surface = SurfaceSpec {
            name: None,
            shape,
            sides: if rng.bits().is_multiple_of(2) { Sides::Both } else { Sides::Front },
            reflectance: 0.5.into(),
            emittance: 1.0.into(),
            cell_emittance: vec![],
            transmittance: Default::default(),
        };
        let copies = 1 + usize::from(rng.bits().is_multiple_of(8));
        surfaces.extend(std::iter::repeat_n(surface, copies));
    }
    surfaces
}

fn mapped(surfaces: &[SurfaceSpec], map: impl Fn(DVec3) -> DVec3) -> SceneSpec {
    let surfaces = surfaces.iter().map(|s| SurfaceSpec { shape: s.shape.moved(&map), ..s.clone() }).collect();
    SceneSpec::new(surfaces)
}

/// Rays that leave surfaces, rays from outside, rays along axes, and rays aimed at corners and edges.
fn rays(scene: &Scene, count: usize) -> Vec<Ray> {
    let mut rng = Sequence::new(99).walk(1);
    let extent = scene.surfaces().iter().fold(0.0, |max: f64, s| max.max(s.point([0.0, 0.0]).length()));
    let ray = |i: usize| {
        let from = (rng.bits() % scene.surfaces().len() as u64) as u32;
        let surface = &scene.surfaces()[from as usize];
        let uv = surface.inside(rng.pair());
        let origin = surface.point(uv);
        let target = &scene.surfaces()[(rng.bits() % scene.surfaces().len() as u64) as usize];
        match i % 5 {
            0 => Ray { origin: 3.0 * extent * point(&mut rng), direction: point(&mut rng), from: Ray::FREE },
            1 => Ray { origin, direction: [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z][i / 5 % 3], from },
            2 => Ray { origin, direction: target.point([0.0, rng.pair()[0]]) - origin, from },
            3 => Ray { origin, direction: target.point([(i / 5 % 2) as f64, 0.0]) - origin, from },
            _ => Ray { origin, direction: surface.direction(crate::Side::Front, rng.bits()), from },
        }
    };
    (0..count).map(ray).filter(|ray| ray.direction.length() > 0.0).collect()
}

/// As [`super::Tree::closest_hits`] wants them; the flat index meets the same ones.
fn unit(ray: &Ray) -> Ray {
    Ray { direction: ray.direction.normalize(), ..*ray }
}

fn assert_agrees(name: &str, spec: &SceneSpec) {
    let scene = Scene::build(spec, IndexChoice::Tree).unwrap();
    let rays = rays(&scene, 3_000);
    let (surfaces, facets) = (scene.surfaces().to_vec(), scene.parts.facets.clone());
    let Index::Tree(mut tree) = (*scene.parts.index).clone() else { panic!("a tree was asked for") };
    let (mut scratch, mut hits) = (Box::default(), Hits::default());
    let leaves = tree.leaves(facets.len());
    let flat = |isa| Flat::new(isa, &surfaces, &facets, 0.0);
    let every = Index::Flat(flat(Isa::Portable));
    let brute = |ray: &Ray| every.closest_hit(&facets, ray);
    for isa in Isa::available() {
        tree.isa = isa;
        // Batches that are full, and others.
        for (batch_number, chunk) in rays.chunks(WIDTH - 5).enumerate() {
            let mut batch = Rays::default();
            chunk[..chunk.len() - batch_number % 3].iter().for_each(|ray| batch.push(&unit(ray)));
            tree.closest_hits(&facets, &batch, &mut scratch, &mut hits);
            for i in 0..batch.len {
                assert_eq!(hits.get(i), brute(&batch.get(i)), "{name}, {isa:?}: {:?}", batch.get(i));
            }
            for leaves in [None, Some(&leaves[..])] {
                let (known, mut again) = (tree.known(&batch, &hits, leaves), Hits::default());
                tree.closest_hits_knowing(&known, &facets, &batch, &mut scratch, &mut again);
                let all = |hits: &Hits| (0..batch.len).map(|i| hits.get(i)).collect::<Vec<_>>();
                assert_eq!(all(&again), all(&hits), "{name}, {isa:?}, with foresight");
            }
        }
        // Meeting every facet side by side is for walks: rays that leave surfaces.
        let flat = flat(isa);
        let walking: Vec<&Ray> = rays.iter().filter(|ray| ray.from != Ray::FREE).collect();
        for chunk in walking[..600].chunks(WIDTH - 7) {
            let mut batch = Rays::default();
            chunk.iter().for_each(|ray| batch.push(&unit(ray)));
            flat.closest_hits(&facets, &batch, &mut hits);
            for i in 0..batch.len {
                assert_eq!(hits.get(i), brute(&batch.get(i)), "{name}, flat, {isa:?}: {:?}", batch.get(i));
            }
        }
        for ray in &rays[..300] {
            assert_eq!(tree.closest_hit(&facets, ray), brute(ray), "{name}, {isa:?}: {ray:?}");
        }
    }
}

#[test]
fn a_tree_finds_what_meeting_every_facet_finds() {
    let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1);
    for count in [1, 2, 17, 300, 2_000] {
        let crowd = crowd(count, count as u64);
        assert_agrees(&format!("{count} at home"), &mapped(&crowd, |p| p));
        assert_agrees(&format!("{count} turned"), &mapped(&crowd, |p| turn * p));
        let far = DVec3::new(1e5, -0.7e5, 0.9e5);
        // Only what is large enough to keep an area so far away.
        let large: Vec<SurfaceSpec> = crowd.iter().filter(|s| s.shape.area() > 1e-4).cloned().collect();
        if !large.is_empty() {
            assert_agrees(&format!("{count} far away"), &mapped(&large, |p| turn * p + far));
        }
        assert_agrees(&format!("{count} tiny"), &mapped(&crowd, |p| 1e-30 * p));
        assert_agrees(&format!("{count} huge"), &mapped(&crowd, |p| 1e30 * p));
    }
}

/// A cube seen from within, with four walls whole and two, across from each other, of panels and pairs of triangles, one of
/// which is missing on either side, and a plate in the middle.
fn room_with_two_holes() -> Vec<SurfaceSpec> {
    let axes = DVec3::AXES;
    let wall = |i: usize| {
        let (u, v) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
        let corner = if i < 3 { DVec3::NEG_ONE } else { DVec3::NEG_ONE + 2.0 * axes[i % 3] };
        let (u, v) = if i < 3 { (u, v) } else { (v, u) };
        (corner, u, v)
    };
    let quad = |corner: DVec3, u: DVec3, v: DVec3| {
        let [corner_u, corner_v] = [corner + u, corner + v];
        Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] }
    };
    let mut shapes: Vec<Shape> =
        [1, 2, 4, 5].map(wall).map(|(corner, u, v)| quad(corner, 2.0 * u, 2.0 * v)).into();
    for (corner, u, v) in [0, 3].map(wall) {
        let [a, b, c] = [corner + u, corner + 2.0 * u, corner + u + v];
        shapes.push(Shape::Triangle { a, b, c, rows: 1 });
        shapes.push(Shape::Triangle { a: b + v, b: c, c: b, rows: 1 });
        shapes.extend([quad(corner + v, u, v), quad(c, u, v)]);
    }
    shapes.push(quad(DVec3::new(-0.5, -0.4, 0.1), 0.8 * DVec3::X, DVec3::new(0.1, 0.7, 0.3)));
    let alike = crowd(1, 1).swap_remove(0);
    shapes.into_iter().map(|shape| SurfaceSpec { shape, sides: Sides::Front, ..alike.clone() }).collect()
}

#[test]
fn the_plane_of_a_wall_is_the_answer_but_where_there_is_a_hole() {
    let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1);
    let room = room_with_two_holes();
    let walls = |spec: &SceneSpec| {
        let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
        let found = |isa| Flat::new(isa, scene.surfaces(), &scene.parts.facets, 0.0).walls();
        Isa::available().into_iter().filter(|&isa| isa != Isa::Portable).map(found).collect::<Vec<_>>()
    };
    for (name, spec) in [
        ("a room", mapped(&room, |p| p)),
        ("a room, turned", mapped(&room, |p| turn * p)),
        ("a room, oblique and far away", mapped(&room, |p| p + 0.3 * p.yzx() + 1e3)),
    ] {
        assert!(walls(&spec).iter().all(|&walls| walls == 4), "{name}: {:?}", walls(&spec));
        assert_agrees(name, &spec);
    }
    // Without its floor it is open.
    let open = mapped(&room[1..], |p| p);
    assert!(walls(&open).iter().all(|&walls| walls == 0));
    assert_agrees("an open room", &open);
}

/// Far from the origin of its coordinates a scene has more slack than f32 rounds away.
#[test]
fn a_start_within_the_slack_of_a_plane_is_on_it_side_by_side_too() {
    let quad = |u: DVec3, v: DVec3| SurfaceSpec {
        name: None,
        shape: Shape::Parallelogram { corner: DVec3::ZERO, corner_u: u, corner_v: v, cells: [1, 1] },
        sides: Sides::Front,
        reflectance: 0.5.into(),
        emittance: 1.0.into(),
        cell_emittance: vec![],
        transmittance: Default::default(),
    };
    let spec = mapped(&[quad(DVec3::X, DVec3::Y), quad(DVec3::Y, DVec3::Z)], |p| p + DVec3::splat(1e9));
    let scene = Scene::build(&spec, IndexChoice::Flat).unwrap();
    let wall = &scene.surfaces()[1];
    let behind = wall.point([0.5, 0.0]) - 0.5 * scene.parts.facets.slack() * wall.normal();
    let ray = Ray { origin: behind, direction: DVec3::new(-0.6, 0.0, 0.8), from: 0 };
    for isa in Isa::available() {
        let (mut batch, mut hits) = (Rays::default(), Hits::default());
        batch.push(&ray);
        Flat::new(isa, scene.surfaces(), &scene.parts.facets, 0.0).closest_hits(
            &scene.parts.facets,
            &batch,
            &mut hits,
        );
        assert_eq!(hits.get(0), scene.closest_hit(&ray), "{isa:?}");
        assert_eq!(hits.get(0).map(|hit| (hit.surface, hit.t)), Some((1, 0.0)));
    }
}

/// A lamp may hang anywhere: f32 rounds coordinates far out by more than the facets are wide. Rays from there meet, side by side, what one alone
/// meets in full, whether or not births are known to be so far out.
#[test]
fn rays_from_far_away_are_met_in_full() {
    let quad = |u: DVec3, v: DVec3| SurfaceSpec::new(Shape::parallelogram(DVec3::ZERO, u, v, [1, 1]), 0.5);
    let quads = [quad(DVec3::X, DVec3::Y), quad(DVec3::Y, 0.3 * DVec3::Z)];
    let mut spec = SceneSpec::new(quads.into());
    spec.surfaces[0].emittance = 1.0.into();
    let scene = Scene::build_for(&spec, IndexChoice::Flat, Isa::Portable).unwrap();
    let mut rng = Sequence::new(7).walk(0);
    for distance in [3.0, 1e3, 1e5, 1e7] {
        let (mut batch, mut alone) = (Rays::default(), Vec::new());
        for _ in 0..WIDTH {
            let [[x, y], [z, turn]] = [rng.pair(), rng.pair()];
            let place = DVec3::new(1.2 * x - 0.6, 1.2 * y - 0.6, 0.4 * z - 0.15);
            let away = DVec3::new(0.4 * turn, 0.7, 0.6).normalize();
            alone.push(unit(&Ray { origin: place + distance * away, direction: -away, from: Ray::FREE }));
            batch.push(alone.last().unwrap());
        }
        let met: Vec<_> = alone.iter().map(|ray| scene.closest_hit(ray)).collect();
        assert!(met.iter().flatten().count() > WIDTH / 4);
        for (isa, births) in Isa::available().into_iter().flat_map(|isa| [(isa, 0.0), (isa, distance)]) {
            let mut hits = Hits::default();
            Flat::new(isa, scene.surfaces(), &scene.parts.facets, births).closest_hits(
                &scene.parts.facets,
                &batch,
                &mut hits,
            );
            let found: Vec<_> = (0..WIDTH).map(|lane| hits.get(lane)).collect();
            assert_eq!(found, met, "{isa:?}, {distance} m");
        }
    }
}

/// Deep stacks and more candidates than a ray holds: hundreds of the same facet, and of nested boxes' worth.
#[test]
fn a_crowd_in_one_place_overflows_nothing() {
    let one = crowd(1, 5).swap_remove(0);
    let same: Vec<SurfaceSpec> = std::iter::repeat_n(one, 700).collect();
    assert_agrees("the same facet", &mapped(&same, |p| p));
    let stars: Vec<SurfaceSpec> = crowd(4_000, 8)
        .into_iter()
        .enumerate()
        .map(|(i, surface)| {
            let a = DVec3::splat(1e-6 * i as f64);
            let b = DVec3::new((i as f64).sin(), (3.0 * i as f64).cos(), (7.0 * i as f64).sin());
            let shape = Shape::Triangle { a, b, c: DVec3::new(b.y, b.z, b.x) * 0.9, rows: 1 };
            SurfaceSpec { shape, ..surface }
        })
        .filter(|s| s.shape.area() > 1e-6)
        .collect();
    assert_agrees("through one point", &mapped(&stars, |p| p));
}

/// The binary tree in which each node has one surface and all that come after it.
fn chain(binary: &BinaryTree) -> BinaryTree {
    let boxes = &binary.boxes;
    let mut after: Vec<Aabb> = boxes
        .iter()
        .rev()
        .scan(Aabb::empty(), |all, one| {
            *all = all.union(one);
            Some(*all)
        })
        .collect();
    after.reverse();
    let leaf =
        |i: usize| Bvh2Node { aabb: boxes[i], prim_count: 1, first_index: i as u32, ..Default::default() };
    let inner = |i: usize| Bvh2Node { aabb: after[i], first_index: 2 * i as u32 + 1, ..Default::default() };
    let last = boxes.len() - 1;
    let mut nodes = vec![inner(0)];
    for i in 0..last {
        nodes.extend([leaf(i), if i + 1 == last { leaf(last) } else { inner(i + 1) }]);
    }
    let primitive_indices = (0..boxes.len() as u32).collect();
    BinaryTree {
        boxes: boxes.clone(),
        tree: Bvh2 { nodes, primitive_indices, ..Default::default() },
        ..*binary
    }
}

/// Nodes on the longest way down.
fn depth(tree: &Tree, node: usize) -> usize {
    let slots = (0..LANES).filter(|&slot| tree.lines[node].0[slot] < f32::MAX);
    let items = slots.map(|slot| Item(tree.lines[node + CHILDREN].0[slot].to_bits()));
    let below = items.filter(|item| item.kind() == Item::NODE).map(|item| depth(tree, item.line()));
    1 + below.max().unwrap_or(0)
}

#[test]
fn a_tree_is_no_deeper_than_a_stack_however_its_boxes_nest() {
    for count in [300, 3_000] {
        let scene = Scene::build(&mapped(&crowd(count, 3), |p| p), IndexChoice::Flat).unwrap();
        let facets = &scene.parts.facets;
        let binary = chain(&BinaryTree::new(scene.surfaces(), facets.slack(), Effort::Full, &in_turn));
        let every = Index::Flat(Flat::new(Isa::Portable, scene.surfaces(), facets, 0.0));
        for isa in Isa::available() {
            let tree = Tree::new(&binary, facets, isa);
            assert_eq!(depth(&tree, 0), LEVELS, "{count} surfaces");
            for ray in rays(&scene, 500) {
                assert_eq!(
                    tree.closest_hit(facets, &ray),
                    every.closest_hit(facets, &ray),
                    "{isa:?}: {ray:?}"
                );
            }
        }
    }
}

/// Enough surfaces for several jobs: a search by the tree finds what a look at every pair finds.
#[test]
fn the_tree_finds_every_two_boxes_that_meet() {
    let surfaces: Vec<SurfaceSpec> = crowd(9_000, 5)
        .into_iter()
        .map(|mut surface| {
            // Far apart, so that most boxes do not meet.
            let (corner, u, v) = surface.shape.edges();
            surface.shape = Shape::parallelogram(20.0 * corner, u, v, [1, 1]);
            surface
        })
        .collect();
    let scene = Scene::build(&SceneSpec::new(surfaces), IndexChoice::Auto).unwrap();
    let slack = scene.parts.facets.slack();
    let sorted = |mut pairs: Vec<[u32; 2]>| {
        pairs.sort_unstable();
        pairs
    };
    for effort in [Effort::Least, Effort::Full] {
        let binary = BinaryTree::new(scene.surfaces(), slack, effort, &in_turn);
        let boxes = &binary.boxes;
        let all = (0..boxes.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
        let meeting = all.filter(|&[a, b]| boxes[a].intersect_aabb(&boxes[b]));
        let meeting = sorted(meeting.map(|pair| pair.map(|i| i as u32)).collect());
        assert!(meeting.len() > 1000);
        let found = Mutex::new(Vec::new());
        binary.each_pair(&in_turn, |a, b| found.lock().unwrap().push([a, b]));
        assert_eq!(sorted(found.into_inner().unwrap()), meeting);
    }
}
