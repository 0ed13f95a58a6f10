//! Form factors against published values, their own laws, and cubature.

use crate::common::{Numbers, assert_near, random_box, rectangle};
use exact::{BoxScene, ExchangeMatrix, Facing, Rectangle, exchange_area, form_factor};
use glam::DVec3;

use Facing::{Down, Up};

/// The unit square around the origin of the floor.
fn floor() -> Rectangle {
    rectangle(2, Up, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0])
}

#[test]
fn opposed_unit_squares() {
    let ceiling = rectangle(2, Down, [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]);
    assert_near(form_factor(&floor(), &ceiling), 0.199_824_895_698_387_3, 1e-15);
}

#[test]
fn perpendicular_unit_squares_with_a_shared_edge() {
    let wall = rectangle(0, Up, [0.0, 0.0, 0.0], [0.0, 1.0, 1.0]);
    assert_near(form_factor(&floor(), &wall), 0.200_043_776_075_403_2, 1e-15);
}

#[test]
fn nothing_passes_between_planes_and_backs() {
    let coplanar = rectangle(2, Down, [2.0, 0.0, 0.0], [3.0, 1.0, 0.0]);
    let same_way = rectangle(2, Up, [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]);
    let below = rectangle(2, Down, [0.0, 0.0, -1.0], [1.0, 1.0, -1.0]);
    let averted = rectangle(0, Down, [0.0, 0.0, 0.0], [0.0, 1.0, 1.0]);
    let sunk = rectangle(0, Up, [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]);
    for other in [coplanar, same_way, below, averted, sunk] {
        assert_eq!(form_factor(&floor(), &other), 0.0, "{other:?}");
        assert_eq!(form_factor(&other, &floor()), 0.0, "{other:?}");
    }
}

/// What is behind the plane of the other rectangle takes no part.
#[test]
fn a_rectangle_through_the_plane_counts_as_far_as_it_is_in_front() {
    let whole = rectangle(0, Up, [0.25, 0.0, -1.0], [0.25, 1.0, 1.0]);
    let in_front = rectangle(0, Up, [0.25, 0.0, 0.0], [0.25, 1.0, 1.0]);
    let seen = rectangle(2, Up, [0.25, 0.0, 0.0], [1.0, 1.0, 0.0]);
    let expected = exchange_area(&seen, &in_front);
    assert!(expected > 0.1);
    assert_eq!(exchange_area(&floor(), &whole), expected);
}

#[test]
fn reciprocity_and_closure_in_random_boxes() {
    let mut numbers = Numbers(1);
    for _ in 0..40 {
        let scene = BoxScene::recognise(&random_box(&mut numbers, 0.5, 1.0)).unwrap();
        let patches = scene.patches();
        for i in patches {
            for j in patches {
                let (there, back) = (exchange_area(i, j), exchange_area(j, i));
                assert_near(there, back, 1e-12 * i.area().min(j.area()));
                assert!(there >= 0.0);
            }
        }
        let defect = ExchangeMatrix::of_box(&scene).closure_defect();
        assert!(defect < 1e-12, "{defect:e}");
    }
}

/// Both closed forms and the cubature that relieves them are at work among these.
#[test]
fn a_subdivided_rectangle_receives_as_much() {
    let mut numbers = Numbers(2);
    for _ in 0..200 {
        let [x, y, z] = [0; 3].map(|_| numbers.between(0.0, 6.0));
        let others = [
            rectangle(2, Down, [x, y, z + 0.1], [x + 2.0, y + 1.0, z + 0.1]),
            rectangle(0, Down, [x + 1.0, y, z], [x + 1.0, y + 2.0, z + 1.0]),
        ];
        for whole in others {
            let parts: f64 = grid(&whole, 7).iter().map(|part| exchange_area(&floor(), part)).sum();
            assert_near(parts, exchange_area(&floor(), &whole), 2e-14);
        }
    }
}

/// n × n parts of a rectangle.
fn grid(whole: &Rectangle, n: u32) -> Vec<Rectangle> {
    let step = (whole.hi - whole.lo) / f64::from(n);
    let part = |index: u32| {
        let (p, q) = ((whole.axis + 1) % 3, (whole.axis + 2) % 3);
        let mut from = DVec3::ZERO;
        (from[p], from[q]) = (f64::from(index / n), f64::from(index % n));
        let lo = whole.lo + from * step;
        let hi = whole.lo + (from + DVec3::ONE) * step;
        let mut part = Rectangle { lo, hi, ..*whole };
        (part.lo[whole.axis], part.hi[whole.axis]) = (whole.lo[whole.axis], whole.hi[whole.axis]);
        part
    };
    (0..n * n).map(part).collect()
}

/// Repeated midpoint sums of cosθ cosθ′/(π r²) over n² × n² parts, extrapolated twice in n⁻².
fn cubature(i: &Rectangle, j: &Rectangle) -> f64 {
    let midpoints = |n: u32| {
        let (from, to) = (grid(i, n), grid(j, n));
        let sum: f64 = from.iter().flat_map(|a| to.iter().map(|b| kernel(a, b))).sum();
        sum * i.area() * j.area() / f64::from(n).powi(4)
    };
    let [coarse, middle, fine] = [8, 16, 32].map(midpoints);
    let (once, again) = ((4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0);
    (16.0 * again - once) / 15.0
}

fn kernel(a: &Rectangle, b: &Rectangle) -> f64 {
    let line = 0.5 * (b.lo + b.hi) - 0.5 * (a.lo + a.hi);
    let cosines = (line.dot(normal(a)) * -line.dot(normal(b))) / line.length_squared();
    cosines / (std::f64::consts::PI * line.length_squared())
}

fn normal(rectangle: &Rectangle) -> DVec3 {
    let sign = if rectangle.facing == Up { 1.0 } else { -1.0 };
    sign * DVec3::AXES[rectangle.axis]
}

#[test]
fn offset_pairs_agree_with_cubature() {
    let offset = [
        rectangle(2, Down, [0.5, -0.3, 1.2], [1.9, 0.4, 1.2]),
        rectangle(2, Down, [3.0, 2.0, 0.7], [3.5, 4.0, 0.7]),
        rectangle(0, Down, [1.8, 0.2, 0.3], [1.8, 1.7, 1.1]),
        rectangle(1, Up, [0.1, -1.1, 0.0], [0.8, -1.1, 2.0]),
        rectangle(1, Down, [-9.0, 8.0, 2.0], [-8.0, 8.0, 3.0]),
    ];
    for other in offset {
        let expected = cubature(&floor(), &other);
        assert!(expected > 1e-5);
        assert_near(exchange_area(&floor(), &other) / expected, 1.0, 2e-8);
    }
}

/// x ln x at edges and corners: a gap of 10⁻⁹ m changes the exchange by no more than that.
#[test]
fn touching_is_the_limit_of_nearly_touching() {
    let touching = [
        rectangle(0, Up, [0.0, 0.0, 0.0], [0.0, 1.0, 1.0]),
        rectangle(0, Up, [0.0, 1.0, 0.0], [0.0, 2.0, 1.0]),
        rectangle(2, Down, [1.0, 1.0, 1e-9], [2.0, 2.0, 1e-9]),
        rectangle(2, Down, [0.0, 0.0, 1e-9], [1.0, 1.0, 1e-9]),
    ];
    for other in touching {
        let mut apart = other;
        for shift in [1e-9, 1e-12, 1e-15, 1e-200] {
            (apart.lo.z, apart.hi.z) = (other.lo.z + shift, other.hi.z + shift);
            assert_near(
                exchange_area(&floor(), &apart),
                exchange_area(&floor(), &other),
                4.0 * shift + 1e-15,
            );
        }
    }
}

#[test]
fn form_factors_know_no_unit_of_length() {
    let wall = rectangle(0, Up, [0.0, 0.5, 0.25], [0.0, 2.0, 1.0]);
    let expected = form_factor(&floor(), &wall);
    for scale in [1e-60, 1e-3, 1e3, 1e60] {
        let scaled = |r: &Rectangle| Rectangle { lo: scale * r.lo, hi: scale * r.hi, ..*r };
        assert_near(form_factor(&scaled(&floor()), &scaled(&wall)), expected, 1e-15);
    }
}
