//! What a pilot has seen of one part of a mesh.

/// What the pilot saw of one part, all sides and channels together.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PartEstimate {
    /// The square of the mean light over the part, times its area, without bias [W²/m²].
    pub(crate) energy: f64,
    /// What halving it gains, without bias, of means and of linear fits [W²/m²]; 0 where the pilot does not see its halves.
    pub(crate) gain: [f64; 2],
    /// The energy of the error of its mean after one walk [W²/m²].
    pub(crate) noise: f64,
    /// The energy that its mean and its linear fit catch as measured, without what the part around it tells [W²/m²].
    pub(crate) caught: [f64; 2],
    /// The noise of this part or, where few walks have hit it, of one around it [W²/m²].
    pub(crate) predicted: f64,
    /// About how many walks have hit it.
    pub(crate) hits: f64,
}
