//! How a running job gets on.
//!
//! A [`Gauge`] measures where it stands ([`Standing`]); [`Reports`] leave that every two seconds in status files and on a
//! page of metrics; [`Showing`] serves the report of the result so far; [`find`] reads a status file in another process, which opens no connection and needs no key.
//!
//! Nothing is printed here.

#![warn(unreachable_pub, unnameable_types)]

mod address;
mod gauge;
mod metrics;
mod reports;
mod scrape;
mod showing;
mod standing;
mod status;

pub use address::NoPage;
pub use gauge::Gauge;
pub use reports::{Reports, open_metrics};
pub use scrape::Page;
pub use showing::Showing;
pub use standing::{Faults, Goal, Saved, Standing};
pub use status::{Description, Found, Hand, NoStatus, Report, find, watched};
