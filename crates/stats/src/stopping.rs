//! The rule of stopping at a relative error, which keeps the reported interval as true as it says.
//!
//! A rule that looks again and again and stops as soon as the interval is narrow enough stops at a lucky moment: if
//! half-widths shrink with the count, as those of rare scores do, a count that happens to be high stops early, and the
//! interval misses up to 1.4 % more often than it says (Poisson counts, looks at 2^k and 3·2^(k−1)). Double sampling
//! decides in advance (C. Stein, Ann. Math. Statist. 16 (1945) 243–258; for a given relative error D. R. Cox,
//! Biometrika 39 (1952) 217–227): the first look at which twice the walks will do fixes the end at twice its walks. The
//! walks of that look are only half of those that are reported, so their luck is diluted. (Glynn & Whitt, Ann. Appl.
//! Probab. 2 (1992) 180–198, show that any such rule is valid in the limit of small errors; tests hold this one to its
//! coverage at large ones.)

/// The relative error that half of the walks must show for all of them to do: √2 times the error ε asked for, less a
/// margin of 1 + ε. With h hits asked for, ε ≈ z/√h. A look that saw two standard deviations too many of its h/2 hits
/// is followed by a half with 2·√(h/2) fewer, and by as much less again if that half has bad luck of its own; the
/// margin covers both.
pub fn foresight(relative_error: f64) -> f64 {
    std::f64::consts::SQRT_2 * relative_error / (1.0 + relative_error)
}

/// The stopping rule of a run: the first promising look fixes the end at twice its walks (double sampling).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DoubleSampling {
    end: Option<u64>,
}

impl DoubleSampling {
    /// Takes a look after `walks` walks: whether it shows the [`foresight`] (`promising`), and whether it meets the
    /// target (`met`). Returns whether the run ends here. A run whose end was decided goes on if it does not meet its
    /// target there.
    pub fn look(&mut self, walks: u64, promising: bool, met: bool) -> bool {
        let ends = met && self.end.is_some_and(|end| walks >= end);
        if promising && self.end.is_none() {
            self.end = walks.checked_mul(2);
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_ends_at_twice_the_first_promising_look_or_later() {
        let mut rule = DoubleSampling::default();
        assert!(!rule.look(100, false, true), "met by luck, but not promised before");
        assert!(!rule.look(150, true, true));
        assert!(!rule.look(200, true, true), "too early, whatever it sees");
        assert!(!rule.look(300, true, false), "promised, but missed");
        assert!(rule.look(400, true, true));
    }

    #[test]
    fn foresight_leaves_room_for_luck() {
        assert!(foresight(0.01) < 0.01 * std::f64::consts::SQRT_2);
        assert!((foresight(0.01) / 0.01 - 1.4002).abs() < 1e-4);
    }
}
