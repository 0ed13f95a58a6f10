//! What coordinator and relay have in common as leaders of a crew: which events reach it, and what follows from them.

use crate::crew::{Crew, Step, farewell};
use crate::lead::{Action, Lead, Now, PeerId};
use crate::message::ToCoordinator;

/// A leader of a crew. Each is a [`Lead`].
pub trait Captain {
    /// Its workers.
    fn crew(&mut self) -> &mut Crew;
    /// Its workers.
    fn its_crew(&self) -> &Crew;
    /// Whether its job has ended: its books stay what they were.
    fn is_over(&self) -> bool;
    /// Goes on after results or walks came in or back.
    fn advance(&mut self, now: Now) -> Vec<Action>;
    /// Ends the job, since a sum overflowed.
    fn overflow(&mut self) -> Vec<Action>;
    /// Does what time brings about.
    fn tick(&mut self, now: Now) -> Vec<Action>;
    /// Bytes of peers have come in.
    fn count(&mut self, bytes: usize) {
        let _ = bytes;
    }
}

/// Goes on after an event.
fn after(captain: &mut impl Captain, step: Step, now: Now) -> Vec<Action> {
    match step {
        Step::Still(actions) => actions,
        Step::Moved(mut actions) => {
            actions.extend(captain.advance(now));
            actions
        }
        Step::Overflow => captain.overflow(),
    }
}

impl<C: Captain> Lead for C {
    fn on_connect(&mut self, id: PeerId) -> Vec<Action> {
        if self.is_over() {
            return farewell(id).into();
        }
        self.crew().on_connect(id);
        vec![]
    }

    fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Vec<Action> {
        if self.is_over() {
            return vec![];
        }
        let step = self.crew().on_message(id, message, now);
        after(self, step, now)
    }

    fn on_stir(&mut self, id: PeerId) {
        self.crew().on_stir(id);
    }

    fn on_bytes(&mut self, bytes: usize) {
        self.count(bytes);
    }

    fn on_lost(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action> {
        // After the end all leave.
        if self.is_over() {
            return vec![];
        }
        let step = self.crew().on_lost(id, reason);
        after(self, step, now)
    }

    fn on_tick(&mut self, now: Now) -> Vec<Action> {
        if self.is_over() { vec![] } else { self.tick(now) }
    }

    fn frame_cap(&self, id: PeerId) -> usize {
        self.its_crew().frame_cap(id)
    }
}
