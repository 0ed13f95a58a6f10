//! How a running job gets on.
//!
//! A [`Gauge`] measures where it stands ([`Standing`]); [`Reports`] leave that every two seconds in status files and on a
//! page of metrics; [`find`] reads a status file in another process, which opens no connection and needs no key.
//!
//! Nothing is printed here.

#![warn(unreachable_pub, unnameable_types)]

mod gauge;
mod metrics;
mod reports;
mod standing;
mod status;

pub use gauge::Gauge;
pub use reports::{Publish, Reports};
pub use standing::{Faults, Goal, Saved, Standing};
pub use status::{Description, Found, Hand, NoStatus, Report, find, watched};
