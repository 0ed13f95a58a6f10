//! The findings of a chapter.

use report::Chart;

use crate::claim::Claim;

/// The findings of one chapter.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// The published result, in a sentence or two.
    pub published: String,
    /// The experiment that was done here.
    pub experiment: String,
    /// The numbers, one row of the page each.
    pub rows: Vec<Claim>,
    /// The conclusions from them, a paragraph each.
    pub remarks: Vec<String>,
    /// The figures of the chapter.
    pub figures: Vec<Drawing>,
}

/// A drawing or picture.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// The name of the figure's file.
    pub file: String,
    /// The caption of the figure.
    pub caption: String,
    /// The content of the figure's file.
    pub content: Vec<u8>,
}

impl Drawing {
    /// A figure of a chart, as SVG.
    pub fn chart(file: &str, caption: impl Into<String>, chart: &Chart) -> Self {
        Drawing { file: file.into(), caption: caption.into(), content: chart.svg().into_bytes() }
    }
}
