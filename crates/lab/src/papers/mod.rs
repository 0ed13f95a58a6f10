//! The published tables and figures of Monte Carlo radiosity, measured again and held to theory.
//!
//! A [`Chapter`] is one table or figure, in a file of its own: what was published, what theory says, the experiment
//! that is run, and rows that say how they agree. [`Lab`] runs experiments, [`Findings`] hold what came out, [`page`]
//! writes it down.

mod bs_comparison;
mod bs_table;
mod counted;
mod efficiency;
mod findings;
pub mod page;
mod s97_bounds;
mod s97_complexity;
mod s97_figures;
mod sh91;
mod walkers;

pub use findings::Findings;

use crate::lab::Lab;

/// One published table or figure.
#[derive(Clone, Copy, Debug)]
pub struct Chapter {
    /// The name of the chapter's files.
    pub name: &'static str,
    /// The name of the table or figure in its paper.
    pub title: &'static str,
    /// The experiment of the chapter.
    pub run: fn(&Lab) -> Findings,
}

/// All chapters in the order of the page.
pub const CHAPTERS: [Chapter; 7] = [
    bs_table::CHAPTER,
    bs_comparison::CHAPTER,
    s97_figures::CHAPTER,
    s97_complexity::CHAPTER,
    s97_bounds::CHAPTER,
    sh91::CHAPTER,
    efficiency::CHAPTER,
];
