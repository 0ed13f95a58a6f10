//! What is asked of patches.

use radiosity::precision::Quantity;
use serde::{Deserialize, Serialize};

use crate::document::Value;
use crate::error::Error;
use crate::vocabulary::Unhit;

/// The table `[target]` of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Half-width of the interval over the estimate, above 0.
    pub relative_error: f64,
    /// The part of the patch area that must meet it, in (0, 1]; default 0.99.
    pub fraction: f64,
    /// Walks (Jacobi: rays) before which no look is taken; default 1024.
    pub min_paths: u64,
    /// Effective scores without which a patch does not meet it; default 10.
    pub min_hits: u64,
    /// What a reflecting patch counts for that no walk has hit.
    pub unhit: Unhit,
    /// The patches that it is about, by number; `None`: all.
    pub patches: Option<Vec<u32>>,
    /// The quantity whose half-widths must meet it. Jobs keep it behind their settings.
    #[serde(skip)]
    pub quantity: Quantity,
}

/// A target on the total error: noise and discretisation together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TotalTarget {
    /// The relative L2 error of the patches' means over the area, above 0.
    pub total_error: f64,
    /// Walks before which no look is taken; default 1024.
    pub min_paths: u64,
}

pub(crate) fn read_relative_error(value: &Value<'_>) -> Result<f64, Error> {
    let relative_error = value.number()?;
    if relative_error > 0.0 {
        return Ok(relative_error);
    }
    Err(value.refuse(
        format!("{relative_error} is not above 0"),
        "no finite number of walks is exact",
        "choose relative_error > 0, such as 0.01",
    ))
}
