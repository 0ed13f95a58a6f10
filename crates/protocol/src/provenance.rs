//! The provenance of a relay's lease: the parts that the relay's own workers brought, each with its digest.
//!
//! A relay sends the provenance with the result. The coordinator enters the parts in its book under names such as
//! `relay a:7 > b:9`, so that an audit can trace single leases behind relays and name their workers. The coordinator
//! checks that the parts make up the result; which worker brought a part is the relay's word, which cannot be checked.

use std::collections::HashMap;

use bincode::{Decode, Encode};

use crate::deliveries::{Deliveries, Delivery};
use crate::digest::{self, Digest};
use crate::roster::{Contributor, Roster};

/// The most characters of a peer's name that are kept.
pub(crate) const NAME_CHARS: usize = 80;

/// The most processes, one behind the other, that a name on its way up tells of. Those further down are left out.
const MOST_LEVELS: usize = 8;

/// The most bytes of all names in one result. Parts of workers whose names do not fit are entered as the relay's.
const MOST_NAME_BYTES: usize = 1 << 14;

/// The most bytes of a part in a message (three numbers of 64 bits, one of 32 bits and a byte), and of the length
/// before a name.
const PART_BYTES: usize = 3 * 9 + 5 + 1;
const NAME_LENGTH_BYTES: usize = 3;

/// The most bytes of a provenance in a message.
pub(crate) const MOST_BYTES: usize =
    2 * NAME_LENGTH_BYTES + Deliveries::MOST_PARTS * (PART_BYTES + NAME_LENGTH_BYTES) + MOST_NAME_BYTES;

/// The parts of a relay's lease, in the order of walks; a worker's lease has none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct LeaseProvenance {
    /// The names of the workers of the parts, as the relay calls them.
    pub names: Vec<String>,
    /// The parts of the lease. Their workers are places among `names`, or [`Delivery::SEVERAL`] if the relay names none.
    pub parts: Vec<Delivery>,
}

impl LeaseProvenance {
    /// The provenance of a lease that `workers` brought in at most [`Deliveries::MOST_PARTS`] parts.
    pub fn new(deliveries: &Deliveries, workers: &[Contributor]) -> Self {
        let entries = deliveries.entries();
        // An audit traces single leases first, so their workers are named first.
        let (single, folded): (Vec<&Delivery>, Vec<&Delivery>) =
            entries.iter().partition(|entry| entry.spared);
        let (mut names, mut places) = (Vec::new(), HashMap::new());
        let mut room = MOST_NAME_BYTES;
        for entry in single.into_iter().chain(folded).filter(|entry| entry.worker != Delivery::SEVERAL) {
            let name = upper_levels(&workers[entry.worker as usize].name);
            if name.len() <= room && !places.contains_key(name) {
                room -= name.len();
                places.insert(name, names.len() as u32);
                names.push(name.to_owned());
            }
        }
        let named = |worker: u32| {
            let name = workers.get(worker as usize).map(|worker| upper_levels(&worker.name));
            name.and_then(|name| places.get(name).copied()).unwrap_or(Delivery::SEVERAL)
        };
        let parts = entries.iter().map(|&entry| Delivery { worker: named(entry.worker), ..entry }).collect();
        LeaseProvenance { names, parts }
    }

    /// Why these cannot be the parts of a result, if they cannot.
    pub fn breach(&self, walks: u64, digest: Digest) -> Option<&'static str> {
        let known = |worker: u32| worker == Delivery::SEVERAL || (worker as usize) < self.names.len();
        let is_sound = |part: &Delivery| {
            let leases = if part.spared { 1..=1 } else { 1..=part.walks };
            leases.contains(&part.leases)
                && part.walks > 0
                && digest::is_one(part.digest)
                && known(part.worker)
        };
        let all = || self.parts.iter();
        match () {
            () if self.parts.len() > Deliveries::MOST_PARTS => Some("it is in too many parts"),
            () if self.names.len() > self.parts.len() => Some("it names more workers than it has parts"),
            () if self.names.iter().map(String::len).sum::<usize>() > MOST_NAME_BYTES => {
                Some("the names of its workers are too long")
            }
            () if !self.names.iter().all(|name| is_name(name)) => {
                Some("the name of one of its workers is not valid")
            }
            () if !all().all(is_sound) => Some("a part of it is not valid"),
            () if all().map(|part| u128::from(part.walks)).sum::<u128>() != u128::from(walks) => {
                Some("the walks of its parts do not add up to its own")
            }
            () if all().fold(0, |sum, part| digest::add(sum, part.digest)) != digest => {
                Some("the digests of its parts do not add up to that of its sums")
            }
            () => None,
        }
    }

    /// The parts as entries of a book whose roster knows the relay as `relay`.
    pub fn entered(self, relay: &str, roster: &mut Roster) -> Vec<Delivery> {
        let numbers: Vec<u32> = self.names.iter().map(|name| roster.number_behind(relay, name)).collect();
        let mut number =
            |worker: u32| numbers.get(worker as usize).copied().unwrap_or_else(|| roster.number(relay));
        self.parts.into_iter().map(|part| Delivery { worker: number(part.worker), ..part }).collect()
    }
}

/// A peer's name as it is kept and shown: short, and without characters that have a meaning on terminals or between
/// relays.
pub(crate) fn plain_name(name: &str) -> String {
    name.chars().filter(|&c| is_plain(c)).take(NAME_CHARS).collect()
}

fn is_plain(c: char) -> bool {
    !c.is_control() && c != '>'
}

/// A name cut to its first [`MOST_LEVELS`] levels.
fn upper_levels(name: &str) -> &str {
    name.match_indices(Contributor::BEHIND).nth(MOST_LEVELS - 1).map_or(name, |(end, _)| &name[..end])
}

/// Whether a name has the form that relays give to workers.
fn is_name(name: &str) -> bool {
    let mut levels = name.split(Contributor::BEHIND);
    let is_level = |level: &str| level.chars().all(is_plain) && level.chars().count() <= NAME_CHARS;
    levels.by_ref().take(MOST_LEVELS).all(is_level) && levels.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::encode;
    use crate::deliveries::Growing;

    fn workers(names: &[&str]) -> Vec<Contributor> {
        names.iter().map(|&name| Contributor { name: name.into(), ..Contributor::default() }).collect()
    }

    fn deliveries(parts: impl IntoIterator<Item = Delivery>) -> Deliveries {
        let mut growing = Growing::new(Deliveries::default(), 0, 1);
        parts.into_iter().for_each(|part| growing.push(part));
        growing.into_deliveries()
    }

    /// Three leases of two workers, as their relay reports them.
    fn sound() -> LeaseProvenance {
        let parts = [(10, 1, 5), (20, 0, 6), (30, 1, 7)];
        let parts = parts.map(|(walks, worker, digest)| Delivery::lease(walks, worker, digest));
        LeaseProvenance::new(&deliveries(parts), &workers(&["unused", "b:1"]))
    }

    #[test]
    fn parts_are_entered_under_the_name_of_their_relay() {
        let sound = sound();
        assert_eq!(sound.breach(60, 18), None);
        assert_eq!(sound.names, ["b:1", "unused"]);
        let mut roster = Roster::new(workers(&["direct"]));
        let entered = sound.entered("relay a", &mut roster);
        let name = |part: &Delivery| roster.workers()[part.worker as usize].name.clone();
        let named: Vec<_> = entered.iter().map(|part| (name(part), part.walks, part.digest)).collect();
        let (b, other) = ("relay a > b:1", "relay a > unused");
        assert_eq!(named, [(b.into(), 10, 5), (other.into(), 20, 6), (b.into(), 30, 7)]);
        // A part without a worker's name is entered as the relay's own.
        let several = Delivery { worker: Delivery::SEVERAL, ..Delivery::lease(3, 0, 1) };
        let of_many = LeaseProvenance::new(&deliveries([several]), &[]);
        assert_eq!((of_many.breach(3, 1), of_many.names.len()), (None, 0));
        let entered = of_many.entered("relay a", &mut roster);
        assert_eq!(roster.workers()[entered[0].worker as usize].name, "relay a");
    }

    #[test]
    fn parts_that_are_not_those_of_the_result_are_refused() {
        let refused = |change: &dyn Fn(&mut LeaseProvenance)| {
            let mut changed = sound();
            change(&mut changed);
            changed.breach(60, 18).expect("a breach")
        };
        assert!(refused(&|changed| changed.parts.clear()).contains("more workers than"));
        assert!(refused(&|changed| _ = changed.parts.pop()).contains("do not add up to its own"));
        assert!(refused(&|changed| changed.parts[0].walks = u64::MAX).contains("do not add up to its own"));
        assert!(refused(&|changed| changed.parts[0].digest += 1).contains("digests"));
        assert!(refused(&|changed| changed.parts[0].digest = u64::MAX).contains("a part of it"));
        assert!(refused(&|changed| changed.parts[0].leases = 2).contains("a part of it"));
        assert!(refused(&|changed| changed.parts[0].leases = 0).contains("a part of it"));
        assert!(refused(&|changed| changed.parts[0].worker = 2).contains("a part of it"));
        let folded = |leases| Delivery { leases, spared: false, ..Delivery::lease(10, 0, 5) };
        assert!(refused(&|changed| changed.parts[0] = folded(11)).contains("a part of it"));
        assert!(refused(&|changed| changed.parts[0].walks = 0).contains("a part of it"));
        assert!(
            refused(&|changed| changed.parts = vec![folded(1); Deliveries::MOST_PARTS + 1])
                .contains("too many parts")
        );
        let long = "x".repeat(NAME_CHARS + 1);
        for name in ["a\nb", "a>b", &long[..], &["a"; MOST_LEVELS + 1].join(Contributor::BEHIND)] {
            assert!(
                refused(&|changed| changed.names[0] = name.into()).contains("name of one of its workers"),
                "{name}"
            );
        }
        for name in ["", "a b", &["a"; MOST_LEVELS].join(Contributor::BEHIND), &long[1..]] {
            assert!(is_name(name) && is_name(&plain_name(name)), "{name}");
        }
        let many = LeaseProvenance {
            names: vec![[&long[1..]; 4].join(Contributor::BEHIND); 60],
            parts: vec![folded(1); 60],
        };
        assert!(many.breach(600, 300).unwrap().contains("too long"));
    }

    /// However many workers a relay has and whatever their names, its provenance is valid and fits into a frame.
    #[test]
    fn what_a_relay_tells_is_bounded() {
        let deep = |n: usize| vec![format!("{n:080}"); 12].join(Contributor::BEHIND);
        let names: Vec<String> = (0..1000).map(deep).collect();
        let workers = workers(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let far = |n: u32| Delivery::lease(1 << 50, n, (1 << 61) - 2 - u64::from(n));
        let mut growing = Growing::new(Deliveries::default(), 0, 1);
        (0..1000).for_each(|n| growing.push(far(n)));
        growing.fold_to(Deliveries::MOST_PARTS);
        let (deliveries, all) = (growing.deliveries(), LeaseProvenance::new(growing.deliveries(), &workers));
        assert!(all.parts.len() <= Deliveries::MOST_PARTS && !all.names.is_empty());
        assert_eq!(all.breach(1000 << 50, deliveries.digest()), None);
        let named = |spared: bool| {
            let named = all.parts.iter().filter(|part| part.worker != Delivery::SEVERAL);
            named.filter(|part| part.spared == spared).count()
        };
        assert_eq!((named(true), named(false)), (all.names.len(), 0), "single leases first");
        let bytes = encode(&all).unwrap().len();
        assert!(bytes <= MOST_BYTES, "{bytes}");
    }
}
