//! Choices that files and outputs write as one word.

use radiosity::{
    EstimatorKind, Space,
    methods::{RayBirths, Sampler},
    precision::Quantity,
};

/// A choice that files and outputs write as one word.
pub trait Keyword: Copy + 'static {
    /// All choices, in the order in which messages list them.
    const ALL: &'static [Self];

    /// The word of a choice, lower case.
    fn word(self) -> &'static str;
}

impl Keyword for EstimatorKind {
    const ALL: &'static [Self] = EstimatorKind::ALL;

    fn word(self) -> &'static str {
        EstimatorKind::word(self)
    }
}

impl Keyword for Quantity {
    const ALL: &'static [Self] = &[Self::Irradiance, Self::Radiosity, Self::Net];

    fn word(self) -> &'static str {
        Quantity::word(self)
    }
}

impl Keyword for Space {
    const ALL: &'static [Self] = &[Self::Discrete, Self::Continuous];

    fn word(self) -> &'static str {
        match self {
            Space::Discrete => "discrete",
            Space::Continuous => "continuous",
        }
    }
}

impl Keyword for Sampler {
    const ALL: &'static [Self] = &[Self::Random, Self::Sobol];

    fn word(self) -> &'static str {
        match self {
            Sampler::Random => "random",
            Sampler::Sobol => "sobol",
        }
    }
}

impl Keyword for RayBirths {
    const ALL: &'static [Self] = &[Self::Systematic, Self::Multinomial];

    fn word(self) -> &'static str {
        match self {
            RayBirths::Systematic => "systematic",
            RayBirths::Multinomial => "multinomial",
        }
    }
}
