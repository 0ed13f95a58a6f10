//! Tests with rooms that were broken on purpose, and with sound ones.

use doctor::{Finding, Kind, examine, repair};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneSpec, Shape, Sides, Spectrum, SurfaceSpec, surfaces::SKY};

const WALLS: [&str; 6] = ["floor", "ceiling", "south", "north", "west", "east"];

fn quad(name: &str, corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> SurfaceSpec {
    let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
    SurfaceSpec {
        name: Some(name.into()),
        shape: Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells: [1, 1] },
        sides: Sides::Front,
        reflectance: 0.5.into(),
        emittance: Spectrum::BLACK,
        cell_emittance: Vec::new(),
        transmittance: Default::default(),
    }
}

/// The six sides of a box; fronts face inwards, or outwards.
fn cuboid(names: [&str; 6], [x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3], outwards: bool) -> Vec<SurfaceSpec> {
    let (u, v, w) = ([dx, 0., 0.], [0., dy, 0.], [0., 0., dz]);
    let mut sides = vec![
        quad(names[0], [x, y, z], u, v),
        quad(names[1], [x, y, z + dz], v, u),
        quad(names[2], [x, y, z], w, u),
        quad(names[3], [x, y + dy, z], u, w),
        quad(names[4], [x, y, z], v, w),
        quad(names[5], [x + dx, y, z], w, v),
    ];
    if outwards {
        sides.iter_mut().for_each(turn);
    }
    sides
}

fn turn(surface: &mut SurfaceSpec) {
    let Shape::Parallelogram { corner, corner_u, corner_v, cells } = surface.shape else { unreachable!() };
    surface.shape = Shape::Parallelogram { corner, corner_u: corner_v, corner_v: corner_u, cells };
}

fn both(mut surface: SurfaceSpec) -> SurfaceSpec {
    surface.sides = Sides::Both;
    surface
}

fn lamp(corner: [f64; 3]) -> SurfaceSpec {
    let mut lamp = quad("lamp", corner, [0., 0.5, 0.], [0.5, 0., 0.]);
    lamp.emittance = 100.0.into();
    lamp.reflectance = 0.0.into();
    lamp
}

/// A room of 4 m × 3 m × 2.5 m with a lamp that shines down from 10 cm below its ceiling: the bottom of a flat body.
fn room() -> SceneSpec {
    let mut surfaces = cuboid(WALLS, [0.; 3], [4., 3., 2.5], false);
    let mut body =
        cuboid(["", "l-top", "l-s", "l-n", "l-w", "l-e"], [1.5, 1.25, 2.4], [0.5, 0.5, 0.05], true);
    body[0] = lamp([1.5, 1.25, 2.4]);
    surfaces.extend(body);
    SceneSpec::new(surfaces)
}

/// The room with another lamp, a bare sheet.
fn lit_by(lamp: SurfaceSpec) -> SceneSpec {
    changed(|surfaces| {
        surfaces.truncate(6);
        surfaces.push(lamp);
    })
}

fn turned(mut surface: SurfaceSpec) -> SurfaceSpec {
    turn(&mut surface);
    surface
}

fn with(more: Vec<SurfaceSpec>) -> SceneSpec {
    let mut room = room();
    room.surfaces.extend(more);
    room
}

fn changed(change: impl FnOnce(&mut Vec<SurfaceSpec>)) -> SceneSpec {
    let mut room = room();
    change(&mut room.surfaces);
    room
}

/// The room without a lamp and with a low south wall, in a box that stands for the sky.
fn under_sky() -> SceneSpec {
    changed(|surfaces| {
        surfaces.truncate(6);
        surfaces[2] = quad("south", [0., 0., 0.], [0., 0., 1.], [4., 0., 0.]);
        let mut sky = cuboid([SKY; 6], [-0.1; 3], [4.2, 3.2, 2.7], false);
        for side in &mut sky {
            side.emittance = 100.0.into();
            side.reflectance = 0.0.into();
        }
        surfaces.extend(sky);
    })
}

const BLOCK: [&str; 6] = ["b-bottom", "b-top", "b-south", "b-north", "b-west", "b-east"];

fn block(corner: [f64; 3], size: [f64; 3]) -> Vec<SurfaceSpec> {
    cuboid(BLOCK, corner, size, true)
}

/// A sphere-like body of n × n/2 facets.
fn ball(centre: [f64; 3], radius: f64, n: u32) -> Vec<SurfaceSpec> {
    let point = |i: u32, j: u32| {
        let (theta, phi) = (
            std::f64::consts::PI * f64::from(i) / f64::from(n / 2),
            std::f64::consts::TAU * f64::from(j % n) / f64::from(n),
        );
        let sin = if i == 0 || i == n / 2 { 0.0 } else { theta.sin() };
        DVec3::from_array(centre) + radius * DVec3::new(sin * phi.cos(), sin * phi.sin(), -theta.cos())
    };
    let mut facets = Vec::new();
    for i in 0..n / 2 {
        for j in 0..n {
            let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                if a != b && b != c && c != a {
                    let mut facet = quad("facet", [0.; 3], [1., 0., 0.], [0., 1., 0.]);
                    facet.shape = Shape::Triangle { a, b, c, rows: 1 };
                    facets.push(facet);
                }
            }
        }
    }
    facets
}

/// A leg of two-sided sheets from a place up, with its foot.
fn leg(name: &str, corner: [f64; 3]) -> Vec<SurfaceSpec> {
    let mut leg = cuboid([name; 6], corner, [0.02, 0.02, 0.5], true);
    leg.iter_mut().for_each(|side| side.sides = Sides::Both);
    leg
}

fn names(spec: &SceneSpec, finding: &Finding) -> Vec<String> {
    finding
        .surfaces
        .iter()
        .map(|&surface| spec.surfaces[surface as usize].name.as_deref().unwrap().into())
        .collect()
}

/// (case, scene, kind and a surface that some finding must name)
fn broken() -> Vec<(&'static str, SceneSpec, Kind, &'static str)> {
    let north = |surfaces: &mut Vec<SurfaceSpec>| surfaces[3].clone();
    vec![
        ("a flipped wall", changed(|s| turn(&mut s[3])), Kind::Flipped, "north"),
        ("a flipped ceiling", changed(|s| turn(&mut s[1])), Kind::Flipped, "ceiling"),
        (
            "two flipped walls",
            changed(|s| {
                turn(&mut s[2]);
                turn(&mut s[4]);
            }),
            Kind::Flipped,
            "west",
        ),
        ("an inside-out room", changed(|s| s[..6].iter_mut().for_each(turn)), Kind::Flipped, "floor"),
        (
            "a flipped side of a block",
            {
                let mut block = block([1., 1., 0.5], [0.5; 3]);
                turn(&mut block[1]);
                with(block)
            },
            Kind::Flipped,
            "b-top",
        ),
        (
            "a leak of 1 mm",
            changed(|s| s[3] = quad("north", [0., 3., 0.001], [4., 0., 0.], [0., 0., 2.499])),
            Kind::Leak,
            "north",
        ),
        (
            "a leak of 5 mm at a corner",
            changed(|s| s[5] = quad("east", [4., 0.005, 0.], [0., 0., 2.5], [0., 2.995, 0.])),
            Kind::Leak,
            "east",
        ),
        (
            "a crack",
            changed(|s| s[1] = quad("ceiling", [0., 0., 2.5001], [0., 3., 0.], [4., 0., 0.])),
            Kind::Crack,
            "ceiling",
        ),
        (
            "vertices that were not merged",
            changed(|s| {
                s[3] = quad("north", [0., 3., 0.], [2., 0., 0.], [0., 0., 2.5]);
                s.push(quad("north 2", [2.00002, 3., 0.], [1.99998, 0., 0.], [0., 0., 2.5]));
            }),
            Kind::Crack,
            "north",
        ),
        ("a doubled floor", changed(|s| s.push(s[0].clone())), Kind::Overlapping, "floor"),
        (
            "a rug in the floor's plane",
            with(vec![both(quad("rug", [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]))]),
            Kind::Overlapping,
            "rug",
        ),
        (
            "a cupboard of two sides whose side lies in a wall",
            with({
                let mut cupboard = block([0., 1., 0.5], [0.5, 0.5, 1.]);
                cupboard.iter_mut().for_each(|side| side.sides = Sides::Both);
                cupboard.remove(5);
                cupboard
            }),
            Kind::Overlapping,
            "b-west",
        ),
        (
            "two walls that overlap",
            changed(|s| {
                s[3] = quad("north", [0., 3., 0.], [3., 0., 0.], [0., 0., 2.5]);
                s.push(quad("north 2", [2., 3., 0.], [2., 0., 0.], [0., 0., 2.5]));
            }),
            Kind::Overlapping,
            "north 2",
        ),
        (
            "a lamp inside the ceiling",
            changed(|s| {
                s.extend(block([1., 1., 2.3], [1.5, 1.5, 0.19]));
            }),
            Kind::Emitter,
            "lamp",
        ),
        ("a lamp above the ceiling", lit_by(turned(lamp([1.5, 1.25, 2.6]))), Kind::Emitter, "lamp"),
        ("a lamp that faces the ceiling", lit_by(turned(lamp([1.5, 1.25, 2.49]))), Kind::Emitter, "lamp"),
        (
            "a lamp whose back shines at the ceiling",
            lit_by(both(lamp([1.5, 1.25, 2.49]))),
            Kind::Emitter,
            "lamp",
        ),
        ("a missing wall", changed(|s| drop(s.remove(3))), Kind::Open, "ceiling"),
        (
            "a hole in a wall",
            changed(|s| {
                let mut wall = north(s);
                wall.shape = quad("", [0., 3., 0.], [4., 0., 0.], [0., 0., 2.]).shape;
                s[3] = wall;
                s.push(quad("lintel", [1., 3., 2.], [3., 0., 0.], [0., 0., 0.5]));
            }),
            Kind::Open,
            "lintel",
        ),
        (
            "a block without bottom above the floor",
            {
                let mut block = block([1., 1., 0.5], [1.; 3]);
                block.remove(0);
                with(block)
            },
            Kind::Back,
            "b-top",
        ),
        (
            "a sheet with one side",
            with(vec![quad("sheet", [1., 1., 1.], [1., 0., 0.], [0., 1., 0.])]),
            Kind::Back,
            "sheet",
        ),
        (
            "a block within a block",
            with({
                let mut outer = block([1., 1., 0.5], [1.; 3]);
                let inner = cuboid(["i1", "i2", "i3", "i4", "i5", "i6"], [1.3, 1.3, 0.8], [0.3; 3], true);
                outer.extend(inner);
                outer
            }),
            Kind::Buried,
            "i1",
        ),
        (
            "a flipped wall under a sky",
            {
                let mut room = under_sky();
                turn(&mut room.surfaces[5]);
                room
            },
            Kind::Back,
            "east",
        ),
    ]
}

fn sound() -> Vec<(&'static str, SceneSpec)> {
    let box_of_two_sides = changed(|s| s.iter_mut().for_each(|surface| surface.sides = Sides::Both));
    vec![
        ("an empty room", room()),
        ("a room with two-sided walls", box_of_two_sides),
        ("a room under a sky, which lights its outsides", under_sky()),
        ("a block in mid-air", with(block([1., 1., 0.5], [0.5; 3]))),
        ("a block on the floor", with(block([1., 1., 0.], [0.5; 3]))),
        ("a cupboard of two-sided sheets on a floor of two sides, with a glass on its top", {
            let mut room = with(block([1., 1., 0.], [0.5, 0.5, 1.]));
            room.surfaces.extend(leg("glass", [1.2, 1.2, 1.]));
            room.surfaces.iter_mut().for_each(|surface| {
                if !surface.emittance.is_lit() {
                    surface.sides = Sides::Both;
                }
            });
            room
        }),
        ("legs that end beneath a floor of two sides", {
            let mut room = with(leg("leg", [1., 1., -0.001]));
            room.surfaces.extend(leg("other leg", [1.5, 1., -0.0002]));
            room.surfaces[..6].iter_mut().for_each(|wall| wall.sides = Sides::Both);
            room
        }),
        ("a curtain", with(vec![both(quad("curtain", [1., 1., 0.], [0., 1., 0.], [0., 0., 2.]))])),
        (
            "a T-junction without a gap",
            changed(|s| {
                s[3] = quad("north", [0., 3., 0.], [2., 0., 0.], [0., 0., 2.5]);
                s.push(quad("low", [2., 3., 0.], [2., 0., 0.], [0., 0., 1.25]));
                s.push(quad("high", [2., 3., 1.25], [2., 0., 0.], [0., 0., 1.25]));
            }),
        ),
        ("a ball", with(ball([2., 1.5, 1.], 0.5, 16))),
        ("a block 1 mm above the floor", with(block([1., 1., 0.001], [0.5; 3]))),
        (
            "two rooms with a passage",
            changed(|s| {
                s.push(both(quad("screen", [2.5, 0., 0.], [0., 2., 0.], [0., 0., 2.5])));
            }),
        ),
        (
            "a lamp in the ceiling",
            changed(|s| {
                s.truncate(6);
                s[1] = quad("ceiling", [0., 0., 2.5], [0., 3., 0.], [1.5, 0., 0.]);
                s.push(quad("ceiling 2", [2., 0., 2.5], [0., 3., 0.], [2., 0., 0.]));
                s.push(quad("ceiling 3", [1.5, 0., 2.5], [0., 1.25, 0.], [0.5, 0., 0.]));
                s.push(quad("ceiling 4", [1.5, 1.75, 2.5], [0., 1.25, 0.], [0.5, 0., 0.]));
                s.push(lamp([1.5, 1.25, 2.5]));
            }),
        ),
    ]
}

#[test]
fn everything_broken_is_found_by_name() {
    let mut missed = Vec::new();
    for (case, spec, kind, name) in broken() {
        let findings = examine(&spec).unwrap();
        let found = findings.iter().any(|f| f.kind == kind && names(&spec, f).iter().any(|n| n == name));
        if !found {
            missed.push(format!("{case}: {findings:#?}"));
        }
        assert!(findings.is_sorted_by(|a, b| a.power >= b.power), "{case}: most power first");
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn sound_rooms_have_nothing() {
    for (case, spec) in sound() {
        assert_eq!(examine(&spec).unwrap(), [], "{case}");
    }
}

/// A rug of 1 m² hangs over the edge of a floor in its own plane by a quarter: the areas are those of the scene's
/// stacks.
#[test]
fn overlaps_are_exact() {
    let mut rug = both(quad("rug", [3.25, 1., 0.], [1., 0., 0.], [0., 1., 0.]));
    rug.reflectance = 0.2.into();
    let findings = examine(&with(vec![rug])).unwrap();
    let found = findings.iter().find(|finding| finding.kind == Kind::Overlapping).unwrap();
    assert_eq!(found.message, "floor and rug lie in one plane and share 7.500e-1 m²");
}

/// The lowest face of a box with its fronts inside, 1 mm above the floor, sees no light arrive, and follows its sides.
#[test]
fn connected_surfaces_are_turned_together() {
    let place = |outwards| cuboid(BLOCK, [1., 1., 0.001], [0.5; 3], outwards);
    let done = repair(&with(place(false))).unwrap();
    assert_eq!(done.turned, BLOCK);
    assert_eq!(done.spec, with(place(true)));
}

/// Parts of a mesh are one finding, which counts them.
#[test]
fn findings_about_one_part_are_one() {
    let lamps = (0..3).map(|i| {
        let mut one = lamp([1.0 + f64::from(i), 1.25, 2.49]);
        one.name = Some(format!("Lamps:{i}").into());
        turned(one)
    });
    let findings = examine(&changed(|surfaces| {
        surfaces.truncate(6);
        surfaces.extend(lamps);
    }))
    .unwrap();
    let emitters: Vec<&Finding> = findings.iter().filter(|finding| finding.kind == Kind::Emitter).collect();
    assert_eq!(emitters.len(), 1, "{findings:#?}");
    let mut surfaces = emitters[0].surfaces.clone();
    surfaces.sort_unstable();
    assert_eq!(surfaces, [6, 7, 8]);
    assert!(emitters[0].message.ends_with("and 2 more of Lamps like it"), "{}", emitters[0].message);
}

#[test]
fn repairs_turn_what_is_flipped_and_take_out_doubles() {
    for (case, spec, kind, name) in broken().into_iter().filter(|(_, _, kind, _)| *kind == Kind::Flipped) {
        let done = repair(&spec).unwrap();
        assert!(done.turned.iter().any(|turned| turned == name), "{case} {kind:?}: {:?}", done.turned);
        assert_eq!(examine(&done.spec).unwrap(), [], "{case}");
    }
    let doubled = changed(|s| s.push(s[0].clone()));
    let done = repair(&doubled).unwrap();
    assert_eq!((done.removed, done.turned.len()), (vec!["floor".to_owned()], 0));
    assert_eq!(repair(&room()).unwrap().spec, room());
    // A double may follow a surface at its place that faces the other way.
    let around = changed(|s| s.extend([turned(s[0].clone()), s[0].clone()]));
    assert_eq!(repair(&around).unwrap().numbers[1], [around.surfaces.len() as u32 - 1]);
}

/// A surface at the place of another one is kept where it is of another material or cut otherwise.
#[test]
fn repairs_keep_lamps_that_cover_a_wall() {
    let changes: [fn(&mut SurfaceSpec); 3] = [
        |lamp| lamp.emittance = 100.0.into(),
        |lamp| lamp.reflectance = 0.123.into(),
        |lamp| lamp.cell_emittance.push((0, 7.0.into())),
    ];
    for change in changes {
        let covered = changed(|s| {
            let mut lamp = s[1].clone();
            change(&mut lamp);
            s.push(lamp);
        });
        assert_eq!(repair(&covered).unwrap().removed, [""; 0]);
    }
}

/// Light between surfaces that keep all of it goes on for ever, and so do walks.
#[test]
fn light_that_never_ends_is_named() {
    let warnings = |reflectance: f64| {
        doctor::warnings(&Scene::build(&SceneSpec::furnace(1, reflectance), IndexChoice::Auto).unwrap())
    };
    assert!(warnings(0.9999).is_empty());
    let told = warnings(1.0 - f64::EPSILON);
    assert!(told.len() == 1 && told[0].contains("4.5e15 times"), "{told:?}");
}
