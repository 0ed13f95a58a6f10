//! Studies of the methods: [`papers`] measures the published tables and figures again, [`atlas`] drives methods to where
//! they fail, [`compare`] ranks them by speed and accuracy, [`validation`] holds walks to closed forms.
//!
//! Four modules are namespaces, one for each study; [`edition`] has the pages that are made of chapters. All use one laboratory ([`Lab`]), and their statements are [`Claim`]s.
//!
//! This crate prints nothing and writes no files. Seeds are fixed, so that an answer depends on the size of a study
//! alone, not on threads or machines. Times are the exception, and are never judged.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! SInf = Sbert, *Variance of two infinite path length random walk radiosity estimators*; BS = Bekaert & Seidel,
//! *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*; Sh91 = Shirley, *Time Complexity of Monte Carlo
//! Radiosity* (1991).

#![warn(unreachable_pub, unnameable_types)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod arithmetic;
pub mod atlas;
mod claim;
mod clock;
pub mod compare;
pub mod edition;
mod lab;
mod numbers;
mod page;
pub mod papers;
mod series;
mod told;
pub mod validation;
mod walking;

pub use claim::{Bound, Claim, Judge, Limit, Test, Verdict};
pub use lab::{Effort, Lab};
pub use walking::Failure;
