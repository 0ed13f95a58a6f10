#!/bin/sh
# Fuzzes the decoder, the handshake, the coordinator and the readers of meshes, luminaires, weather, matrices, jobs, scenes and points for a number of
# seconds each (default 600), from the kept corpus. Needs a nightly compiler and cargo-fuzz (`cargo install cargo-fuzz`). Inputs found on the
# way are left in fuzz/found of each crate. Without them, `cargo test --release -p radwalk-job --test suite fuzz -- --ignored` does the like.
set -eu
crates="$(cd "$(dirname "$0")/../crates" && pwd)"
seconds="${1:-600}"
export ASAN_OPTIONS=quarantine_size_mb=16
# One folder and one choice of versions for all targets: what they share is built once.
export CARGO_TARGET_DIR="$crates/../target/fuzz"

# fuzz CRATE MEGABYTES TARGET…: no input may need the megabytes at once, or 10 s. What the sanitiser itself holds is
# part of eight times as many.
fuzz() {
    cd "$crates/$1"
    cp ../../Cargo.lock fuzz/Cargo.lock
    megabytes="$2"
    shift 2
    for target in "$@"; do
        mkdir -p "fuzz/found/$target" "fuzz/greedy/$target"
        cargo +nightly fuzz run "$target" "fuzz/found/$target" "fuzz/corpus/$target" "fuzz/greedy/$target" -- \
            -max_total_time="$seconds" -rss_limit_mb=$((8 * megabytes)) -malloc_limit_mb="$megabytes" -timeout=10 \
            -max_len=4096 -print_funcs=0
    done
}

fuzz cluster 64 decoder handshake coordinator
fuzz photometry 64 luminaire
fuzz sky 64 epw mtx
fuzz job 1024 job scene points partition
fuzz import 1024 obj gltf stl ply mgf mitsuba vs3 vtk
