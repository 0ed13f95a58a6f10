//! The steps of a choice in their order, of which those that are kept are not taken again.

use std::sync::Mutex;

use job::{Auto, Job};
use protocol::codec::digest_serde;
use report::OutputFolder;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::arrivals::{ARRIVALS, ArrivalsFile, GroupArrivals};
use super::books::PilotBooks;
use super::stage::{PilotStage, StageResult};
use crate::error::Error;
use crate::settings::Settings;

/// The caller of a pilot, which traces the walks of its stages and may keep the choice on disk.
pub trait PilotRunner<E> {
    /// Walks a stage.
    ///
    /// # Errors
    /// Where its walks come to no end.
    fn walk(&mut self, stage: &PilotStage) -> Result<StageResult, E>;

    /// What is kept of the choice, and where; `None` where nothing is.
    ///
    /// # Errors
    /// Where the folder is another's.
    fn books(&mut self) -> Result<Option<(&mut PilotBooks, &OutputFolder)>, E> {
        Ok(None)
    }

    /// Whether something may be kept of an earlier process. Without that nothing of a folder is asked for before there is something to keep.
    fn has_past(&self) -> bool {
        false
    }

    /// Hears that something cannot be kept. The choice goes on.
    fn trouble(&mut self, _: Error) {}
}

impl<E, F: FnMut(&PilotStage) -> Result<StageResult, E>> PilotRunner<E> for F {
    fn walk(&mut self, stage: &PilotStage) -> Result<StageResult, E> {
        self(stage)
    }
}

/// The steps of a choice: each is a function of the job and of those before.
pub(crate) struct Steps<'c, E> {
    runner: &'c mut dyn PilotRunner<E>,
    of: (&'c Job, &'c Auto),
    /// The digest of all that the choice depends on, once it is asked for.
    choice: Option<[u8; 32]>,
    /// The number of the next step.
    next: usize,
}

impl<'c, E: From<Error>> Steps<'c, E> {
    /// The steps of the choice for a job, none of which is taken.
    pub(crate) fn new(of: (&'c Job, &'c Auto), runner: &'c mut dyn PilotRunner<E>) -> Self {
        Steps { runner, of, choice: None, next: 0 }
    }

    /// The digest of all that the choice depends on, where it is kept.
    fn choice(&mut self) -> Result<[u8; 32], E> {
        if let Some(known) = self.choice {
            return Ok(known);
        }
        let choice = match self.runner.books()? {
            Some(_) => choice(self.of)?,
            None => [0; 32],
        };
        self.choice = Some(choice);
        Ok(choice)
    }

    /// Walks a stage.
    ///
    /// # Errors
    /// Those of the runner.
    pub(super) fn walk(&mut self, stage: &PilotStage) -> Result<StageResult, E> {
        self.runner.walk(stage)
    }

    /// What the next step came to, where it is kept: it counts as taken then.
    ///
    /// # Errors
    /// Those of the runner.
    pub(crate) fn kept<T: DeserializeOwned>(&mut self) -> Result<Option<T>, E> {
        if !self.runner.has_past() {
            return Ok(None);
        }
        let choice = self.choice()?;
        let Some((books, _)) = self.runner.books()? else { return Ok(None) };
        let step = books.step(choice, self.next);
        self.next += usize::from(step.is_some());
        Ok(step)
    }

    /// Keeps what the next step came to.
    ///
    /// # Errors
    /// Those of the runner; that it cannot be kept is none.
    pub(crate) fn keep<T: Serialize>(&mut self, step: &T) -> Result<(), E> {
        let number = (self.choice()?, self.next);
        self.next += 1;
        let Some((books, folder)) = self.runner.books()? else { return Ok(()) };
        let kept = books.keep_step(number, step, folder);
        let kept = kept.and_then(|()| Ok(folder.remove(&[ARRIVALS])?));
        if let Err(error) = kept {
            self.runner.trouble(error);
        }
        Ok(())
    }

    /// The groups of a control that are kept, by their numbers, where it is the next step; `make` makes others of `all` together, which are kept as they
    /// end.
    ///
    /// # Errors
    /// Those of the runner.
    pub(crate) fn groups(
        &mut self,
        all: usize,
        threads: usize,
        make: impl Fn(usize) -> GroupArrivals + Sync,
    ) -> Result<Vec<GroupArrivals>, E> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.choice()?).update(&(self.next as u64).to_le_bytes());
        let control = *hasher.finalize().as_bytes();
        let opened = self
            .runner
            .books()?
            .map(|(books, folder)| ArrivalsFile::open(&folder.file(ARRIVALS), control, books.is_resumed));
        let (file, kept) = match opened.transpose() {
            Ok(opened) => opened.unzip(),
            Err(source) => {
                self.runner.trouble(Error::System { doing: "keeping the walks of a control", source });
                (None, None)
            }
        };
        let mut groups: Vec<Option<GroupArrivals>> = (0..all).map(|_| None).collect();
        kept.into_iter()
            .flatten()
            .filter(|(number, _)| *number < all)
            .for_each(|(n, group)| groups[n] = Some(group));
        let missing: Vec<usize> = (0..all).filter(|&number| groups[number].is_none()).collect();
        let trouble = Mutex::new(None);
        let made = parallel::on_threads(
            threads,
            missing.len(),
            || (),
            |(), i| {
                let group = make(missing[i]);
                if let Some(file) = &file
                    && let Err(source) = file.keep(missing[i], &group)
                {
                    trouble.lock().expect("no thread panics with it").get_or_insert(source);
                }
                group
            },
        );
        if let Some(source) = trouble.into_inner().expect("no thread panics with it") {
            self.runner.trouble(Error::System { doing: "keeping the walks of a control", source });
        }
        missing.into_iter().zip(made).for_each(|(number, group)| groups[number] = Some(group));
        Ok(groups.into_iter().flatten().collect())
    }
}

/// The digest of all that the choice for a job depends on.
pub(super) fn choice(
    (job, Auto { surfaces, kinds, constant, linear }): (&Job, &Auto),
) -> Result<[u8; 32], Error> {
    let job_hash = Settings::of(job).job_hash([0; 32], job.seed);
    let open = (surfaces, kinds, constant, linear);
    let all = (job.scene.spec(), open, job_hash, job.budget.paths, &job.total_target);
    digest_serde(&all)
        .map_err(|error| Error::System { doing: "packing a pilot", source: std::io::Error::other(error) })
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::path::Path;

    use radiosity::rays::Arrival;

    use super::super::{Chosen, choose, choose_by};
    use super::*;

    /// A runner that dies when it is asked for its books once too often.
    struct Mortal<'a> {
        folder: &'a OutputFolder,
        books: PilotBooks,
        left: usize,
        stages: &'a Cell<usize>,
    }

    #[derive(Debug)]
    enum End {
        Death,
        Fault(Error),
    }

    impl From<Error> for End {
        fn from(error: Error) -> Self {
            End::Fault(error)
        }
    }

    impl PilotRunner<End> for Mortal<'_> {
        fn walk(&mut self, stage: &PilotStage) -> Result<StageResult, End> {
            self.stages.set(self.stages.get() + 1);
            Ok(stage.walk_here(2)?)
        }

        fn books(&mut self) -> Result<Option<(&mut PilotBooks, &OutputFolder)>, End> {
            self.left = self.left.checked_sub(1).ok_or(End::Death)?;
            Ok(Some((&mut self.books, self.folder)))
        }

        fn has_past(&self) -> bool {
            true
        }

        fn trouble(&mut self, error: Error) {
            panic!("{error}");
        }
    }

    fn live(job: &Job, folder: &OutputFolder, left: usize, stages: &Cell<usize>) -> Result<Chosen, End> {
        let mut runner = Mortal { folder, books: PilotBooks::read(folder), left, stages };
        Ok(choose_by(job, 2, &mut runner)?.expect("patches are left open"))
    }

    fn room(folder: &Path, set: &[&str]) -> Job {
        let mut spec = scenes::cube_with_tile(0.1, 0.5);
        spec.surfaces[0].emittance = 1.0.into();
        std::fs::write(folder.join("scene.toml"), job::to_toml(&spec)).unwrap();
        let path = folder.join("job.toml");
        std::fs::write(&path, "[scene]\nfile = \"scene.toml\"\npatches = \"auto\"\n").unwrap();
        let set: Vec<String> = set.iter().map(|&key| key.into()).collect();
        job::load(&path, &set).unwrap()
    }

    /// However soon each process ends, the choice is made, and it is that of a process that lives; no stage is walked again once patches were chosen by it.
    #[test]
    fn a_choice_that_dies_at_every_step_is_the_same() {
        let scenes = tempfile::tempdir().unwrap();
        for set in [&["budget.paths=100000"][..], &["budget.paths=1000000", "target.total_error=0.05"]] {
            let job = room(scenes.path(), set);
            let folder = tempfile::tempdir().unwrap();
            let folder = OutputFolder::claim(&folder.path().join("out"), &[], true).unwrap();
            let stages = Cell::new(0);
            let expected = live(&job, &folder, usize::MAX, &stages).unwrap().partition;
            assert_eq!(choose(&job, 1).unwrap().unwrap().partition, expected);
            let at_once = stages.take();
            folder.remove(&[crate::PILOT, ARRIVALS]).unwrap();
            // Each life does one thing more than those before have kept.
            let (mut lives, mut left) = (1, 2);
            let chosen = loop {
                match live(&job, &folder, left, &stages) {
                    Ok(chosen) => break chosen.partition,
                    Err(End::Death) => (lives, left) = (lives + 1, left + 1),
                    Err(End::Fault(error)) => panic!("{error}"),
                }
                assert!(lives < 100, "it gets nowhere");
            };
            assert_eq!(chosen, expected, "{set:?}");
            assert!(
                lives > 5 && stages.get() < 2 * at_once + lives,
                "{lives} lives, {} stages",
                stages.get()
            );
            // What is kept of a job is nothing to another.
            let other = room(scenes.path(), &["budget.paths=90000"]);
            let chosen = live(&other, &folder, usize::MAX, &stages).unwrap().partition;
            assert_eq!(chosen, choose(&other, 1).unwrap().unwrap().partition);
        }
    }

    /// Of a control that is stopped, the groups that were kept are not walked again.
    #[test]
    fn groups_that_are_kept_are_not_walked_again() {
        let scenes = tempfile::tempdir().unwrap();
        let job = room(scenes.path(), &["budget.paths=100000"]);
        let folder = tempfile::tempdir().unwrap();
        let folder = OutputFolder::claim(&folder.path().join("out"), &[], true).unwrap();
        let group = |number: usize| {
            let arrival = Arrival { piece: number as u32, uv: [0.5; 2], weights: [1.0, 0.0, 0.0] };
            (vec![arrival; number], [number as u64, 1])
        };
        let stages = Cell::new(0);
        let groups = |all: usize, make: &(dyn Fn(usize) -> GroupArrivals + Sync)| {
            let books = PilotBooks::read(&folder);
            let mut runner = Mortal { folder: &folder, books, left: usize::MAX, stages: &stages };
            let mut steps = Steps::new((&job, job.auto.as_ref().unwrap()), &mut runner);
            steps.groups(all, 2, make).unwrap()
        };
        // A process that dies after ten groups.
        assert_eq!(groups(10, &group).len(), 10);
        let made = Mutex::new(Vec::new());
        let whole = groups(16, &|number| {
            made.lock().unwrap().push(number);
            group(number)
        });
        let mut made = made.into_inner().unwrap();
        made.sort_unstable();
        assert_eq!(made, (10..16).collect::<Vec<_>>());
        assert_eq!(whole, (0..16).map(group).collect::<Vec<_>>());
    }
}
