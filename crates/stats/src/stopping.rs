//! When to stop at a relative error, so that the interval that is then reported is as true as it says.
//!
//! Whoever looks again and again and stops as soon as the interval is narrow enough stops at a lucky moment: where
//! half-widths shrink with the count, as those of rare scores do, a count that happens to be high stops early, and the
//! interval misses up to 1.4 % more often than it says (Poisson counts, looks at 2^k and 3·2^(k−1)). Double sampling
//! decides in advance (C. Stein, Ann. Math. Statist. 16 (1945) 243–258; for a given relative error D. R. Cox, Biometrika
//! 39 (1952) 217–227): the first look at which twice the walks will do fixes the end at twice its walks. What it saw is
//! but half of what is reported, and its luck is diluted. (Glynn & Whitt, Ann. Appl. Probab. 2 (1992) 180–198, show
//! that any such rule is valid in the limit of small errors; this one is held to its coverage at large ones.)

/// What a look must show of half the walks for all of them to do, as a relative error: √2 times the error asked for,
/// less a margin of 1 + ε. With h hits asked for, ε ≈ z/√h, a look that saw two standard deviations too many of its h/2
/// is followed by a half that has 2·√(h/2) fewer, and so much less again by its own bad luck; the margin covers both.
pub fn foresight(relative_error: f64) -> f64 {
    std::f64::consts::SQRT_2 * relative_error / (1.0 + relative_error)
}

/// The end of a run as its looks decide it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DoubleSampling {
    end: Option<u64>,
}

impl DoubleSampling {
    /// A look after so many walks: whether it shows the [`foresight`] (`promising`), and whether it meets the target
    /// (`met`). Returns whether the run ends here. A run whose end was decided goes on where its target is not met
    /// there after all.
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
