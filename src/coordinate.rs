//! `radwalk run` and `radwalk coordinate`: a job from file to results.

use std::net::TcpListener;
use std::path::{Path, PathBuf};

use cluster::access::Access;
use cluster::coordinator::{Coordinator, Ending, Plan};
use cluster::server::{Wish, serve};
use job::Job;
use radiosity::{Experiment, Tally};

use crate::args::{CoordinateArgs, JobArgs, OutArgs, RunArgs};
use crate::console::tell;
use crate::fault::{Fault, Outcome};
use crate::local::LocalWorkers;
use crate::outputs::{self, RunOutput};
use crate::progress::Display;
use crate::{replica, signals};

/// The first look at a target. Few walks say little, also about how little they say.
const FIRST_LOOK: u64 = 1 << 10;

/// The same for chains.
const FIRST_LOOK_AT_CHAINS: u64 = 8;

/// Runs a job on worker processes of this machine.
pub fn run(args: &RunArgs) -> Result<Outcome, Fault> {
    let prepared = Prepared::new(&args.job, &args.out)?;
    let wanted = match args.workers {
        Some(workers) => workers as usize,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let folder =
        tempfile::tempdir().map_err(|source| Fault::System { doing: "making a temporary folder", source })?;
    let access_file = folder.path().join("access.json");
    let (listener, access) = listen("127.0.0.1:0", &access_file)?;
    let mut workers = LocalWorkers::new(&access_file, wanted, args.threads);
    signals::catch();
    prepared.serve(listener, access, &args.out, Some(&mut workers))
}

/// Coordinates workers that are started elsewhere.
pub fn coordinate(args: &CoordinateArgs) -> Result<Outcome, Fault> {
    let prepared = Prepared::new(&args.job, &args.out)?;
    let access_file = args.access.clone().unwrap_or_else(|| prepared.output.path().join("access.json"));
    let (listener, access) = listen(&args.listen, &access_file)?;
    if !args.out.quiet {
        tell(&format!(
            "listening at {}; start workers with: radwalk work --access {}",
            access.address,
            access_file.display()
        ));
    }
    signals::catch();
    let done = prepared.serve(listener, access, &args.out, None);
    // The key is of no use any more. Whoever removed the file before has saved us the work.
    let _ = std::fs::remove_file(&access_file);
    done
}

/// Listens at an address and writes the access file for it.
fn listen(address: &str, access_file: &Path) -> Result<(TcpListener, Access), Fault> {
    let fault = |source| Fault::Listen { address: address.into(), source };
    let listener = TcpListener::bind(address).map_err(fault)?;
    let bound = listener.local_addr().map_err(fault)?;
    // A port of 0 was replaced by a free one; a host name stays as it was typed.
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    let access = Access::new(format!("{host}:{}", bound.port()))
        .map_err(|source| Fault::System { doing: "drawing a random key", source })?;
    access
        .write(access_file)
        .map_err(|source| Fault::AccessFileWrite { path: access_file.into(), source })?;
    Ok((listener, access))
}

/// A job that is ready to be shot.
struct Prepared {
    job: Job,
    experiment: Experiment,
    output: RunOutput,
}

impl Prepared {
    fn new(args: &JobArgs, out: &OutArgs) -> Result<Self, Fault> {
        let job = job::load(&args.job, &args.overrides())?;
        let experiment = Experiment::new(job.build_scene()?, job.method.walks())?;
        let folder = out.out.clone().unwrap_or_else(|| default_folder(&job));
        let output = RunOutput::new(&folder, out.force)?;
        Ok(Prepared { job, experiment, output })
    }

    fn plan(&self) -> Result<Plan, Fault> {
        let Job { budget, target, confidence, .. } = &self.job;
        let scene = self.experiment.scene();
        let message = replica::encode(&self.job, scene).map_err(|error| Fault::System {
            doing: "packing the job",
            source: std::io::Error::other(error),
        })?;
        let met = target.map(|target| {
            let (experiment, confidence) = (self.experiment.clone(), *confidence);
            Box::new(move |tally: &Tally| outputs::target_met(&target, &experiment, tally, confidence))
                as Box<dyn FnMut(&Tally) -> bool>
        });
        // A chain is leased as a walk is, whole and alone.
        let (paths, stream_paths, leases_per_thread) = match self.experiment.chain_rays() {
            Some(rays) => (budget.paths / rays, 1, 1),
            None => (budget.paths, budget.stream_paths, 2),
        };
        let first_look =
            if self.experiment.chain_rays().is_some() { FIRST_LOOK_AT_CHAINS } else { FIRST_LOOK };
        Ok(Plan {
            job: message,
            scene_hash: scene.hash(),
            job_hash: job::job_hash(scene.hash(), &self.job.method, self.job.seed),
            build: crate::BUILD.into(),
            paths,
            stream_paths,
            leases_per_thread,
            empty: self.experiment.tally::<{ replica::MOMENTS }>(),
            wall: budget.wall_seconds.map(std::time::Duration::from_secs_f64),
            looks: if target.is_some() { ladder(first_look, paths) } else { Vec::new() },
            target: met,
        })
    }

    /// Serves the job to its end and writes what came of it.
    fn serve(
        self,
        listener: TcpListener,
        access: Access,
        out: &OutArgs,
        mut workers: Option<&mut LocalWorkers>,
    ) -> Result<Outcome, Fault> {
        let mut coordinator = Coordinator::new(self.plan()?, access);
        let display = std::cell::RefCell::new(Display::new(
            out,
            &self.experiment,
            self.job.budget.paths,
            self.job.confidence,
        ));
        let notices = std::cell::RefCell::new(Vec::new());
        let owner = |coordinator: &Coordinator| {
            let mut display = display.borrow_mut();
            display.update(coordinator);
            let notices: Vec<_> = notices.borrow_mut().drain(..).collect();
            for notice in &notices {
                display.notice(notice);
            }
            if signals::stop_asked() {
                return Wish::Stop;
            }
            match &mut workers {
                Some(workers) => {
                    notices.iter().for_each(|notice| workers.heed(notice));
                    if workers.tend(coordinator.progress().walks) { Wish::Continue } else { Wish::GiveUp }
                }
                None => Wish::Continue,
            }
        };
        let ending = serve(listener, &mut coordinator, owner, |notice| notices.borrow_mut().push(notice))
            .map_err(|source| Fault::System { doing: "serving the workers", source })?;
        display.borrow().finish();
        drop(display);
        // After an overflow the sums are no longer those of any walks.
        if ending != Ending::Overflow {
            self.output.write(&self.job, &self.experiment, &coordinator, out)?;
        }
        self.outcome(ending, coordinator.prefix(), workers)
    }

    fn outcome(
        &self,
        ending: Ending,
        tally: &Tally,
        workers: Option<&mut LocalWorkers>,
    ) -> Result<Outcome, Fault> {
        match ending {
            Ending::NoWorkers => {
                Err(Fault::NoWorkers(workers.map_or(String::new(), |workers| workers.trouble.clone())))
            }
            Ending::Overflow => Err(Fault::Overflow),
            Ending::Interrupted => Ok(Outcome::Interrupted),
            Ending::TargetReached => Ok(Outcome::Done),
            Ending::BudgetSpent | Ending::WallClock => {
                let missed = self.job.target.as_ref().is_some_and(|target| {
                    !outputs::target_met(target, &self.experiment, tally, self.job.confidence)
                });
                Ok(if missed { Outcome::TargetMissed } else { Outcome::Done })
            }
        }
    }
}

/// out/<job name>.
pub fn default_folder(job: &Job) -> PathBuf {
    Path::new("out").join(&job.name)
}

/// The walk (or chain) numbers at which a target is looked at: 2^k and 3·2^(k−1), fixed by the job alone.
fn ladder(first: u64, paths: u64) -> Vec<u64> {
    let powers = std::iter::successors(Some(first), |n| n.checked_mul(2));
    let steps = powers.flat_map(|n| [n, n.saturating_add(n / 2)]);
    steps.take_while(|&n| n < paths).chain([paths]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_ascend_to_the_budget() {
        assert_eq!(ladder(FIRST_LOOK, 5000), [1024, 1536, 2048, 3072, 4096, 5000]);
        assert_eq!(ladder(FIRST_LOOK, 1024), [1024]);
        assert_eq!(ladder(FIRST_LOOK, 1), [1]);
        assert!(ladder(FIRST_LOOK_AT_CHAINS, u64::MAX).is_sorted());
    }
}
