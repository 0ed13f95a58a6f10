//! `pilot.arrivals.bin`: the groups of a control that is under way, each as it ends, so that one that is stopped goes on from there.
//!
//! A record is the length of its content, a digest of that and of the control, and the content. What a process or a machine that stopped has left half
//! written is found by its digest, as are the records of another control, and is walked again.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use radiosity::rays::Arrival;

/// The file of a control that is under way.
pub(crate) const ARRIVALS: &str = "pilot.arrivals.bin";

/// Groups that end sooner in a choice that was not resumed are not kept: few are killed so early, and a group takes about as long to keep as to walk.
const SOON: Duration = Duration::from_secs(1);

/// The arrivals of a group, and its walks and rays.
pub(crate) type GroupArrivals = (Vec<Arrival>, [u64; 2]);

/// What the groups of a control are kept in.
pub(crate) struct ArrivalsFile {
    control: [u8; 32],
    file: Mutex<File>,
    /// From when on groups are kept.
    from: Instant,
}

impl ArrivalsFile {
    /// Opens the file of a control, in a choice that may be `resumed`. Returns the groups that it holds, too, by their numbers.
    ///
    /// # Errors
    /// Those of the operating system.
    pub(super) fn open(
        path: &Path,
        control: [u8; 32],
        resumed: bool,
    ) -> io::Result<(Self, Vec<(usize, GroupArrivals)>)> {
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let (mut rest, mut groups) = (&bytes[..], Vec::new());
        while let Some((group, behind)) = read(control, rest) {
            groups.push(group);
            rest = behind;
        }
        if !rest.is_empty() {
            file.set_len((bytes.len() - rest.len()) as u64)?;
        }
        let from = if resumed { Instant::now() } else { Instant::now() + SOON };
        Ok((ArrivalsFile { control, file: file.into(), from }, groups))
    }

    /// Keeps a group that has ended. A kill loses no more than it; a loss of power may.
    ///
    /// # Errors
    /// Those of the operating system.
    pub(crate) fn keep(&self, number: usize, group: &GroupArrivals) -> io::Result<()> {
        if Instant::now() < self.from {
            return Ok(());
        }
        let content = pack(number, group);
        let mut record = (content.len() as u64).to_le_bytes().to_vec();
        record.extend(seal(self.control, &content));
        record.extend(content);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let whole = file.metadata()?.len();
        let written = file.write_all(&record);
        if written.is_err() {
            // A part of a record would hide those that follow.
            file.set_len(whole)?;
        }
        written
    }
}

/// The digest by which a record is known.
fn seal(control: [u8; 32], content: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&control).update(content);
    hasher.finalize().into()
}

/// The bytes of a group: its number, walks and rays, then the piece, the place and the weights of each arrival.
fn pack(number: usize, (arrivals, counts): &GroupArrivals) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(24 + 44 * arrivals.len());
    [number as u64, counts[0], counts[1]].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
    for Arrival { piece, uv, weights } in arrivals {
        bytes.extend(piece.to_le_bytes());
        uv.iter().chain(weights).for_each(|x| bytes.extend(x.to_bits().to_le_bytes()));
    }
    bytes
}

/// The group at the front of some records, and what follows it.
fn read(control: [u8; 32], bytes: &[u8]) -> Option<((usize, GroupArrivals), &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    let (sealed, rest) = rest.split_first_chunk::<32>()?;
    let (content, behind) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    (seal(control, content) == *sealed).then_some(())?;
    let (heading, arrivals) = content.split_first_chunk::<24>()?;
    let [number, walks, rays] = std::array::from_fn(|i| word(&heading[8 * i..]));
    let arrival = |bytes: &[u8]| Arrival {
        piece: u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")),
        uv: std::array::from_fn(|i| f64::from_bits(word(&bytes[4 + 8 * i..]))),
        weights: std::array::from_fn(|i| f64::from_bits(word(&bytes[20 + 8 * i..]))),
    };
    let arrivals = arrivals.chunks_exact(44).map(arrival).collect();
    Some(((number as usize, (arrivals, [walks, rays])), behind))
}

fn word(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(of: usize) -> GroupArrivals {
        let arrival = |i: usize| Arrival {
            piece: i as u32,
            uv: [0.1 * of as f64, -0.0],
            weights: [1.0, f64::MIN_POSITIVE, 1e300],
        };
        ((0..of).map(arrival).collect(), [of as u64, 3])
    }

    /// Whole records are found again; a half one, a changed one and those of another control are not.
    #[test]
    fn groups_are_found_again_up_to_the_first_that_is_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(ARRIVALS);
        let write = |from: usize| {
            let (file, groups) = ArrivalsFile::open(&path, [7; 32], true).unwrap();
            (from..4).for_each(|n| file.keep(n, &group(n)).unwrap());
            groups
        };
        assert!(write(0).is_empty());
        let whole = std::fs::read(&path).unwrap();
        assert_eq!(write(4), (0..4).map(|n| (n, group(n))).collect::<Vec<_>>());
        for place in [8, 40, 64, 200, whole.len() - 1] {
            let mut changed = whole.clone();
            changed[place] ^= 1;
            for damaged in [&whole[..place], &changed] {
                std::fs::write(&path, damaged).unwrap();
                let found = write(4);
                assert!(found.len() < 4 && found.iter().all(|(n, found)| *found == group(*n)), "{place}");
                write(found.len());
                assert_eq!(std::fs::read(&path).unwrap(), whole, "{place}");
            }
        }
        assert!(ArrivalsFile::open(&path, [8; 32], true).unwrap().1.is_empty());
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 0);
    }
}
