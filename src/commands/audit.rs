//! `radwalk audit`: traces a random sample of a result's walks again, and says whether it is as it was delivered.

use cluster::random_bytes;
use results::Audit;
use voice::{Phase, say};

use crate::args::AuditArgs;
use crate::fault::{Fault, Outcome};

/// Audits the result in an output folder.
pub(crate) fn audit(args: &AuditArgs) -> Result<Outcome, Fault> {
    if !(args.share > 0.0 && args.share <= 1.0) {
        return Err(Fault::Share(args.share));
    }
    let seed = args.seed.map_or_else(fresh_seed, Ok)?;
    let phase = Phase::begin("reading the result");
    let Audit { traced, all, wrong } =
        results::audit(&args.run, args.share, seed, &|doing| phase.now(doing))?;
    drop(phase);
    if !args.quiet {
        say(&format!(
            "{} of {} paths, {} of {} leases, were traced again (drawn by seed {seed})",
            traced.paths, all.paths, traced.leases, all.leases
        ));
    }
    if let Some(wrong) = wrong {
        return Err(wrong.into());
    }
    if !args.quiet {
        say("every one is exactly as it was delivered");
    }
    Ok(Outcome::Done)
}

fn fresh_seed() -> Result<u64, Fault> {
    let bytes = random_bytes().map_err(|source| Fault::System { doing: "drawing a random seed", source })?;
    // Short enough to be typed.
    Ok(u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")).into())
}
