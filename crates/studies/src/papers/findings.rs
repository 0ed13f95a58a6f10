//! What an experiment came to.

use report::Chart;

use crate::claim::Claim;

/// What belongs to one chapter.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// What was published, in a sentence or two.
    pub published: String,
    /// What was done here.
    pub experiment: String,
    /// The numbers, a row of the page each.
    pub rows: Vec<Claim>,
    /// What is to be learnt from them, a paragraph each.
    pub remarks: Vec<String>,
    /// The drawings.
    pub figures: Vec<Figure>,
}

/// A drawing or picture.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The name of its file.
    pub file: String,
    /// What it shows.
    pub caption: String,
    /// What is in its file.
    pub content: Vec<u8>,
}

impl Figure {
    /// A chart as SVG.
    pub fn chart(file: &str, caption: impl Into<String>, chart: &Chart) -> Self {
        Figure { file: file.into(), caption: caption.into(), content: chart.svg().into_bytes() }
    }
}
