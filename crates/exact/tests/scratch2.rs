mod common;
#[path = "common/shapes.rs"]
mod shapes;
use exact::Exact;
use shapes::*;
use std::time::Instant;
#[test]
fn scratch2() {
    for l in [2] {
    let spec = painted(bumpy_ball(l), 0.5, 1.0);
    let t = Instant::now();
    let exact = Exact::of_scene(&spec).unwrap();
    println!("bumpy {l}: {:?} {:.2e}", t.elapsed(), exact.exchange().closure_defect());
    }
    let spec = painted(l_room(8), 0.5, 1.0);
    let t = Instant::now();
    let exact = Exact::of_scene(&spec).unwrap();
    println!("L 8: {:?} {:.2e}", t.elapsed(), exact.exchange().closure_defect());
}
