#!/bin/sh
# Chaos with real processes: 512 random faults over one job, whose answer must be that of an undisturbed run.
# The log of the last run is docs/results/chaos.log. Takes some minutes.
set -eu
cd "$(dirname "$0")/.."
RADWALK_CHAOS_FAULTS="${1:-512}" cargo test --release --test suite chaos:: -- --nocapture --test-threads 1 > docs/results/chaos.log
grep -v '^ *$' docs/results/chaos.log | tail -4
