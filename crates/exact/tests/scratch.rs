mod common;
#[path = "common/shapes.rs"]
mod shapes;
use exact::*;
use radiosity::Sides;
use shapes::*;
use std::time::Instant;
fn show(name: &str, spec: &radiosity::SceneSpec) {
    let t = Instant::now();
    let exact = Exact::of_scene(spec).unwrap();
    let t = t.elapsed().as_secs_f64();
    let a = Accuracy::of(&exact);
    let rel = a.radiosity_error.iter().zip(&exact.solution().radiosity).map(|(e, b)| e / b).fold(0.0, f64::max);
    println!("{name}: n {} {t:.2} s rows {:+.2e} {:+.2e} row err {:.1e} B err {rel:.1e}", exact.exchange().face_count(), a.row_sums[0] - 1.0, a.row_sums[1] - 1.0, a.row_error);
}
#[test]
fn scratch() {
    let mut spec = painted(room([2.0, 1.0, 1.0], 1), 0.9, 0.0);
    let mut plate = grey(quad([0.4, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.95], [1, 1]), 0.95, 0.0);
    plate.sides = Sides::Both;
    spec.surfaces.push(plate);
    spec.surfaces[0].emittance = 1.0;
    spec.surfaces[6].emittance = 0.1;
    show("parted", &spec);
    let mut spec = painted(room([2.0, 1.0, 1.0], 2), 0.5, 1.0);
    let mut plate = grey(quad([0.6, 0.2, 0.3], [0.7, 0.1, 0.2], [-0.1, 0.5, 0.3], [2, 1]), 0.5, 0.1);
    plate.sides = Sides::Both;
    spec.surfaces.push(plate);
    show("plate", &spec);
    show("L 2", &painted(l_room(2), 0.5, 1.0));
    show("L 4", &painted(l_room(4), 0.5, 1.0));
    show("L 8", &painted(l_room(8), 0.5, 1.0));
    show("bumpy 1", &painted(bumpy_ball(1), 0.5, 1.0));
    show("bumpy 2", &painted(bumpy_ball(2), 0.5, 1.0));
}
