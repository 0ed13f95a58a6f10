mod common;
#[path = "common/shapes.rs"]
mod shapes;
use exact::Exact;
use shapes::*;
use std::time::Instant;
fn show(name: &str, spec: &radiosity::SceneSpec) {
    let t = Instant::now();
    let exact = Exact::of_scene(spec).unwrap();
    let t = t.elapsed().as_secs_f64();
    let sums = exact.exchange().row_sums();
    let errs = exact.exchange().row_errors();
    let hi = sums.iter().copied().fold(0.0, f64::max);
    let lo = sums.iter().copied().fold(9.0, f64::min);
    let e = errs.iter().copied().fold(0.0, f64::max);
    let me = errs.iter().sum::<f64>() / errs.len() as f64;
    let b: Vec<f64> = exact.solution().radiosity.iter().map(|b| (b - 2.0).abs()).collect();
    let worst = sums.iter().zip(&errs).map(|(s, e)| (s - 1.0).abs() / e).fold(0.0, f64::max);
    println!(
        "{name}: n {} {t:.2} s rows {:+.2e} {:+.2e} err max {e:.1e} mean {me:.1e} defect/err {worst:.2} B off {:.1e}",
        sums.len(),
        lo - 1.0,
        hi - 1.0,
        b.iter().copied().fold(0.0, f64::max)
    );
}
#[test]
fn scratch() {
    show("tetra 6", &painted(tetrahedron(6), 0.5, 1.0));
    show("turned room 6", &turned(&painted(room([1.0, 1.0, 1.0], 6), 0.5, 1.0)));
    show("turned room 6 121", &turned(&painted(room([10.0, 1.0, 2.0], 6), 0.5, 1.0)));
    show("L 4", &painted(l_room(4), 0.5, 1.0));
    show("turned L 4", &turned(&painted(l_room(4), 0.5, 1.0)));
    show("bumpy 2", &painted(bumpy_ball(2), 0.5, 1.0));
    show("bumpy 3", &painted(bumpy_ball(3), 0.5, 1.0));
    show("sphere 3", &painted(ball(3, |_| 1.0), 0.5, 1.0));
    show("turned room 22", &turned(&painted(room([1.0, 1.0, 1.0], 22), 0.5, 1.0)));
    show("L 14", &painted(l_room(14), 0.5, 1.0));
}
