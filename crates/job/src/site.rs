//! Lines of a scene's surfaces and materials, kept for what is found at fault when the scene is built.

/// Where a surface is written. There may be a million of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceSite {
    /// The number of its material.
    pub(crate) material: u32,
    /// The line of its header.
    pub(crate) header: u32,
    /// The lines of [`SITE_KEYS`]; 0 for one that is absent.
    pub(crate) keys: [u32; 4],
}

/// The keys of surfaces that [`Scene::build`] may find at fault.
pub(crate) const SITE_KEYS: [&str; 4] = ["quad", "triangle", "patches", "emit"];

impl SurfaceSite {
    /// Whether the surface has a key of [`SITE_KEYS`].
    pub(crate) fn has(&self, key: &str) -> bool {
        SITE_KEYS.iter().zip(self.keys).any(|(known, line)| *known == key && line > 0)
    }

    /// The line of a key, or of the surface where the key is absent.
    pub(crate) fn of(&self, key: &str) -> usize {
        let known = SITE_KEYS.iter().position(|known| *known == key);
        let line = known.map(|known| self.keys[known]).filter(|&line| line > 0);
        line.unwrap_or(self.header) as usize
    }
}

/// The lines of a table, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lines {
    pub(crate) header: usize,
    pub(crate) keys: Vec<(&'static str, usize)>,
}

impl Lines {
    /// The line of a key, or of the table where the key is absent.
    pub(crate) fn of(&self, key: &str) -> usize {
        self.keys.iter().find(|(known, _)| *known == key).map_or(self.header, |&(_, line)| line)
    }
}
