//! Measures the load that a coordinator can take: a real coordinator, and synthetic workers that trace nothing. They
//! sleep as long as walks would take and send tallies that are made up from the numbers of streams, so that any stream
//! that is lost or counted twice shows.
//!
//!     load coordinate ACCESS PATCHES STREAMS       prints what it took, as a line of JSON
//!     load relay ACCESS OUT-ACCESS                 a relay; prints what it took, as a line of JSON
//!     load work ACCESS WORKERS WALKS-PER-SECOND    that many workers in one process
//!
//! `scripts/load.sh` runs both.

use std::error::Error;
use std::fs;
use std::net::TcpListener;
use std::ops::Range;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use cluster::{Access, JobHashes, Wish, Work, WorkerIntroduction, relay, serve, work};
use protocol::{Coordinator, Ending, JobPlan, Limits, Look, Past};
use radiosity::{Counts, Layout, Overflow, Tally};

const LAYOUT: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };
const BUILD: &str = "load test";
const HASH: [u8; 32] = [7; 32];

/// The walks of a stream, as by default.
const STREAM: u64 = 1 << 16;

/// The growth of every sum with every stream: leases of a second hold some hundreds, which take three bytes on the
/// wire.
const SCORE: u128 = 20;

type Done = Result<(), Box<dyn Error>>;

fn main() -> Done {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match &args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["coordinate", access, patches, streams] => {
            coordinate(Path::new(access), patches.parse()?, streams.parse()?)
        }
        ["relay", access, out_access] => relay_between(Path::new(access), Path::new(out_access)),
        ["work", access, workers, rate] => work_many(Path::new(access), workers.parse()?, rate.parse()?),
        _ => Err("usage: load coordinate ACCESS PATCHES STREAMS | load relay ACCESS OUT-ACCESS | load work ACCESS WORKERS WALKS-PER-SECOND"
            .into()),
    }
}

/// The patch whose sum shows that a stream came in, and the amount.
fn mark(stream: u64, patches: usize) -> (usize, u128) {
    let z = (stream + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((z >> 20) as usize % patches, u128::from(stream))
}

/// Adds the streams that begin within a range of walks.
fn add(sums: &mut [u128], walks: &Range<u64>) {
    let streams = walks.start.div_ceil(STREAM)..walks.end.div_ceil(STREAM);
    let all = SCORE * u128::from(streams.end - streams.start);
    sums.iter_mut().for_each(|sum| *sum += all);
    for stream in streams {
        let (patch, score) = mark(stream, sums.len() / 2);
        // Sums of squares are never less than those of scores: the coordinator refuses such a result.
        sums[2 * patch..2 * patch + 2].iter_mut().for_each(|sum| *sum += score);
    }
}

/// A tally with the given walks added.
fn with(total: Tally, walks: &Range<u64>) -> Tally {
    let (patches, mut counts, count) = (total.patches(), total.counts, walks.end - walks.start);
    counts
        .add(&Counts { walks: count, rays: count, absorbed: count, ..Counts::default() })
        .expect("few walks");
    let mut sums = total.into_sums();
    add(&mut sums, walks);
    Tally::from_parts(counts, patches, LAYOUT, sums).expect("the shape of the layout")
}

// ---- the coordinator ----

fn coordinate(access_file: &Path, patches: usize, streams: u64) -> Done {
    let bare = status("VmRSS");
    let walks = streams * STREAM;
    let plan = JobPlan {
        job: patches.to_string().into_bytes().into(),
        scene_hash: HASH,
        job_hash: HASH,
        build: BUILD.into(),
        first: 0,
        paths: walks,
        stream_paths: STREAM,
        leases_per_thread: 2,
        patches,
        layout: LAYOUT,
        limits: Limits::NONE,
        wall: None,
        lots: 0,
        looks: Vec::new(),
        judge: Box::new(|tally, _| Look { walks: tally.counts.walks, ..Look::default() }),
    };
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let access = Access::new(listener.local_addr()?.to_string(), BUILD, HASH)?;
    access.write(access_file)?;
    let mut coordinator = Coordinator::new(plan, Past::none(Tally::new(patches, LAYOUT)));
    let mut most = 0;
    let mut trouble = Vec::new();
    let (began, wire) = (Instant::now(), loopback_bytes());
    let mut longest_turn = Duration::ZERO;
    let mut turned = Instant::now();
    let owner = |coordinator: &Coordinator| {
        most = most.max(coordinator.progress().workers);
        longest_turn = longest_turn.max(turned.elapsed());
        turned = Instant::now();
        Wish::Continue
    };
    let ending =
        serve(listener, &access, &mut coordinator, owner, |notice| trouble.push(notice.to_string()))?;
    let (seconds, wire) = (began.elapsed().as_secs_f64(), loopback_bytes() - wire);
    let (cpu, peak) = (cpu_seconds()?, status("VmHWM"));
    fs::remove_file(access_file)?;
    let effort = coordinator.effort();
    let past = coordinator.into_past();
    let mut walked: Vec<u64> = past.workers.iter().map(|worker| worker.walks).collect();
    walked.sort_unstable();
    let results: u64 = past.workers.iter().map(|worker| worker.leases).sum();
    let complete =
        ending == Ending::BudgetSpent && *past.tally == with(Tally::new(patches, LAYOUT), &(0..walks));
    let one = 16 * 2 * patches;
    println!(
        "{{\"workers\": {most}, \"patches\": {patches}, \"seconds\": {seconds:.1}, \"results\": {results}, \
         \"results_per_second\": {:.1}, \"megabytes_per_second\": {:.1}, \"cpu_per_result_ms\": {:.3}, \
         \"cpu\": {:.3}, \"longest_turn_ms\": {:.0}, \"memory_mb\": {:.1}, \"allowed_mb\": {:.1}, \
         \"least_walked\": {:.3}, \"lost_workers\": {}, \"streams_again\": {}, \"complete\": {complete}}}",
        results as f64 / seconds,
        wire as f64 / seconds / 1e6,
        1e3 * cpu / results as f64,
        cpu / seconds,
        1e3 * longest_turn.as_secs_f64(),
        (peak - bare) as f64 / 1e6,
        (3 * one + most * (64 << 10)) as f64 / 1e6,
        walked[0] as f64 / walked[walked.len() / 2] as f64,
        effort.workers_lost,
        effort.streams_reissued,
    );
    trouble.iter().take(5).for_each(|notice| eprintln!("{notice}"));
    if complete { Ok(()) } else { Err("the tally is not that of all streams".into()) }
}

/// The value of a line of `/proc/self/status` [bytes].
fn status(name: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kilobytes| kilobytes.parse::<u64>().ok()).unwrap_or(0) * 1024
}

/// The processor time of this process [s].
fn cpu_seconds() -> Result<f64, Box<dyn Error>> {
    let stat = fs::read_to_string("/proc/self/stat")?;
    // The fields follow the name, which may hold blanks: user and system time are fields 14 and 15, in hundredths of a
    // second.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    Ok((fields[11].parse::<f64>()? + fields[12].parse::<f64>()?) / 100.0)
}

/// The bytes that loopback has carried; those of this namespace alone, if `scripts/load.sh` could make one.
fn loopback_bytes() -> u64 {
    let table = fs::read_to_string("/proc/net/dev").unwrap_or_default();
    let line = table.lines().find_map(|line| line.trim().strip_prefix("lo:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|bytes| bytes.parse().ok()).unwrap_or(0)
}

// ---- a relay ----

fn relay_between(access_file: &Path, out_access_file: &Path) -> Done {
    let bare = status("VmRSS");
    let access = await_access(access_file);
    let name = format!("relay {}", std::process::id());
    let identity = WorkerIntroduction { build: BUILD.into(), name, threads: 0, leave: || false };
    let mut patches = 0;
    let mut trouble = 0;
    let began = Instant::now();
    let build = |job: &[u8]| {
        let synthetic = Synthetic::of(job, 0.0)?;
        patches = synthetic.patches;
        Ok(synthetic)
    };
    let open = |_| {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let own = Access::new(listener.local_addr()?.to_string(), BUILD, HASH)?;
        own.write(out_access_file)?;
        Ok((listener, own))
    };
    relay(&access, &identity, build, open, |_| trouble += 1)?;
    println!(
        "{{\"relay\": {}, \"cpu\": {:.3}, \"memory_mb\": {:.1}, \"three_tallies_mb\": {:.1}, \"trouble\": {trouble}}}",
        std::process::id(),
        cpu_seconds()? / began.elapsed().as_secs_f64(),
        (status("VmHWM") - bare) as f64 / 1e6,
        (3 * 16 * 2 * patches) as f64 / 1e6,
    );
    Ok(())
}

/// Waits for the access file to be written.
fn await_access(file: &Path) -> Access {
    loop {
        match Access::read(file) {
            Ok(access) => return access,
            Err(_) => thread::sleep(Duration::from_millis(100)),
        }
    }
}

// ---- the workers ----

struct Synthetic {
    patches: usize,
    /// The walks per second of the worker.
    rate: f64,
}

impl Synthetic {
    /// The synthetic work of a job, read from its encoding.
    fn of(job: &[u8], rate: f64) -> Result<Self, String> {
        let patches = std::str::from_utf8(job).ok().and_then(|text| text.parse().ok());
        Ok(Synthetic { patches: patches.ok_or("no number of patches")?, rate })
    }
}

impl Work for Synthetic {
    /// The walks that were "shot".
    type Board = Range<u64>;

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: HASH, job: HASH }
    }

    fn empty(&self) -> Tally {
        Tally::new(self.patches, LAYOUT)
    }

    fn board(&self) -> Range<u64> {
        0..0
    }

    fn shoot(&self, walks: Range<u64>, board: &mut Range<u64>) {
        thread::sleep(Duration::from_secs_f64((walks.end - walks.start) as f64 / self.rate));
        let start = if board.is_empty() { walks.start } else { board.start };
        *board = start..walks.end;
    }

    fn hand_over(&self, board: &mut Range<u64>, total: &mut Tally) -> Result<(), Overflow> {
        let walks = std::mem::replace(board, 0..0);
        *total = with(std::mem::replace(total, Tally::new(0, LAYOUT)), &walks);
        Ok(())
    }
}

fn work_many(access_file: &Path, workers: usize, rate: f64) -> Done {
    let access = await_access(access_file);
    let failed = thread::scope(|scope| {
        let access = &access;
        let threads: Vec<_> = (0..workers)
            .map(|n| {
                // Workers join one after the other, as machines would, so that their first results do not come all at once, and two busy cores
                // still answer each within the seconds that a stranger has.
                thread::sleep(Duration::from_secs_f64((10.0 / workers as f64).max(0.15)));
                scope.spawn(move || {
                    let name = format!("synthetic {}:{n}", std::process::id());
                    let identity =
                        WorkerIntroduction { build: BUILD.into(), name, threads: 1, leave: || false };
                    // Some workers are half as fast as others.
                    let rate = rate * (1.0 - 0.5 * n as f64 / workers as f64);
                    work(access, &identity, |job| Synthetic::of(job, rate), || 0.0)
                })
            })
            .collect();
        let ends: Vec<_> = threads.into_iter().map(|thread| thread.join().expect("no panic")).collect();
        ends.into_iter().filter_map(Result::err).map(|error| error.to_string()).collect::<Vec<_>>()
    });
    match failed.first() {
        None => Ok(()),
        Some(first) => Err(format!("{} workers failed; the first: {first}", failed.len()).into()),
    }
}
