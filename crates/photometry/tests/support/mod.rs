//! Files and numbers for the tests of this crate.

#![allow(dead_code, missing_docs)]

use std::fmt::Write;

use glam::DVec3;

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
