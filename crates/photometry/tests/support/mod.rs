//! Files and numbers for the tests of this crate.

#![allow(dead_code, missing_docs)]

use std::f64::consts::PI;
use std::fmt::Write;

use glam::DVec3;
use photometry::Luminaire;

/// SplitMix64: the same numbers on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 2f64.powi(-53)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

/// The direction at angles (C, γ) [°].
pub fn direction(c: f64, gamma: f64) -> DVec3 {
    let ((sin_c, cos_c), (sine, cosine)) = (c.to_radians().sin_cos(), gamma.to_radians().sin_cos());
    DVec3::new(sine * cos_c, sine * sin_c, -cosine)
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// A file of LM-63 in absolute photometry.
pub fn ies(
    edition: u32,
    kind: u32,
    c: &[f64],
    gamma: &[f64],
    value: &mut dyn FnMut(f64, f64) -> f64,
) -> String {
    let first = match edition {
        1986 => String::new(),
        1991 => "IESNA91\n".into(),
        2019 => "IES:LM-63-2019\n".into(),
        edition => format!("IESNA:LM-63-{edition}\n"),
    };
    let (vertical, horizontal) = (gamma.len(), c.len());
    let mut text = format!(
        "{first}[LUMINAIRE] Made up\nTILT=NONE\n1 -1 1 {vertical} {horizontal} {kind} 2 0 0 0\n1 1 10\n"
    );
    let _ = writeln!(text, "{}\n{}", words(gamma), words(c));
    for c in c {
        let row: Vec<f64> = gamma.iter().map(|gamma| value(*c, *gamma)).collect();
        let _ = writeln!(text, "{}", words(&row));
    }
    text
}

/// A file of EULUMDAT whose intensities are in cd: its lamp has 1,000 lm.
pub fn ldt(
    isym: u32,
    c: &[f64],
    planes: &[f64],
    gamma: &[f64],
    value: &mut dyn FnMut(f64, f64) -> f64,
) -> String {
    let mut text = format!(
        "Maker\r\n3\r\n{isym}\r\n{}\r\n0\r\n{}\r\n0\r\nr\r\nName\r\nNumber\r\nf\r\nd\r\n",
        c.len(),
        gamma.len()
    );
    text.push_str(&"0\r\n".repeat(9));
    text.push_str("100\r\n100\r\n1\r\n0\r\n1\r\n-1\r\nLED\r\n1000\r\n4000\r\n80\r\n10\r\n");
    text.push_str(&"0\r\n".repeat(10));
    for angle in c.iter().chain(gamma) {
        let _ = write!(text, "{angle}\r\n");
    }
    for c in planes {
        for gamma in gamma {
            let _ = write!(text, "{}\r\n", value(*c, *gamma));
        }
    }
    text
}

/// Tables of every kind of photometry, with values that jump between nodes.
pub fn tables() -> Vec<(&'static str, Luminaire)> {
    let mut random = Random(11);
    let mut value = |_: f64, _: f64| (1000.0 * random.next().powi(3)).round();
    let step = |from: i32, to: i32, by: usize| (from..=to).step_by(by).map(f64::from).collect::<Vec<_>>();
    let mut made = |kind, c: &[f64], gamma: &[f64]| {
        let text = ies(2002, kind, c, gamma, &mut value);
        Luminaire::read(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"))
    };
    vec![
        ("axial", made(1, &[0.0], &step(0, 180, 15))),
        ("quadrants", made(1, &[0.0, 10.0, 45.0, 90.0], &step(0, 90, 5))),
        ("C0", made(1, &step(0, 180, 20), &[0.0, 1.0, 3.0, 60.0, 180.0])),
        ("C90", made(1, &step(90, 270, 30), &step(0, 90, 10))),
        ("free", made(1, &step(0, 360, 24), &step(0, 180, 9))),
        ("upwards", made(1, &step(0, 345, 15), &step(90, 180, 10))),
        ("type A", made(3, &step(-50, 50, 10), &step(-90, 30, 10))),
        ("type B", made(2, &step(0, 90, 15), &step(-60, 60, 5))),
    ]
}

/// The integral of a function over all directions: the middle rule, which converges with the square of the steps, at two steps,
/// extrapolated.
pub fn quadrature(steps: usize, value: impl Fn(DVec3) -> f64) -> f64 {
    let rule = |n: usize| {
        let width = PI / n as f64;
        let mut sum = 0.0;
        for j in 0..n {
            let gamma = (j as f64 + 0.5) * width;
            for i in 0..2 * n {
                let c = (i as f64 + 0.5) * width;
                sum += gamma.sin() * value(direction(c.to_degrees(), gamma.to_degrees()));
            }
        }
        sum * width * width
    };
    (4.0 * rule(2 * steps) - rule(steps)) / 3.0
}
