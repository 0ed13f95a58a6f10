//! What the surfaces of a scene are made of, by name.

use serde::{Deserialize, Serialize};

/// The material of each surface, stored as runs of consecutive surfaces with one material.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finishes {
    names: Vec<String>,
    /// The number of a name, and how many surfaces have it.
    runs: Vec<(u32, u32)>,
}

impl Finishes {
    /// Adds the next surface.
    pub fn push(&mut self, name: &str) {
        match self.runs.last_mut() {
            Some((number, surfaces)) if self.names[*number as usize] == name => *surfaces += 1,
            _ => {
                let number = self.names.iter().position(|known| known == name).unwrap_or_else(|| {
                    self.names.push(name.into());
                    self.names.len() - 1
                });
                self.runs.push((number as u32, 1));
            }
        }
    }

    /// The names of all materials.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The number of each surface's name; nothing where the scene came without materials.
    pub fn of_surfaces(&self) -> Vec<u32> {
        let run = |&(number, surfaces): &(u32, u32)| std::iter::repeat_n(number, surfaces as usize);
        self.runs.iter().flat_map(run).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_keep_their_order() {
        let mut finishes = Finishes::default();
        ["white", "white", "red", "white"].into_iter().for_each(|name| finishes.push(name));
        assert_eq!((finishes.names(), finishes.runs.len()), (&["white".to_owned(), "red".into()][..], 3));
        assert_eq!(finishes.of_surfaces(), [0, 0, 1, 0]);
    }
}
