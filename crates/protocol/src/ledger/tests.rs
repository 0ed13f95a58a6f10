use super::*;
use crate::codec::pack;
use crate::digest::Digester;
use radiosity::{Counts, Layout};

const PAIR: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };

/// A stand-in tally: patch sums are functions of the walk numbers, so that any mix-up shows.
fn tally(range: &Range<u64>) -> Tally {
    let counts = Counts { walks: range.end - range.start, rays: range.clone().sum(), ..Counts::default() };
    let sums = vec![range.clone().map(u128::from).sum(), range.clone().map(|n| u128::from(n * n)).sum()];
    Tally::from_parts(counts, 1, PAIR, sums).unwrap()
}

fn ledger(total: u64, stream: u64, looks: &[u64]) -> Ledger {
    Ledger::new(total, stream, looks.to_vec(), Tally::new(1, PAIR).into(), Deliveries::default())
}

const DIGESTER: fn() -> Digester = || Digester::new(&[5; 32]);

fn parcel(tally: &Tally) -> Parcel {
    let digest = DIGESTER().digest(tally);
    Parcel::new(tally.counts, pack(tally.sums()), digest, &DIGESTER()).unwrap()
}

/// Takes a result from the worker of that number.
fn take(books: &mut Ledger, id: LeaseId, tally: &Tally, worker: u32) -> Result<(), Rejected> {
    let parcel = parcel(tally);
    let brought = Delivery::lease(tally.counts.walks, worker, parcel.digest());
    books.accept(id, parcel, &[brought])
}

fn accept(books: &mut Ledger, id: LeaseId, range: &Range<u64>) -> Result<(), Rejected> {
    take(books, id, &tally(range), 7)
}

/// Every walk of the prefix belongs to one delivery, with the digest it came with.
fn assert_accounted(books: &Ledger) {
    let mut next = 0;
    for &Delivery { walks, worker, digest: kept, .. } in books.deliveries().entries() {
        assert_eq!((worker, kept), (7, DIGESTER().digest(&tally(&(next..next + walks)))));
        next += walks;
    }
    assert_eq!(next, books.prefix_walks());
}

#[test]
fn any_order_of_arrival_and_loss_gives_the_same_tally() {
    let mut state = 1_u64;
    let mut random = |n: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % n
    };
    for stream in [1, 7, 64, 1000] {
        for _ in 0..100 {
            let mut books = ledger(500, stream, &[100, 333, 500]);
            let mut out: Vec<(LeaseId, Range<u64>)> = Vec::new();
            let (mut looked, mut taken) = (Vec::new(), Vec::new());
            let mut steps = 0;
            while !books.is_complete() {
                steps += 1;
                assert!(steps < 100_000, "a walk was lost for ever: {books:?}");
                match random(5) {
                    0 | 1 => out.extend(books.lease(random(90))),
                    4 if !out.is_empty() => {
                        let (id, range) = out[random(out.len() as u64) as usize].clone();
                        let again = books.lease_again(id);
                        assert_eq!(again.as_ref().map(|(_, range)| range), books.range(id).as_ref());
                        assert!(again.as_ref().is_none_or(|(other, again)| *other != id && *again == range));
                        out.extend(again);
                    }
                    2 if !out.is_empty() => {
                        let (id, range) = out.swap_remove(random(out.len() as u64) as usize);
                        let first = !taken.contains(&range.start);
                        taken.extend(first.then_some(range.start));
                        let accepted = accept(&mut books, id, &range);
                        assert_eq!(accepted, if first { Ok(()) } else { Err(Rejected::NotLeased(id)) });
                        assert_eq!(accept(&mut books, id, &range), Err(Rejected::NotLeased(id)), "twice");
                        while books.advance(|_| {}).unwrap() {
                            assert_eq!(**books.prefix(), tally(&(0..books.prefix_walks())));
                            assert_accounted(&books);
                            if books.at_look() {
                                looked.push(books.prefix_walks());
                            }
                        }
                    }
                    3 if !out.is_empty() => {
                        let (id, range) = out.swap_remove(random(out.len() as u64) as usize);
                        books.lose(id);
                        assert_eq!(accept(&mut books, id, &range), Err(Rejected::NotLeased(id)), "late");
                    }
                    _ => {}
                }
            }
            assert_eq!(**books.prefix(), tally(&(0..500)));
            assert_eq!(looked, [100, 333, 500], "every look once, in order");
        }
    }
}

#[test]
fn a_result_of_other_walks_or_shape_is_refused_and_the_lease_stays_out() {
    let mut books = ledger(100, 10, &[]);
    let (id, range) = books.lease(10).unwrap();
    assert_eq!(range, 0..10);
    assert_eq!(accept(&mut books, id, &(0..9)), Err(Rejected::Walks { expected: 10, got: 9 }));
    let mut foreign = Tally::new(2, PAIR);
    foreign.counts.walks = 10;
    assert!(matches!(take(&mut books, id, &foreign, 0), Err(Rejected::Tally(MergeError::Shape(2, 4)))));
    accept(&mut books, id, &range).unwrap();
}

#[test]
fn leases_are_whole_streams_and_stop_at_looks() {
    let mut books = ledger(1000, 100, &[250]);
    assert_eq!(books.lease(1).unwrap().1, 0..100);
    assert_eq!(books.lease(1000).unwrap().1, 100..250);
    assert_eq!(books.lease(10).unwrap().1, 250..300);
    assert_eq!(books.lease(u64::MAX).unwrap().1, 300..1000);
    assert!(books.lease(1).is_none());
}

#[test]
fn a_gap_is_what_is_missing_below_results_that_are_in() {
    let mut books = ledger(400, 100, &[]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    accept(&mut books, leases[2].0, &leases[2].1).unwrap();
    let last = books.last_waiting().unwrap();
    assert_eq!(last, 300);
    assert!(books.gap_is_out(last) && !books.gap_is_lost(last));
    assert!(books.lease_gap(1, last).is_none(), "nothing was lost");
    books.lose(leases[3].0);
    assert!(!books.gap_is_lost(last), "nothing is in beyond it");
    books.lose(leases[0].0);
    books.lose(leases[1].0);
    assert!(!books.gap_is_out(last) && books.gap_is_lost(last));
    assert_eq!(books.lease_gap(1, last).unwrap().1, 0..100);
    assert_eq!(books.lease_gap(1, last).unwrap().1, 100..200);
    assert!(books.lease_gap(1, last).is_none(), "what lies beyond saves nothing");
    assert_eq!(books.walks_in(), 100);
    assert_eq!(books.unleased(), 100);
}

#[test]
fn walks_that_are_out_twice_come_in_once_and_are_lost_only_when_all_have_lost_them() {
    let mut books = ledger(300, 100, &[]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    let (copy, range) = books.lease_again(leases[1].0).unwrap();
    let (third, _) = books.lease_again(leases[1].0).unwrap();
    assert_eq!((range, books.unleased(), books.streams_reissued), (100..200, 0, 2));
    books.lose(leases[1].0);
    books.lose(third);
    assert_eq!((books.unleased(), books.streams_reissued), (0, 2), "one is still out");
    books.lose(copy);
    assert_eq!((books.unleased(), books.streams_reissued), (100, 3));
    let (id, range) = books.lease(100).unwrap();
    let (copy, _) = books.lease_again(id).unwrap();
    accept(&mut books, copy, &range).unwrap();
    assert_eq!(books.range(id), None);
    assert_eq!(accept(&mut books, id, &range), Err(Rejected::NotLeased(id)));
    books.lose(id);
    assert_eq!((books.unleased(), books.walks_in()), (0, 100), "what is in cannot be lost");
    assert_eq!(books.lease_again(id), None);
}

#[test]
fn a_range_adjoins_the_prefix_and_islands_but_across_no_look() {
    let mut books = ledger(1000, 100, &[500]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    let adjoining = |books: &Ledger| -> Vec<u64> {
        leases.iter().filter(|(_, range)| books.adjoins(range)).map(|(_, range)| range.start).collect()
    };
    assert_eq!((adjoining(&books), books.out_of_order_ranges()), (vec![0], 0));
    for n in [4, 7] {
        accept(&mut books, leases[n].0, &leases[n].1).unwrap();
    }
    assert_eq!((adjoining(&books), books.out_of_order_ranges()), (vec![0, 300, 600, 800], 2));
    for n in [6, 0] {
        accept(&mut books, leases[n].0, &leases[n].1).unwrap();
    }
    assert!(books.advance(|_| {}).unwrap());
    assert_eq!((adjoining(&books), books.out_of_order_ranges()), (vec![100, 300, 500, 800], 2));
}

#[test]
fn a_lease_beyond_all_that_is_in_fills_no_gap() {
    let mut books = ledger(400, 100, &[]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    accept(&mut books, leases[1].0, &leases[1].1).unwrap();
    books.lose(leases[0].0);
    let last = books.last_waiting().unwrap();
    assert!(books.gap_is_lost(last) && !books.gap_is_out(last), "200 … 399 are out, but save nothing");
}

#[test]
fn a_lost_lease_is_leased_again_to_its_last_part_of_a_stream() {
    let mut books = ledger(250, 100, &[]);
    let (id, range) = books.lease(250).unwrap();
    assert_eq!((range, books.unleased()), (0..250, 0));
    books.lose(id);
    assert_eq!((books.unleased(), books.streams_reissued), (250, 3));
    assert_eq!(books.lease(250).unwrap().1, 0..250);
}

#[test]
fn a_lost_lease_is_split_when_less_is_asked_for() {
    let mut books = ledger(1000, 100, &[]);
    let (id, _) = books.lease(600).unwrap();
    books.lose(id);
    assert_eq!(books.lease(100).unwrap().1, 0..100);
    assert_eq!(books.lease(900).unwrap().1, 100..600);
    assert_eq!(books.lease(900).unwrap().1, 600..1000);
    assert_eq!(books.streams_reissued, 6);
}

/// Leases `leases` streams, a thousand at a time, which come in in any order; one in fifty is lost.
fn soak(leases: u64) -> Ledger {
    let mut books = ledger(leases, 1, &[]).drawn_by(7);
    let mut out = Vec::new();
    let one = |walk: u64| {
        let counts = Counts { walks: 1, rays: walk, ..Counts::default() };
        Tally::from_parts(counts, 1, PAIR, vec![1, 1]).unwrap()
    };
    while !books.is_complete() {
        out.extend(std::iter::from_fn(|| books.lease(1)).take(1000 - out.len()));
        let (id, range) = out.swap_remove((out.len() * 7 / 11).min(out.len() - 1));
        if id % 50 == 0 {
            books.lose(id);
            continue;
        }
        take(&mut books, id, &one(range.start), (id % 300) as u32).unwrap();
        while books.advance(|_| {}).unwrap() {}
    }
    assert_eq!(books.deliveries().walks(), u128::from(leases));
    assert!(books.deliveries().entries().len() <= Deliveries::MOST);
    books
}

#[test]
fn the_books_of_a_long_run_stay_small() {
    soak(200_000);
}

/// `cargo test --release -p radwalk-protocol -- --ignored --nocapture hundred_million`
#[test]
#[ignore = "ten minutes"]
#[expect(clippy::disallowed_methods, reason = "it says how long it took")]
fn a_hundred_million_leases() {
    let began = std::time::Instant::now();
    let books = soak(100_000_000);
    let book = crate::codec::encode(books.deliveries()).unwrap();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
    println!("{:.0} s, book of {} bytes, {peak}", began.elapsed().as_secs_f64(), book.len());
    assert!(book.len() < 2 << 20);
}

#[test]
fn islands_of_a_checkpoint_are_gone_on_from_and_only_gaps_are_walked() {
    let mut books = ledger(1000, 100, &[500]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    for n in [0, 2, 3, 6, 5] {
        accept(&mut books, leases[n].0, &leases[n].1).unwrap();
    }
    while books.advance(|_| {}).unwrap() {}
    let out_of_order = books.kept_out_of_order(usize::MAX);
    let places =
        |out_of_order: &[OutOfOrderRange]| out_of_order.iter().map(|range| range.first).collect::<Vec<_>>();
    assert_eq!(places(&out_of_order), [200, 500]);
    assert_eq!(places(&books.kept_out_of_order(1)), [200], "as far as there is room, one at least");
    let resumed = |total: u64, looks: &[u64]| {
        let (prefix, deliveries) = (books.prefix().clone(), books.deliveries().clone());
        Ledger::new(total, 100, looks.to_vec(), prefix, deliveries)
            .with_out_of_order(&out_of_order, &DIGESTER())
    };
    let mut again = resumed(1000, &[500]);
    assert_eq!((again.walks_in(), again.unleased()), (500, 500));
    let gaps: Vec<_> = std::iter::from_fn(|| again.lease(1000)).collect();
    let ranges: Vec<_> = gaps.iter().map(|(_, range)| range.clone()).collect();
    assert_eq!(ranges, [100..200, 400..500, 700..1000]);
    for (id, range) in gaps {
        accept(&mut again, id, &range).unwrap();
    }
    while again.advance(|_| {}).unwrap() {}
    assert_eq!(**again.prefix(), tally(&(0..1000)));
    assert_accounted(&again);
    assert_eq!(resumed(600, &[500]).walks_in(), 300, "the second range ends beyond the job");
    assert_eq!(resumed(1000, &[300]).walks_in(), 300, "a look lies within the first");
}

#[test]
fn what_a_worker_had_a_part_in_is_walked_again_while_it_waits() {
    let mut books = ledger(1000, 100, &[]);
    let leases: Vec<_> = std::iter::from_fn(|| books.lease(100)).collect();
    for (n, worker) in [(0, 1), (2, 1), (3, 2), (5, 2), (7, 1)] {
        take(&mut books, leases[n].0, &tally(&leases[n].1), worker).unwrap();
    }
    while books.advance(|_| {}).unwrap() {}
    assert_eq!(books.lose_waiting_of(|worker| worker == 1), 300, "two of them with another's");
    assert_eq!((books.walks_in(), books.unleased()), (200, 300));
}
