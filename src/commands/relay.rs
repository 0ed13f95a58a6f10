//! `radwalk relay`: one worker to its coordinator, and a coordinator to workers of its own.

use std::net::TcpListener;
use std::path::Path;

use cluster::{Access, WorkerIntroduction};
use tracing::info;

use crate::args::RelayArgs;
use crate::build::BUILD;
use crate::clock::WalkClock;
use crate::commands::work::{keep_joining, name, read_access};
use crate::fault::{Fault, Outcome};
use crate::lead::tell_replaced;
use crate::progress::tell_notice;
use crate::shift::Shift;
use crate::signals;

/// Relays until the coordinator's job is done. A coordinator that was lost without a word is looked for as workers do, and
/// so do this relay's: each time it finds one, it lets its workers in with a new key.
pub(crate) fn relay(args: &RelayArgs) -> Result<Outcome, Fault> {
    signals::catch();
    signals::keep_memory_private();
    if is_one_file(&args.access, &args.out_access) {
        return Err(Fault::OneAccessFile { path: args.access.clone() });
    }
    let (listener, address) = cluster::bind(&args.at.listen, args.at.advertise.as_deref())?;
    let mut last = None;
    let done = keep_joining(args.wait, args.quiet, || join(args, &listener, &address, &mut last));
    // The key is of no use any more, and workers learn by this that it is over. There may never have been one, and by now it
    // may be another relay's.
    let _ = last.map(|own: Access| own.remove(&args.out_access));
    done
}

/// Whether two paths lead to one file, which need not be there.
fn is_one_file(a: &Path, b: &Path) -> bool {
    let there = |path: &Path| path.canonicalize().ok();
    a == b || there(a).is_some_and(|a| Some(a) == there(b))
}

/// Relays for the coordinator of the access file as long as it is there.
fn join(
    args: &RelayArgs,
    listener: &TcpListener,
    address: &str,
    last: &mut Option<Access>,
) -> Result<(), Fault> {
    let access = read_access(&args.access)?;
    let identity = WorkerIntroduction {
        build: BUILD.into(),
        name: format!("relay {}", name(std::process::id())),
        threads: 0,
        leave: signals::stop_asked,
    };
    let mut unwritten = None;
    let open = |scene_hash| {
        let own = Access::new(address.into(), BUILD, scene_hash)?;
        match own.write(&args.out_access) {
            // The file of this relay's coordinator before is its own.
            Ok(replaced) => tell_replaced(replaced.filter(|_| last.is_none()), &args.out_access),
            Err(error) => {
                let failure = Err(std::io::Error::other(error.to_string()));
                unwritten = Some(error);
                return failure;
            }
        }
        signals::remove_on_quitting(own.clone(), args.out_access.clone());
        if !args.quiet {
            info!(
                "relaying at {address}; start workers with: radwalk work --access {}",
                args.out_access.display()
            );
        }
        *last = Some(own.clone());
        Ok((listener.try_clone()?, own))
    };
    let note = |notice: protocol::Notice| {
        tell_notice(&notice);
    };
    let build = |job: &[u8]| Shift::decode(job, WalkClock::default());
    let done = cluster::relay(&access, &identity, build, open, note);
    match unwritten {
        Some(source) => Err(Fault::AccessFileWrite { path: args.out_access.clone(), source }),
        None => Ok(done?),
    }
}
