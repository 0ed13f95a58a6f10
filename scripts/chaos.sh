#!/bin/sh
# Chaos with real processes: random faults over one job (512, or as many as are asked for) and over every method and product (a sixteenth of that each); what
# comes out must be that of an undisturbed run. Then each product is killed whenever something of it is kept. The log of the last run is docs/results/chaos.log.
# Takes half an hour.
set -eu
cd "$(dirname "$0")/.."
faults="${1:-512}"
log=docs/results/chaos.log
chaos() { RADWALK_CHAOS_FAULTS="$1" cargo test --release --test suite "$2" -- --nocapture --test-threads 1; }
chaos "$faults" chaos::no_fault > "$log"
chaos $(((faults + 15) / 16)) chaos_products:: >> "$log"
grep -v '^ *$' "$log" | tail -4
