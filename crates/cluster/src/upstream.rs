//! A relay's sockets: it joins its leader as a worker does, and serves its own workers as a coordinator does.

use std::io;
use std::net::TcpListener;
use std::sync::atomic::Ordering;
use std::thread;

use crossbeam::channel::{Receiver, Sender, unbounded};
use protocol::codec::SHORT_FRAME;
use protocol::message::{SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::{Limits, Notice, Relay, RelayEnd, Terms};
use radiosity::Tally;

use crate::access::{Access, random_bytes};
use crate::link::{Ear, ResultSender};
use crate::server::Shell;
use crate::worker::{Hangup, JobHashes, Welcome, Work, WorkerIntroduction, build_from, join};
use crate::worker_error::WorkerError;

/// The listener for a relay's workers, and the access to it.
pub type Door = (TcpListener, Access);

/// Relays between the coordinator (or relay) of `access` and workers of its own, until the job is done. `build` makes
/// the work from the job, as workers do; `open` lets workers come, once the scene's hash is known; `tell` receives the
/// notices for the owner.
///
/// # Errors
/// As for [`crate::worker::work`], and if its own workers cannot be served. These are left without a message, so that
/// they look for a relay again.
pub fn relay<W: Work>(
    access: &Access,
    identity: &WorkerIntroduction,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
    open: impl FnOnce([u8; 32]) -> io::Result<Door>,
    tell: impl FnMut(Notice),
) -> Result<(), WorkerError> {
    join(access, identity, true, |welcome, ear, link| {
        let work = build_from(&welcome.job, link, build)?;
        let (hashes, empty, limits) = (work.hashes(), work.empty(), work.limits());
        let JobHashes { scene: scene_hash, job: job_hash } = hashes;
        drop(work);
        let unserved = |error: io::Error| unserved(link, &error);
        let (listener, own) = open(scene_hash).map_err(unserved)?;
        let large = empty.sums().len() > SMALL_TALLY;
        let lots = random_bytes().map_err(unserved)?;
        let lots = u64::from_le_bytes(lots[..8].try_into().expect("eight bytes"));
        let mut relay = Relay::new(terms(welcome, identity, hashes, &empty, limits), lots);
        let mut shell = Shell::new(listener, &own, tell).map_err(unserved)?;
        // If this fails, the listening thread learns why: the job may have been done meanwhile.
        let _ = link.send(&ToCoordinator::Ready { scene_hash, job_hash });
        let (orders, inbox) = unbounded();
        let (outbox, mail) = unbounded();
        thread::scope(|scope| {
            // However this ends, both threads end with the link.
            let _hangup = Hangup { link };
            let asked = outbox.clone();
            let unstarted = |error| link.give_up(format!("a thread cannot be started ({error})"));
            thread::Builder::new()
                .spawn_scoped(scope, move || listen(ear, link, &orders, &asked))
                .map_err(unstarted)?;
            thread::Builder::new()
                .spawn_scoped(scope, move || speak(link, mail, large))
                .map_err(unstarted)?;
            let ended = lead(&mut relay, &mut shell, link, identity.leave, (&inbox, &outbox))?;
            drop(outbox);
            shell.finish(&mut relay).map_err(unserved)?;
            match (ended, link.failure()) {
                (RelayEnd::Dismissed, None) => Ok(()),
                (RelayEnd::Dismissed, Some(reason)) => Err(WorkerError::Failed(reason)),
                (RelayEnd::Overflow, _) => Err(link.give_up("a sum of the tally overflowed".into())),
                (RelayEnd::Excess, _) => Err(WorkerError::Protocol),
            }
        })
    })
}

/// Serves workers and follows the leader above, until the job is over.
fn lead<T: FnMut(Notice)>(
    relay: &mut Relay,
    shell: &mut Shell<T>,
    link: &ResultSender,
    leave: fn() -> bool,
    (inbox, outbox): (&Receiver<Result<ToWorker, WorkerError>>, &Sender<Mail>),
) -> Result<RelayEnd, WorkerError> {
    loop {
        shell.turn(relay).map_err(|error| unserved(link, &error))?;
        if leave() {
            link.leave();
            shell.act(relay.finish(RelayEnd::Dismissed));
        }
        while relay.end().is_none()
            && let Ok(heard) = inbox.try_recv()
        {
            let actions = match heard? {
                ToWorker::Lease { id, first_walk, walks } => {
                    relay.on_lease(id, first_walk, walks, shell.now())
                }
                ToWorker::Done => relay.finish(RelayEnd::Dismissed),
                ToWorker::Refused { reason } => return Err(WorkerError::Refused(reason)),
                _ => return Err(WorkerError::Protocol),
            };
            shell.act(actions);
        }
        if let Some(end) = relay.end() {
            return Ok(end);
        }
        link.progress.store(relay.progress(), Ordering::Relaxed);
        for message in relay.take_outbox() {
            // If the speaking thread is gone, it has reported why.
            let _ = outbox.send(Mail::Message(message));
        }
    }
}

/// The error that the relay's own workers cannot be served; the leader is told.
fn unserved(link: &ResultSender, error: &io::Error) -> WorkerError {
    link.give_up(format!("its own workers cannot be served ({error})"))
}

/// What this relay's workers must know and be.
fn terms(
    Welcome { job, stream_walks, leases_per_thread }: Welcome,
    identity: &WorkerIntroduction,
    JobHashes { scene: scene_hash, job: job_hash }: JobHashes,
    empty: &Tally,
    limits: Limits,
) -> Terms {
    let (patches, layout) = (empty.patches(), empty.layout());
    let build = identity.build.clone();
    Terms { job, scene_hash, job_hash, build, stream_walks, leases_per_thread, patches, layout, limits }
}

/// A task for the thread that speaks to the relay's leader.
enum Mail {
    Message(ToCoordinator),
    /// Send a large result that the leader asked for.
    Send(u64),
}

/// Reads the messages of the relay's leader, to the end.
fn listen(
    mut ear: Ear,
    link: &ResultSender,
    orders: &Sender<Result<ToWorker, WorkerError>>,
    asked: &Sender<Mail>,
) {
    loop {
        match ear.hear(SHORT_FRAME) {
            Ok(ToWorker::Alive) => {}
            Ok(ToWorker::Send { lease }) => {
                // If this fails, the speaking thread has ended.
                let _ = asked.send(Mail::Send(lease));
            }
            Ok(ToWorker::Drop { lease }) => link.drop_kept(lease),
            heard => {
                let failed = heard.is_err();
                // If this fails, the serving loop has ended.
                if orders.send(heard.map_err(WorkerError::from)).is_err() || failed {
                    return;
                }
            }
        }
    }
}

/// Sends messages to the relay's leader, beside the loop that serves workers.
fn speak(link: &ResultSender, mail: Receiver<Mail>, large: bool) {
    for letter in mail {
        // If the link fails here, it fails for the listening thread too, which reports it.
        let _ = match letter {
            Mail::Message(ToCoordinator::Result(result)) if large => link.offer(result).map(drop),
            Mail::Message(message) => link.send(&message),
            Mail::Send(lease) => link.send_kept(lease),
        };
    }
}
