//! A job as it travels, and the work that a process does with it.

use std::ops::Range;

use cluster::codec::{CodecError, decode_serde, encode_serde};
use cluster::worker::Work;
use job::Method;
use radiosity::{Board, Experiment, IndexChoice, Overflow, Scene, SceneSpec, Sequence, Tally};
use serde::{Deserialize, Serialize};

/// Σx and Σx²: what intervals need.
pub const MOMENTS: usize = 2;

/// All that a worker has to know of a job.
#[derive(Serialize, Deserialize)]
pub struct Wire {
    scene: SceneSpec,
    method: Method,
    seed: u64,
    tree: bool,
}

/// The bytes of a job for its workers.
///
/// # Errors
/// Where the scene is too large for one message.
pub fn encode(job: &job::Job, scene: &Scene) -> Result<Vec<u8>, CodecError> {
    let wire = Wire {
        scene: job.scene.spec().clone(),
        method: job.method.clone(),
        seed: job.seed,
        tree: scene.has_tree(),
    };
    encode_serde(&wire)
}

/// A worker's replica of a job.
pub struct Replica {
    experiment: Experiment,
    sequence: Sequence,
    job_hash: [u8; 32],
}

impl Replica {
    /// Builds the replica from what the coordinator sent.
    ///
    /// # Errors
    /// In words, where the bytes are no job or the scene is invalid.
    pub fn decode(bytes: &[u8]) -> Result<Self, String> {
        let wire: Wire = decode_serde(bytes).map_err(|error| error.to_string())?;
        let index = if wire.tree { IndexChoice::Tree } else { IndexChoice::Flat };
        let scene = Scene::build(&wire.scene, index).map_err(|error| error.to_string())?;
        let job_hash = job::job_hash(scene.hash(), &wire.method, wire.seed);
        let experiment = Experiment::new(scene, wire.method.walks()).map_err(|error| error.to_string())?;
        Ok(Replica { experiment, sequence: Sequence::new(wire.seed), job_hash })
    }
}

impl Work for Replica {
    type Board = Board<MOMENTS>;

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        (self.experiment.scene().hash(), self.job_hash)
    }

    fn empty(&self) -> Tally {
        self.experiment.tally::<MOMENTS>()
    }

    fn board(&self) -> Self::Board {
        self.experiment.board()
    }

    fn shoot(&self, walks: Range<u64>, board: &mut Self::Board) {
        self.experiment.walk(&self.sequence, walks, board);
    }

    fn shoot_while(&self, walks: Range<u64>, board: &mut Self::Board, go_on: &dyn Fn() -> bool) {
        self.experiment.walk_while(&self.sequence, walks, board, go_on);
    }

    fn take(&self, board: &mut Self::Board) -> Result<Tally, Overflow> {
        board.take()
    }
}
