//! MGF's named contexts: vertices, colours and materials each have a current one, named or not.

use std::collections::HashMap;

use glam::DVec3;

use crate::error::UnplacedError;
use crate::text::name;

/// A vertex and its normal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vertex {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
}

/// The named values of one kind, and the current one.
#[derive(Debug, Default)]
pub(super) struct Context<T> {
    known: HashMap<Vec<u8>, T>,
    /// The name of the current value; `None` for the unnamed one.
    current: Option<Vec<u8>>,
    unnamed: T,
}

impl<T: Copy + Default> Context<T> {
    /// Follows `v`, `v name`, `v name =` or `v name = template`.
    pub(super) fn enter(&mut self, kind: &str, arguments: &[&[u8]]) -> Result<(), UnplacedError> {
        match arguments {
            [] => {
                self.current = None;
                self.unnamed = T::default();
            }
            [name] => {
                self.get(kind, name)?;
                self.current = Some(name.to_vec());
            }
            [name, b"="] => self.define(name, T::default()),
            [name, b"=", template] => {
                let value = self.get(kind, template)?;
                self.define(name, value);
            }
            _ => {
                return Err(UnplacedError::new(
                    format!("this is no way to name a {kind}"),
                    "it is NAME, NAME = or NAME = TEMPLATE",
                    "correct the line",
                ));
            }
        }
        Ok(())
    }

    fn define(&mut self, name: &[u8], value: T) {
        self.known.insert(name.to_vec(), value);
        self.current = Some(name.to_vec());
    }

    pub(super) fn get(&self, kind: &str, key: &[u8]) -> Result<T, UnplacedError> {
        self.known.get(key).copied().ok_or_else(|| {
            UnplacedError::new(
                format!("there is no {kind} {:?}", name(key)),
                "it has to be defined above",
                "correct the name",
            )
        })
    }

    pub(super) fn current(&self) -> T {
        self.current.as_ref().map_or(self.unnamed, |name| self.known[name])
    }

    pub(super) fn name(&self) -> Option<&[u8]> {
        self.current.as_deref()
    }

    pub(super) fn change(&mut self) -> &mut T {
        match &self.current {
            Some(name) => self.known.get_mut(name).expect("the current value is known"),
            None => &mut self.unnamed,
        }
    }
}
