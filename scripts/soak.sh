#!/bin/bash
# A coordinator under chaos for a while, with checkpoints every second: workers are killed, frozen and replaced at random, and the
# coordinator itself is killed and resumed now and then. What it takes is written down every second and drawn.
#
#     scripts/soak.sh [SECONDS] [OUT]        default: 3600 out/soak
#
# Writes OUT/soak.csv (seconds, memory [kB], bytes of tally.bin, open files, coordinators so far), OUT/soak.svg, and what
# was said. Prints what was done and the last and largest of each.
# RADWALK=path/to/radwalk takes another build than the release.
set -eu
seconds=${1:-3600} out=${2:-out/soak}
radwalk=${RADWALK:-target/release/radwalk}
[ -x "$radwalk" ] || { echo "there is no $radwalk; build it with: cargo build --release" >&2; exit 2; }
mkdir -p "$out"
access=$out/access.json run=$out/run workers=() coordinator= coordinators=0 killed=0 frozen=0
RANDOM=25
rm -rf "$run" "$access"

coordinate() {
    "$radwalk" coordinate configs/cube54.toml --paths 1000000000000 --set budget.checkpoint_seconds=1 \
        --set budget.stream_paths=4096 --resume --quiet --out "$run" --access "$access" 2>> "$out/said.txt" &
    coordinator=$!
    coordinators=$((coordinators + 1))
}
work() {
    "$radwalk" work --quiet --wait 60 --access "$access" 2>> "$out/said.txt" &
    workers[$1]=$!
}
finish() {
    kill -TERM "$coordinator" 2>/dev/null || true
    wait "$coordinator" 2>/dev/null || true
    for worker in "${workers[@]}"; do
        kill -CONT "$worker" 2>/dev/null || true
        kill -KILL "$worker" 2>/dev/null || true
    done
}
trap finish EXIT

coordinate
until [ -e "$access" ]; do sleep 0.1; done
for n in 0 1 2; do work "$n"; done
echo "seconds,memory_kb,tally_bytes,files,coordinators" > "$out/soak.csv"
began=$SECONDS
while [ $((SECONDS - began)) -lt "$seconds" ]; do
    sleep 1
    now=$((SECONDS - began)) n=$((RANDOM % 3))
    case $((RANDOM % 20)) in
        0 | 1) kill -KILL "${workers[$n]}" 2>/dev/null && killed=$((killed + 1)) || true ;;
        2) kill -STOP "${workers[$n]}" 2>/dev/null && frozen=$((frozen + 1)) || true ;;
        3 | 4) for worker in "${workers[@]}"; do kill -CONT "$worker" 2>/dev/null || true; done ;;
        5) if [ $((RANDOM % 10)) = 0 ]; then
            kill -KILL "$coordinator"
            wait "$coordinator" 2>/dev/null || true
            coordinate
        fi ;;
    esac
    for n in 0 1 2; do kill -0 "${workers[$n]}" 2>/dev/null || work "$n"; done
    memory=$(awk '/^VmRSS/ { print $2 }' "/proc/$coordinator/status" 2>/dev/null || true)
    files=$(ls "/proc/$coordinator/fd" 2>/dev/null | wc -l)
    bytes=$(stat -c %s "$run/tally.bin" 2>/dev/null || echo 0)
    echo "$now,${memory:-0},$bytes,$files,$coordinators" >> "$out/soak.csv"
done

echo "$seconds s: $killed workers killed, $frozen frozen, $coordinators coordinators"

"$(dirname "$0")/chart.sh" "$out/soak.csv" "2:memory [kB]" "3:bytes of tally.bin" "4:open files" > "$out/soak.svg"
awk -F, 'NR > 1 { for (c = 2; c <= 4; c++) { if ($c > most[c]) most[c] = $c; last[c] = $c } }
    END { printf "memory %d kB (at most %d), tally.bin %d bytes (%d), open files %d (%d)\n", last[2], most[2], last[3], most[3], last[4], most[4] }' "$out/soak.csv"
