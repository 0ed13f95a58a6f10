//! The work that an MGF file may ask for. Arrays and includes multiply what they hold, so that a few bytes can ask for
//! any amount. All copies of a statement are counted when its first copy is read, before the others are made.

use std::path::Path;
use std::rc::Rc;

use crate::error::UnplacedError;
use crate::room::TriangleBudget;

/// The steps that any file may take. A step is about as much work as a short statement, some 50 ns.
const STEPS: u64 = 1 << 26;

/// The steps that a file may take for each of its bytes, beside [`STEPS`].
const STEPS_PER_BYTE: u64 = 64;

/// What the statements read so far ask for, and the arrays and includes that are open.
pub(super) struct Allowance {
    room: TriangleBudget,
    most_steps: u64,
    triangles: u64,
    steps: u64,
    open: Vec<OpenBlock>,
    /// The number of open arrays that are beyond their first copy.
    beyond: usize,
}

/// An open array or include.
struct OpenBlock {
    path: Rc<Path>,
    line: u32,
    copies: u64,
    /// The copies of the statements in it: the product over all open arrays and includes.
    in_all: u64,
    is_beyond: bool,
}

impl Allowance {
    /// The allowance of a file of `bytes` bytes.
    pub(super) fn of(bytes: usize) -> Self {
        let room = TriangleBudget::of(bytes);
        let most_steps = STEPS.saturating_add(STEPS_PER_BYTE.saturating_mul(bytes as u64));
        Allowance { room, most_steps, triangles: 0, steps: 0, open: Vec::new(), beyond: 0 }
    }

    /// The number of open arrays and includes.
    pub(super) fn depth(&self) -> usize {
        self.open.len()
    }

    /// Opens an array or include on a line.
    pub(super) fn open(&mut self, path: &Rc<Path>, line: u32, copies: u64) {
        let in_all = self.in_all().saturating_mul(copies);
        self.open.push(OpenBlock { path: path.clone(), line, copies, in_all, is_beyond: false });
    }

    /// Goes on to the next copy of the innermost array or include.
    pub(super) fn next_copy(&mut self) {
        let innermost = self.open.last_mut().expect("an open array");
        self.beyond += usize::from(!innermost.is_beyond);
        innermost.is_beyond = true;
    }

    /// Closes the innermost array or include.
    pub(super) fn close(&mut self) {
        let closed = self.open.pop().expect("an open array");
        self.beyond -= usize::from(closed.is_beyond);
    }

    /// The copies of the current statement. All of them are counted with the first; for a later copy this is 0.
    fn counted(&self) -> u64 {
        if self.beyond > 0 { 0 } else { self.in_all() }
    }

    fn in_all(&self) -> u64 {
        self.open.last().map_or(1, |open| open.in_all)
    }

    /// Counts triangles before they are made.
    pub(super) fn triangles(&mut self, here: u64) -> Result<(), UnplacedError> {
        self.triangles = self.triangles.saturating_add(here.saturating_mul(self.counted()));
        if self.triangles <= self.room.most() {
            return Ok(());
        }
        let copies = self.in_all();
        let problem = match copies {
            1 => format!("with the {here} triangles of this surface the file makes {}", self.triangles),
            _ => format!(
                "with the {here} triangles of this surface, {copies} times, the file makes {}",
                self.triangles
            ),
        };
        let remedy = match copies {
            1 => "choose a larger import.curve_error where surfaces are curved, or split the file".into(),
            _ => self.smaller_arrays(),
        };
        Err(UnplacedError::new(problem, self.room.why(), remedy))
    }

    /// Counts steps before they are taken.
    pub(super) fn steps(&mut self, here: u64) -> Result<(), UnplacedError> {
        self.steps = self.steps.saturating_add(here.saturating_mul(self.counted()));
        if self.steps <= self.most_steps {
            return Ok(());
        }
        let why = format!(
            "a file of this size may take {}, {STEPS} and {STEPS_PER_BYTE} for each of its bytes",
            self.most_steps
        );
        let problem = format!(
            "with this statement, {} times, reading the file takes {} steps",
            self.in_all(),
            self.steps
        );
        Err(UnplacedError::new(problem, why, self.smaller_arrays()))
    }

    /// Names the arrays and includes that multiply the current statement.
    fn smaller_arrays(&self) -> String {
        // The names that a message holds.
        const NAMED: usize = 4;
        let arrays = self.open.iter().filter(|open| open.copies > 1);
        let count = arrays.clone().count();
        let named: Vec<String> = arrays
            .take(NAMED)
            .map(|open| format!("{}:{} makes {} copies", open.path.display(), open.line, open.copies))
            .collect();
        match count {
            0 => "split the file".into(),
            _ if count <= NAMED => format!("make its arrays smaller: {}", named.join(", ")),
            _ => format!("make its arrays smaller: {}, and {} more", named.join(", "), count - NAMED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opened(copies: &[u64]) -> Allowance {
        let mut allowance = Allowance::of(0);
        let path: Rc<Path> = Path::new("a.mgf").into();
        (1..).zip(copies).for_each(|(line, &copies)| allowance.open(&path, line, copies));
        allowance
    }

    #[test]
    fn all_copies_count_with_the_first() {
        let mut allowance = opened(&[1 << 11, 1 << 11]);
        allowance.triangles(1).unwrap();
        allowance.next_copy();
        allowance.triangles(1).unwrap();
        allowance.close();
        assert_eq!(allowance.triangles, 1 << 22);
        let fault = allowance.triangles(1).unwrap_err();
        assert_eq!(fault.problem, "with the 1 triangles of this surface, 2048 times, the file makes 4196352");
        assert_eq!(fault.remedy, "make its arrays smaller: a.mgf:1 makes 2048 copies");
    }

    #[test]
    fn products_beyond_all_numbers_are_refused() {
        assert!(opened(&[1 << 24; 4]).triangles(1).is_err());
        assert!(opened(&[1 << 24; 4]).steps(1).is_err());
    }
}
