//! A file for each command.

pub(crate) mod audit;
pub(crate) mod check;
pub(crate) mod combine;
pub(crate) mod compare;
pub(crate) mod coordinate;
pub(crate) mod daylight;
pub(crate) mod diff;
pub(crate) mod exact;
pub(crate) mod factors;
pub(crate) mod help;
pub(crate) mod lamp;
pub(crate) mod merge;
pub(crate) mod new;
pub(crate) mod plan;
pub(crate) mod relay;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod sky;
pub(crate) mod status;
pub(crate) mod work;
