//! Surfaces that coincide: layers, against the same scenes without twins, against thin gaps, against rays that only
//! `radiosity` traces.

use crate::common::{Numbers, assert_near};
use crate::rays::assert_rays_agree;
use crate::shapes::{grey, painted, quad, room, turned};
use exact::{BoxScene, Exact, NotABox, SystemAccuracy};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneSpec, Shape, Side, Sides, SurfaceSpec};

/// Which way the twins of a cube's walls lie.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Twins {
    None,
    SameWay,
    BackToBack,
    /// The twins lie this far outside [m].
    Outside(f64),
}

/// A cube of R = 0.8, its ceiling of E = 1 W/m²; every other wall has a twin.
fn cube(twins: Twins, sides: Sides) -> SceneSpec {
    let walls = room([1.0; 3], 1);
    let mut surfaces: Vec<SurfaceSpec> = walls.iter().cloned().map(|wall| grey(wall, 0.8, 0.0)).collect();
    surfaces[CEILING].emittance = 1.0.into();
    for wall in walls[..CEILING].iter().filter(|_| twins != Twins::None) {
        let (corner, u, v) = wall.edges();
        let out = match twins {
            Twins::Outside(gap) => -gap * u.cross(v).normalize(),
            _ => DVec3::ZERO,
        };
        let (u, v) = if twins == Twins::BackToBack { (v, u) } else { (u, v) };
        surfaces.push(grey(quad((corner + out).into(), u.into(), v.into(), [1, 1]), 0.8, 0.0));
    }
    surfaces.iter_mut().for_each(|surface| surface.sides = sides);
    SceneSpec::new(surfaces)
}

const CEILING: usize = 5;

/// A surface reported as the mean of its faces would have half of the lamp's 0.690 where it is two-sided.
#[test]
fn a_doubled_cube_has_the_light_of_the_plain_one() {
    for sides in [Sides::Front, Sides::Both] {
        let plain = Exact::of_scene(&cube(Twins::None, sides)).unwrap();
        let lamp = plain.solution().irradiance[CEILING];
        assert_near(lamp, 0.689_655, 1e-6);
        // Twins nearer than lengths that count, farther than the tracer's slack.
        let all = [Twins::SameWay, Twins::BackToBack, Twins::Outside(1e-12), Twins::Outside(1e-11)];
        for twins in all {
            for spec in [cube(twins, sides), turned(&cube(twins, sides))] {
                assert_covers(&Exact::of_scene(&spec).unwrap(), &plain);
            }
        }
        // Through gaps of this width some light would leave, were there any in them.
        assert_covers(&Exact::of_scene(&cube(Twins::Outside(1e-4), sides)).unwrap(), &plain);
    }
}

/// A twin has no light; everything else is as in the plain cube.
#[track_caller]
fn assert_covers(doubled: &Exact, plain: &Exact) {
    assert_eq!(SystemAccuracy::of(doubled).undetermined(doubled), 0, "it is known what is dark");
    let (doubled, plain) = (doubled.solution(), plain.solution());
    for (irradiance, expected) in doubled.irradiance.iter().zip(&plain.irradiance[..6]) {
        assert_near(*irradiance, *expected, 1e-10);
    }
    assert_eq!(doubled.irradiance[6..11], [0.0; 5]);
    assert_near(doubled.incoming.iter().sum(), plain.incoming.iter().sum(), 1e-9);
}

/// The closed form of boxes is for walls without layers.
#[test]
fn doubled_boxes_are_solved_pair_by_pair() {
    let refusal = |twins| BoxScene::recognise(&cube(twins, Sides::Front)).unwrap_err();
    assert_eq!(refusal(Twins::SameWay), NotABox::Overlap { first: 0, second: 6 });
    assert_eq!(refusal(Twins::BackToBack), NotABox::FacesOut { surface: 6 });
    assert!(matches!(refusal(Twins::Outside(1e-11)), NotABox::Overlap { .. }));
    BoxScene::recognise(&cube(Twins::None, Sides::Front)).unwrap();
}

/// A rectangle on a wall of a box, in steps of its grid.
#[derive(Clone, Copy)]
struct Tile {
    /// The wall, as [`room`] numbers them.
    wall: usize,
    lo: [u32; 2],
    size: [u32; 2],
    cells: [u32; 2],
    /// Whether its front looks into the box.
    inwards: bool,
    sides: Sides,
}

/// A box whose walls, tiles 0 … 5, are covered inside and outside by further tiles; all corners, of cells too, are on a
/// grid.
struct TiledBox {
    size: [u32; 3],
    /// Steps of the grid per metre [1/m].
    steps: u32,
    tiles: Vec<Tile>,
}

impl TiledBox {
    /// With `aligned` cells, all of 1 m², each is covered as a whole or not at all.
    fn random(numbers: &mut Numbers, aligned: bool) -> Self {
        let size = [(); 3].map(|()| 1 + numbers.below(3));
        let steps = if aligned { 1 } else { 4 };
        let mut scene = TiledBox { size, steps, tiles: vec![] };
        for wall in 0..6 {
            let size = scene.wall_size(wall).map(|n| n * steps);
            let cells = scene.wall_size(wall);
            let sides = if numbers.below(2) == 0 || wall == CEILING { Sides::Front } else { Sides::Both };
            let inwards = sides == Sides::Front || numbers.below(2) == 0;
            scene.tiles.push(Tile { wall, lo: [0; 2], size, cells, inwards, sides });
        }
        for _ in 0..10 {
            let wall = numbers.below(CEILING as u32) as usize;
            let whole = scene.wall_size(wall).map(|n| n * steps);
            // Sizes of two steps and more, so that two cells along end on the grid.
            let even = |n: u32, numbers: &mut Numbers| 2 * (1 + numbers.below(n / 2));
            let size = whole.map(|n| if aligned { 1 + numbers.below(n) } else { even(n, numbers) });
            let lo = [0, 1].map(|k| numbers.below(whole[k] - size[k] + 1));
            let cells = if aligned { size } else { [(); 2].map(|()| 1 + numbers.below(2)) };
            let sides = if numbers.below(2) == 0 { Sides::Front } else { Sides::Both };
            scene.tiles.push(Tile { wall, lo, size, cells, inwards: numbers.below(2) == 0, sides });
        }
        scene
    }

    /// The edges of a wall that span it, u × v looking inwards, and its corner.
    fn frame(&self, wall: usize) -> [DVec3; 3] {
        let (corner, u, v) = room(self.size.map(f64::from), 1)[wall].edges();
        [corner, u, v]
    }

    fn wall_size(&self, wall: usize) -> [u32; 2] {
        let [_, u, v] = self.frame(wall);
        [u, v].map(|edge| edge.length().round() as u32)
    }

    /// The scene, its ceiling a lamp of E = 1 W/m². Reflectances go by wall.
    fn spec(&self) -> SceneSpec {
        let surface = |tile: &Tile| {
            let [corner, u, v] = self.frame(tile.wall);
            let step = 1.0 / f64::from(self.steps);
            let [u, v] = [u.normalize() * step, v.normalize() * step];
            let corner = corner + u * f64::from(tile.lo[0]) + v * f64::from(tile.lo[1]);
            let (mut edges, mut cells) =
                ([u * f64::from(tile.size[0]), v * f64::from(tile.size[1])], tile.cells);
            if !tile.inwards {
                edges.reverse();
                cells.reverse();
            }
            let [e_u, e_v] = edges.map(Into::into);
            let shape = quad(corner.into(), e_u, e_v, cells);
            let reflectance = [0.5, 0.7, 0.3, 0.8, 0.6, 0.4][tile.wall];
            SurfaceSpec { sides: tile.sides, ..grey(shape, reflectance, 0.0) }
        };
        let mut surfaces: Vec<SurfaceSpec> = self.tiles.iter().map(surface).collect();
        surfaces[CEILING].emittance = 1.0.into();
        SceneSpec::new(surfaces)
    }

    /// The tiles at a place of a wall, seen from inside the box: fronts of one-sided ones outermost on either side, the
    /// least number first, then two-sided ones from where the front of the wall, the least of them, looks.
    fn layers(&self, wall: usize, place: [u32; 2]) -> Vec<usize> {
        let at = |tile: &Tile| {
            let within = |k: usize| (tile.lo[k]..tile.lo[k] + tile.size[k]).contains(&place[k]);
            tile.wall == wall && within(0) && within(1)
        };
        let mut here: Vec<usize> = (0..self.tiles.len()).filter(|&n| at(&self.tiles[n])).collect();
        here.sort_by_key(|&n| {
            let (tile, number) = (self.tiles[n], n as i64);
            match (tile.sides, tile.inwards) {
                (Sides::Front, true) => (0, number),
                (Sides::Both, _) if self.tiles[wall].inwards => (1, number),
                (Sides::Both, _) => (1, -number),
                (Sides::Front, false) => (2, -number),
            }
        });
        here
    }

    /// The number of the face of a tile at a place that looks into the box or out of it; `None` if that side is not active.
    fn face(&self, scene: &Scene, tile: usize, place: [u32; 2], inwards: bool) -> Option<usize> {
        let Tile { lo, size, mut cells, inwards: front, .. } = self.tiles[tile];
        let side = if inwards == front { Side::Front } else { Side::Back };
        let mut cell = [0, 1].map(|k| (place[k] - lo[k]) * cells[k] / size[k]);
        if !front {
            cell.reverse();
            cells.reverse();
        }
        let first = scene.faces().first_piece_on(tile as u32, side)?;
        Some((first + cell[0] * cells[1] + cell[1]) as usize)
    }

    /// Every place of the grid on every wall.
    fn places(&self) -> Vec<(usize, [u32; 2])> {
        let of_wall = |wall: usize| {
            let [nu, nv] = self.wall_size(wall).map(|n| n * self.steps);
            (0..nu).flat_map(move |i| (0..nv).map(move |j| (wall, [i, j])))
        };
        (0..6).flat_map(of_wall).collect()
    }
}

/// Where the light goes that leaves the faces of a tiled box, place by place.
struct Fates {
    /// Areas through which two faces exchange [m²], both ways.
    between: Vec<Vec<f64>>,
    /// What looks into the box [m²].
    open: Vec<f64>,
    /// What looks at a back [m²], or into the empty space around the box.
    lost: Vec<f64>,
}

impl Fates {
    fn of(tiled: &TiledBox, scene: &Scene) -> Self {
        let n = scene.faces().len();
        let mut fates = Fates { between: vec![vec![0.0; n]; n], open: vec![0.0; n], lost: vec![0.0; n] };
        let area = f64::from(tiled.steps).powi(-2);
        for (wall, place) in tiled.places() {
            let layers = tiled.layers(wall, place);
            for (k, &tile) in layers.iter().enumerate() {
                for inwards in [true, false] {
                    let Some(face) = tiled.face(scene, tile, place, inwards) else { continue };
                    let next = if inwards { k.checked_sub(1) } else { Some(k + 1) };
                    match next
                        .map(|k| layers.get(k).and_then(|&tile| tiled.face(scene, tile, place, !inwards)))
                    {
                        None => fates.open[face] += area,
                        Some(None) => fates.lost[face] += area,
                        Some(Some(other)) => fates.between[face][other] += area,
                    }
                }
            }
        }
        fates
    }
}

/// Overlapping, nested, touching and equal tiles, cells cut anyhow: F between layers, and for every face A (Σ_j F_ij) +
/// lost = A.
#[test]
fn layers_exchange_through_what_is_between_them() {
    let mut numbers = Numbers(41);
    for round in 0..12 {
        let tiled = TiledBox::random(&mut numbers, round % 3 == 0);
        let mut spec = tiled.spec();
        if round % 2 == 1 {
            spec = turned(&spec);
        }
        let exact = Exact::of_scene(&spec).unwrap();
        let scene = Scene::build(&spec, IndexChoice::Flat).unwrap();
        let fates = Fates::of(&tiled, &scene);
        let (areas, errors) = (exact.areas(), exact.exchange().row_errors());
        for (i, sum) in exact.exchange().row_sums().into_iter().enumerate() {
            let mut in_plane = 0.0;
            for (j, &expected) in fates.between[i].iter().enumerate() {
                assert_eq!(expected, fates.between[j][i], "light goes both ways");
                in_plane += expected;
                if expected > 0.0 {
                    assert_near(exact.exchange().exchange_area(i, j), expected, 1e-9 * areas[i]);
                }
            }
            let all = in_plane + fates.open[i] + fates.lost[i];
            assert_near(all, areas[i], 1e-9 * areas[i]);
            assert_near(sum, 1.0 - fates.lost[i] / areas[i], errors[i] + 1e-9);
        }
        assert!(SystemAccuracy::of(&exact).rows_possible);
    }
}

/// Where every cell is covered as a whole or not at all, the layers of a place have together the light of the wall alone.
#[test]
fn layers_of_a_box_have_together_the_light_of_its_walls() {
    let mut numbers = Numbers(42);
    for round in 0..12 {
        let mut tiled = TiledBox::random(&mut numbers, true);
        let mut spec = tiled.spec();
        if round % 2 == 1 {
            spec = turned(&spec);
        }
        let exact = Exact::of_scene(&spec).unwrap();
        let scene = Scene::build(&spec, IndexChoice::Flat).unwrap();
        let layers = |place: &(usize, [u32; 2])| tiled.layers(place.0, place.1);
        let incoming = |place: &(usize, [u32; 2])| -> f64 {
            let faces = layers(place)
                .into_iter()
                .flat_map(|tile| [true, false].map(|inwards| tiled.face(&scene, tile, place.1, inwards)));
            faces.flatten().map(|face| exact.solution().incoming[face]).sum()
        };
        let together: Vec<f64> = tiled.places().iter().map(incoming).collect();

        tiled.tiles.truncate(6);
        tiled.tiles.iter_mut().for_each(|wall| (wall.inwards, wall.sides) = (true, Sides::Front));
        let plain = Exact::of_scene(&tiled.spec()).unwrap();
        let scene = Scene::build(&tiled.spec(), IndexChoice::Flat).unwrap();
        for ((wall, place), together) in tiled.places().into_iter().zip(together) {
            let face = tiled.face(&scene, wall, place, true).unwrap();
            assert_near(together / plain.solution().incoming[face], 1.0, 1e-9);
        }
    }
}

/// A room with a cupboard of two-sided boards, its bottom on the floor, one board too narrow, so that some light gets in.
fn cupboard() -> SceneSpec {
    let mut spec = painted(room([1.0; 3], 2), 0.7, 0.0);
    spec.surfaces[CEILING].emittance = 1.0.into();
    let [w, h] = [0.4, 0.5];
    let (o, ex, ey, ez) = ([0.3, 0.3, 0.0], [w, 0.0, 0.0], [0.0, w, 0.0], [0.0, 0.0, h]);
    let boards = [
        (o, ex, ey),
        ([0.3, 0.3, h], ex, ey),
        (o, ey, ez),
        ([0.7, 0.3, 0.0], ey, ez),
        ([0.3, 0.7, 0.0], ex, ez),
        (o, [0.3, 0.0, 0.0], ez),
    ];
    let boards = boards.map(|(corner, u, v)| grey(quad(corner, u, v, [1, 2]), 0.8, 0.0));
    spec.surfaces.extend(boards.map(|board| SurfaceSpec { sides: Sides::Both, ..board }));
    spec
}

/// Rugs on the floor of a room: partly over one another, nested, touching, triangles, of one side and of two. In order
/// from the top.
fn rugs(gap: f64) -> SceneSpec {
    let mut spec = painted(room([2.0, 1.5, 1.0], 1), 0.7, 0.0);
    spec.surfaces[CEILING].emittance = 1.0.into();
    spec.surfaces[FLOOR].sides = Sides::Both;
    // The floor is the least of its plane and looks up; so do the one-sided rugs, which are outermost.
    let triangle = |a: [f64; 2], b: [f64; 2], c: [f64; 2], z: f64, rows| {
        let [a, b, c] = [a, b, c].map(|[x, y]| DVec3::new(x, y, z));
        Shape::Triangle { a, b, c, rows }
    };
    let rug = |lo: [f64; 2], size: [f64; 2], layer: f64, cells| {
        quad([lo[0], lo[1], layer * gap], [size[0], 0.0, 0.0], [0.0, size[1], 0.0], cells)
    };
    let upper = [
        (rug([0.1, 0.1], [0.7, 0.8], 4.0, [2, 1]), Sides::Front),
        (triangle([0.5, 0.3], [1.4, 0.5], [0.6, 1.2], 3.0 * gap, 2), Sides::Front),
    ];
    let lower = [
        (rug([0.8, 0.4], [0.9, 0.7], -1.0, [1, 2]), Sides::Both),
        (triangle([1.2, 1.3], [0.2, 0.9], [1.1, 0.2], -2.0 * gap, 1), Sides::Both),
        (rug([0.2, 0.2], [0.3, 0.3], -3.0, [1, 1]), Sides::Both),
    ];
    let surface = |(shape, sides): (Shape, Sides)| SurfaceSpec { sides, ..grey(shape, 0.6, 0.5) };
    spec.surfaces.extend(upper.into_iter().chain(lower).map(surface));
    spec
}

const FLOOR: usize = 4;

/// A wall across a room that leaves a gap above, alone or with a twin over a part of it and a smaller one.
fn parted(twins: &[(f64, f64, Sides)]) -> SceneSpec {
    let mut spec = painted(room([2.0, 1.0, 1.0], 2), 0.5, 1.0);
    for &(y, size, sides) in [(0.0, 1.0, Sides::Both)].iter().chain(twins) {
        let wall = quad([0.9, y, 0.0], [0.0, size, 0.0], [0.0, 0.0, 0.6 * size], [1, 1]);
        spec.surfaces.push(SurfaceSpec { sides, ..grey(wall, 0.5, 1.0) });
    }
    spec
}

/// To the rest of the room a stack is the same obstacle as one surface, and it hides nothing from its own layers but what
/// they cover.
#[test]
fn a_stack_blocks_like_one_surface() {
    let twins = [(0.0, 1.0, Sides::Both), (0.25, 0.5, Sides::Front), (0.1, 0.3, Sides::Both)];
    let single = Exact::of_scene(&parted(&[])).unwrap();
    let stack = Exact::of_scene(&parted(&twins)).unwrap();
    let errors = [&single, &stack].map(|exact| exact.exchange().row_errors());
    for (i, j) in (0..24).flat_map(|i| (0..24).map(move |j| (i, j))) {
        let [one, several] = [&single, &stack].map(|exact| exact.exchange().form_factor(i, j));
        assert_near(one, several, errors[0][i] + errors[1][i]);
    }
    assert_rays_agree(&parted(&twins));
    let mut covered = parted(&twins);
    covered.surfaces.truncate(8);
    for wall in &mut covered.surfaces[6..] {
        wall.shape = quad([0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1, 1]);
    }
    let covered = Exact::of_scene(&turned(&covered)).unwrap();
    let across = covered.exchange();
    // Patches 0 … 3 are at x = 0, 4 … 7 at x = 2; 24 and 25 the twins.
    for (i, j) in (0..4).flat_map(|i| (4..8).map(move |j| (i, j))) {
        assert_eq!(across.exchange_area(i, j), 0.0);
    }
    for (sum, error) in across.row_sums().into_iter().zip(across.row_errors()) {
        assert_near(sum, 1.0, error + 1e-9);
    }
}

#[test]
fn rays_around_a_cupboard_on_the_floor() {
    assert_rays_agree(&cupboard());
}

#[test]
fn rays_among_rugs() {
    assert_rays_agree(&rugs(0.0));
    assert_rays_agree(&turned(&rugs(0.0)));
}

/// Layers are the limit of thin gaps. A gap loses light in proportion to its width over its length.
#[test]
fn layers_with_gaps_between_have_nearly_the_same_light() {
    let gap = 1e-6;
    let [layers, gaps] = [0.0, gap].map(|gap| Exact::of_scene(&rugs(gap)).unwrap());
    let errors = [&layers, &gaps].map(|exact| SystemAccuracy::of(exact).radiosity_error);
    let pairs = layers.solution().radiosity.iter().zip(&gaps.solution().radiosity);
    for (i, (layered, apart)) in pairs.enumerate() {
        assert_near(*layered, *apart, 10.0 * gap + errors[0][i] + errors[1][i]);
    }
}
