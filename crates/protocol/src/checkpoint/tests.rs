use super::*;
use crate::codec::pack;
use crate::deliveries::{Delivery, Growing};

const PAIR: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };
const SCENE: [u8; 32] = [2; 32];

fn tally(walks: u64, sums: &[u128]) -> Tally {
    let counts = Counts {
        walks,
        rays: 250,
        absorbed: walks - 10,
        absorbed_back: 1,
        escaped: 9,
        escaped_weight: [9 << 40, 1, 0],
        ..Counts::default()
    };
    Tally::from_parts(counts, sums.len() / 2, PAIR, sums.to_vec()).unwrap()
}

fn delivered(walks: u64, digest: Digest) -> Deliveries {
    Delivery::lease(walks, 0, digest).into()
}

/// An out-of-order range of ten walks.
fn range(sums: usize) -> OutOfOrderRange {
    let counts = Counts { walks: 10, rays: 20, absorbed: 10, ..Counts::default() };
    let tally = Tally::from_parts(counts, sums / 2, PAIR, vec![3; sums]).unwrap();
    let deliveries = delivered(10, Digester::new(&SCENE).digest(&tally));
    OutOfOrderRange { first: 200, counts: Box::new(counts.to_array()), sums: pack(tally.sums()), deliveries }
}

fn of(tally: Tally) -> Checkpoint {
    let digest = Digester::new(&SCENE).digest(&tally);
    let deliveries = delivered(tally.counts.walks, digest);
    let worker = Contributor { name: "here:1".into(), walks: tally.counts.walks, leases: 1, faults: 0 };
    let book = Book {
        parts: vec![WalkRange { job_hash: [1; 32], seed: 42, first: 7, deliveries }],
        out_of_order: vec![],
        workers: vec![worker],
        looks: vec![Look { walks: 50, median_relative_error: 0.1, promising: true, ..Look::default() }],
        goal: [3; 32],
        effort: Effort { seconds: 1.5, workers_seen: 2, ..Effort::default() },
        sessions: vec![Session { host: "here".into(), build: "0.1".into(), began: 1, ended: 2 }],
        job: b"a job"[..].into(),
    };
    Checkpoint { scene_hash: SCENE, tally: tally.into(), book }
}

fn checkpoint() -> Checkpoint {
    of(tally(100, &[1, 2, 3, 4, u128::MAX, 1 << 100]))
}

fn bytes_of(checkpoint: &Checkpoint) -> Vec<u8> {
    let mut bytes = Vec::new();
    checkpoint.write(&mut bytes).unwrap();
    bytes
}

fn bytes() -> Vec<u8> {
    bytes_of(&checkpoint())
}

fn parse(bytes: &[u8]) -> Result<Checkpoint, CheckpointFault> {
    let parsed = super::parse(bytes, bytes.len() as u64);
    let proved = Checkpoint::prove(bytes, bytes.len() as u64);
    assert_eq!(format!("{:?}", parsed.as_ref().err()), format!("{:?}", proved.err()));
    parsed
}

fn fault_of(bytes: &[u8]) -> CheckpointFault {
    parse(bytes).unwrap_err()
}

#[test]
fn what_was_written_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("tally.bin");
    fs::write(&path, bytes()).unwrap();
    assert_eq!(Checkpoint::read(&path).unwrap(), checkpoint());
}

#[test]
fn more_sums_than_one_chunk_are_read_in_order() {
    let sums: Vec<u128> = (0..3 * CHUNK_SUMS as u128 + 2).map(|i| i << 40).collect();
    let checkpoint = of(tally(100, &sums));
    assert_eq!(parse(&bytes_of(&checkpoint)).unwrap(), checkpoint);
}

/// Every ray of a chain ends once, or every walk of a batch; nothing in between is accepted.
#[test]
fn chains_of_rays_are_read_where_every_ray_ended_once() {
    let ended = |absorbed: u64| {
        let counts = Counts { walks: 8, rays: 250, absorbed, escaped: 9, ..Counts::default() };
        let tally = Tally::from_parts(counts, 1, PAIR, vec![1, 2]).unwrap();
        parse(&bytes_of(&of(tally)))
    };
    assert!(ended(241).is_ok());
    assert!(matches!(ended(240).unwrap_err(), CheckpointFault::Contradiction(_)));
}

#[test]
fn the_bytes_are_laid_out_as_documented() {
    let bytes = bytes();
    assert_eq!(&bytes[..24], b"RWTALLY\0\x05\0\0\0\x01\x02\0\0\x03\0\0\0\0\0\0\0");
    let book = u64::from_le_bytes(bytes[24..32].try_into().unwrap()) as usize;
    assert_eq!(bytes.len(), HEADER_BYTES + 6 * 16 + book + HASH_BYTES);
    assert_eq!(bytes[32..64], SCENE);
    assert_eq!(bytes[64..80], 100_u128.to_le_bytes());
    assert_eq!(bytes[128..144], 9_u128.to_le_bytes());
    assert_eq!(bytes[304..320], 1_u128.to_le_bytes());
}

#[test]
fn other_files_and_formats_are_refused() {
    assert!(matches!(fault_of(b""), CheckpointFault::Magic));
    assert!(matches!(fault_of(b"patch,surface,u,v"), CheckpointFault::Magic));
    let mut newer = bytes();
    for version in [0, 1, 2, 3, 6] {
        newer[8] = version;
        assert!(matches!(fault_of(&newer), CheckpointFault::Version(of) if of == u32::from(version)));
    }
}

#[test]
fn a_file_of_any_other_length_is_refused() {
    let whole = bytes();
    for length in MAGIC.len()..whole.len() {
        assert!(matches!(fault_of(&whole[..length]), CheckpointFault::Length { .. }), "{length}");
    }
    assert!(matches!(fault_of(&[&whole[..], b"x"].concat()), CheckpointFault::Length { .. }));
    let mut huge = whole;
    huge[16..24].fill(0xFF);
    assert!(matches!(fault_of(&huge), CheckpointFault::Length { expected: u64::MAX, .. }));
}

#[test]
fn any_flipped_bit_is_noticed() {
    let whole = bytes();
    for byte in 0..whole.len() {
        for bit in 0..8 {
            let mut changed = whole.clone();
            changed[byte] ^= 1 << bit;
            assert!(parse(&changed).is_err(), "bit {bit} of byte {byte}");
        }
    }
    let mut changed = whole;
    changed[130] ^= 1;
    assert!(matches!(fault_of(&changed), CheckpointFault::Checksum));
}

/// Memory that fails before the checksum is taken would leave such sums.
#[test]
fn sums_that_were_not_delivered_are_refused_though_the_checksum_is_right() {
    let contradicts = |change: &dyn Fn(&mut Checkpoint)| {
        let mut checkpoint = checkpoint();
        change(&mut checkpoint);
        assert!(matches!(fault_of(&bytes_of(&checkpoint)), CheckpointFault::Contradiction(_)));
    };
    contradicts(&|checkpoint| Arc::make_mut(&mut checkpoint.tally).counts.rays ^= 1 << 20);
    contradicts(&|checkpoint| Arc::make_mut(&mut checkpoint.tally).counts.walks += 1);
    contradicts(&|checkpoint| checkpoint.tally = tally(100, &[1, 2, 3, 5, u128::MAX, 1 << 100]).into());
    contradicts(&|checkpoint| checkpoint.book.parts[0].deliveries = delivered(99, 7));
    contradicts(&|checkpoint| checkpoint.book.parts[0].deliveries.rename(|_| 1));
    contradicts(&|checkpoint| checkpoint.book.parts.clear());
}

#[test]
fn what_waits_beyond_a_gap_is_kept_and_believed_where_it_was_delivered() {
    let mut checkpoint = checkpoint();
    checkpoint.book.out_of_order = vec![range(6)];
    assert_eq!(parse(&bytes_of(&checkpoint)).unwrap(), checkpoint);
    let contradicts = |change: &dyn Fn(&mut OutOfOrderRange)| {
        let mut checkpoint = checkpoint.clone();
        change(&mut checkpoint.book.out_of_order[0]);
        assert!(matches!(fault_of(&bytes_of(&checkpoint)), CheckpointFault::Contradiction(_)));
    };
    contradicts(&|range| range.sums[0] ^= 1);
    contradicts(&|range| range.sums.clear());
    contradicts(&|range| range.counts[0] = u128::MAX);
    contradicts(&|range| range.deliveries = Deliveries::default());
    contradicts(&|changed| *changed = range(4));
}

/// Files may be forged together with their checksums.
#[test]
fn a_tally_without_sums_or_with_a_book_that_claims_too_much_is_refused() {
    let forge = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes();
        bytes.truncate(bytes.len() - HASH_BYTES);
        change(&mut bytes);
        bytes.extend(*blake3::hash(&bytes).as_bytes());
        assert!(matches!(fault_of(&bytes), CheckpointFault::Contradiction(_)));
    };
    forge(&|bytes| {
        bytes[12..16].fill(0);
        bytes.drain(HEADER_BYTES..HEADER_BYTES + 6 * 16);
    });
    let book = HEADER_BYTES + 6 * 16;
    forge(&|bytes| bytes[book..book + 9].copy_from_slice(&[253, 0, 0, 0, 0, 0, 0, 0, 1]));
}

/// A book of 45 million leases, as a run of weeks has. If each lease kept an entry, the file would take almost a
/// gigabyte.
#[test]
fn the_book_of_a_run_of_weeks_is_small_and_read_back() {
    let mut growing = Growing::new(Deliveries::default(), 0, 1);
    let leases = 45_000_000_u64;
    (0..leases).for_each(|n| growing.push(Delivery::lease(1 << 24, (n % 10_000) as u32, 1)));
    let walks = leases << 24;
    let counts = Counts { walks, rays: walks, absorbed: walks, ..Counts::default() };
    let mut checkpoint = of(Tally::from_parts(counts, 1, PAIR, vec![0, 0]).unwrap());
    checkpoint.book.parts[0].deliveries = growing.into_deliveries();
    let workers =
        (0..10_000).map(|n| Contributor { name: format!("node{n}:4711"), ..Contributor::default() });
    checkpoint.book.workers = workers.collect();
    let mut bytes = Vec::new();
    checkpoint.write(&mut bytes).unwrap();
    assert!(bytes.len() < 2 << 20, "{} bytes", bytes.len());
    // The digests of these leases are made up.
    assert!(matches!(
        fault_of(&bytes),
        CheckpointFault::Contradiction("its sums are not those that were delivered")
    ));
}

#[test]
fn foreign_tallies_are_refused_by_name() {
    let fault = |scene, job, first| checkpoint().check_job(scene, job, first).unwrap_err();
    assert!(checkpoint().check_job(&SCENE, &[1; 32], 7).is_ok());
    assert!(matches!(fault(&SCENE, &[9; 32], 7), CheckpointFault::ForeignJob));
    assert!(matches!(fault(&SCENE, &[1; 32], 0), CheckpointFault::ForeignJob));
    assert!(matches!(fault(&[9; 32], &[1; 32], 7), CheckpointFault::ForeignScene));
    let missing = Checkpoint::read(Path::new("/nowhere/none.bin")).unwrap_err();
    assert!(missing.to_string().contains("none.bin"), "{missing}");
    assert!(matches!(missing.fault, CheckpointFault::Io(_)));
}
