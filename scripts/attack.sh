#!/bin/sh
# One worker's walks per second while 10,000 connections say nothing and 1,000 a second bring replays and noise, against
# the same undisturbed, eight times in turn. Needs 11,500 open files and, to mean anything, two idle cores.
set -eu
cd "$(dirname "$0")/.."
ulimit -n 20000
cargo test --release -p radwalk-cluster --test suite -- --ignored --nocapture throughput_under_attack
