//! Counts of walks between groups of faces.

/// The number of walks from each group that arrived at each group, on a back, or escaped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExchangeCounts {
    rows: Vec<Vec<u64>>,
}

impl ExchangeCounts {
    /// No walk yet, between `groups` groups.
    pub fn none(groups: usize) -> Self {
        ExchangeCounts { rows: vec![vec![0; groups + 2]; groups] }
    }

    /// Counts that are these rows.
    #[cfg(test)]
    pub(crate) fn of(rows: &[Vec<u64>]) -> Self {
        let mut counts = ExchangeCounts::none(rows.len());
        counts.add(rows);
        counts
    }

    /// Adds further walks: for each group, what each group took, what backs took, and what escaped.
    ///
    /// # Panics
    /// Where the rows are those of other groups.
    pub fn add(&mut self, further: &[Vec<u64>]) {
        assert_eq!(further.len(), self.rows.len(), "the groups are the same");
        for (row, further) in self.rows.iter_mut().zip(further) {
            assert_eq!(row.len(), further.len(), "the groups are the same");
            row.iter_mut().zip(further).for_each(|(count, more)| *count += more);
        }
    }

    /// G, the number of groups.
    pub fn groups(&self) -> usize {
        self.rows.len()
    }

    /// What became of the walks of group i: taken by groups 0 … G − 1, by backs, escaped.
    pub fn row(&self, i: usize) -> &[u64] {
        &self.rows[i]
    }

    /// N_i, the walks of group i.
    pub fn walks(&self, i: usize) -> u64 {
        self.rows[i].iter().sum()
    }

    /// The walks of all groups.
    pub fn total(&self) -> u64 {
        (0..self.groups()).map(|i| self.walks(i)).sum()
    }
}
