#!/usr/bin/env bash
# What a coordinator can take: synthetic workers, many to a process, against a real coordinator on loopback. Prints a line of
# JSON for each case: connections, results/s, bytes/s, processor time, memory against what is allowed (three tallies and
# 64 KiB a worker), and whether every stream came in once. `docs/results/scale.md` says what they mean.
#
#     scripts/load.sh [WORKERS PATCHES STREAMS RATE [RELAYS]]      default: all cases of docs/results/scale.md, some minutes
#
# CHART=TABLE.csv writes the coordinator's memory and open files down every second. The last case needs 6 GB for the workers. As root it runs in a network namespace of its own, whose bytes are counted.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --locked --quiet -p radwalk-cluster --example load
target=$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
load="$target/release/examples/load"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# A file descriptor a worker in the coordinator, two in the workers' processes.
ulimit -n "$(ulimit -H -n)"

# sample PROCESS: its memory and open files, every second, as long as it is there.
sample() {
    local began=$SECONDS memory
    echo "seconds,memory_kb,files" > "$CHART"
    while memory=$(awk '/^VmRSS/ { print $2 }' "/proc/$1/status" 2>/dev/null) && [ -n "$memory" ]; do
        echo "$((SECONDS - began)),$memory,$(ls "/proc/$1/fd" | wc -l)" >> "$CHART"
        sleep 1
    done
}

# run_case WORKERS PATCHES STREAMS RATE [RELAYS]: RATE walks a second each, in streams of 65,536. RELAYS share the workers.
run_case() {
    local access="$scratch/$1-$2-${5:-0}.json" processes=${5:-$((($1 + 255) / 256))} coordinator code=0
    "$load" coordinate "$access" "$2" "$3" &
    coordinator=$!
    [ -z "${CHART:-}" ] || sample "$coordinator" &
    for process in $(seq "$processes"); do
        local near="$access"
        if [ -n "${5:-}" ]; then
            near="$access.$process"
            "$load" relay "$access" "$near" &
        fi
        nice "$load" work "$near" $(($1 / processes)) "$4" &
    done
    wait $coordinator || code=$?
    wait
    return $code
}

if [ "${1:-}" != --inside ] && unshare --net true 2>/dev/null; then
    exec unshare --net "$0" --inside "$@"
fi
[ "${1:-}" != --inside ] || { shift && ip link set lo up; }

if [ $# -ge 4 ]; then
    run_case "$@"
else
    run_case 1000 100 1000000 3000000
    run_case 1000 10000 1500000 3000000
    run_case 3000 1000 3000000 3000000
    run_case 200 1572864 40000 300000
    run_case 1000 10000 1500000 3000000 4
fi
