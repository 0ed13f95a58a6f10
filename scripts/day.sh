#!/usr/bin/env bash
# Thousands of workers and weeks, compressed. First a day in simulated time: 4,096 workers bring 10¹² walks to one coordinator, which writes a checkpoint
# each minute, dies now and then and goes on; workers die and others come. Then the same number of workers over real sockets, which walk 10¹² walks in
# some minutes: the coordinator's memory and open files, every second. Draws what grows and what does not.
#
#     scripts/day.sh [OUT]        default: out/day
#
# Writes OUT/day.csv, OUT/day.svg, OUT/sockets.csv and OUT/sockets.svg. A quarter of an hour on two cores, and 2 GB for the workers' processes.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mkdir -p "${1:-out/day}" && cd "${1:-out/day}" && pwd)

RADWALK_CHART="$out/day.csv" cargo test --release --locked -p radwalk-protocol --test day -- --ignored --nocapture a_day_of_4096
scripts/chart.sh "$out/day.csv" "2:bytes that the coordinator holds" "3:bytes of the checkpoint" "4:files" > "$out/day.svg"

# 10¹² walks in streams of 65,536; 3.5·10⁵ … 7·10⁵ walks/s a worker, so that it takes eight minutes.
CHART="$out/sockets.csv" scripts/load.sh 4096 100 15258790 700000
scripts/chart.sh "$out/sockets.csv" "2:memory [kB]" "3:open files" > "$out/sockets.svg"
