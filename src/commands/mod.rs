//! A file for each command.

pub mod audit;
pub mod check;
pub mod compare;
pub mod coordinate;
pub mod diff;
pub mod exact;
pub mod merge;
pub mod new;
pub mod plan;
pub mod relay;
pub mod replay;
pub mod report;
pub mod reproduce;
pub mod stability;
pub mod status;
pub mod work;
