#!/usr/bin/env bash
# What is unsafe and what runs on several threads, under tools that see what tests alone do not.
#
#     scripts/sanitize.sh [list] [memory] [address] [thread] [miri]      default: all five, an hour on two cores
#
# list      every unsafe block of the workspace with its proof; one without a proof is an error
# memory    valgrind: the vectors of AVX2 and the tracing read nothing that was not written, and nothing out of bounds
# address   AddressSanitizer: all unit tests of the crates that hold unsafe blocks, and of what reads files of strangers
# thread    ThreadSanitizer, with a standard library that is built for it: loops on threads, chains, choices of patches, coordinators, workers and relays on sockets
# miri      Miri: the allocator, loops on threads, and the vectors and one ray of a tree on AVX2, by the rules of Rust itself
#
# Needs valgrind for memory, for thread the component rust-src (`rustup component add rust-src`), and for miri a nightly compiler with the
# components miri and rust-src. AVX-512 is covered by address on a processor that has it: valgrind and Miri do not know it.
set -euo pipefail
cd "$(dirname "$0")/.."
host=$(rustc -vV | sed -n 's/^host: //p')
target=$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')

list() {
    git ls-files 'crates/*.rs' 'src/*.rs' 'tests/*.rs' | xargs awk '
        FNR == 1 { proof = "" }
        /^ *\/\/ SAFETY: / { proof = $0; sub(/^ *\/\/ SAFETY: /, "", proof); open = 1; next }
        open && /^ *\/\/ / { line = $0; sub(/^ *\/\/ /, "", line); proof = proof " " line; next }
        { open = 0 }
        /^ *\/\// { next }
        /(^|[^_a-z])unsafe (impl|\{)/ {
            n++
            if (proof == "" ) { missing++; proof = "NO PROOF" }
            print FILENAME ":" FNR ": " proof
            proof = ""
        }
        END { printf "%d unsafe blocks, %d without a proof\n", n, missing; exit missing > 0 }'
}

# sanitized KIND ARGUMENTS…: cargo test under a sanitiser, in a folder of its own.
sanitized() {
    local kind="$1"
    shift
    RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=$kind -Cunsafe-allow-abi-mismatch=sanitizer" CARGO_TARGET_DIR="$target/sanitize-$kind" \
        cargo test --locked --no-fail-fast --target "$host" "$@"
}

memory() {
    command -v valgrind >/dev/null || { echo "sanitize.sh needs valgrind for memory" >&2; exit 2; }
    local suite
    suite=$(cargo test --locked -p radwalk-radiosity --test suite --no-run --message-format json 2>/dev/null |
        sed -n 's/.*"executable":"\([^"]*suite-[^"]*\)".*/\1/p' | head -1)
    # Walks, groups, slopes, lamps and daylight: the kernels with all their vectors.
    valgrind --error-exitcode=9 --tool=memcheck "$suite" --test-threads 1 \
        same_bits::any_split groups::sums linear::slopes lamps::births daylight::parts walks::beyond
}

address() {
    sanitized address -p radwalk-radiosity -p radwalk-exact -p radwalk-import -p radwalk-photometry -p radwalk-sky -p radwalk-pages --lib
}

# Trees, which take many minutes under it, and what is thrown at the decoder are tested on one thread.
thread() {
    sanitized thread -Zbuild-std -p radwalk-parallel -p radwalk-radiosity -p radwalk-cluster -p radwalk-results --lib -- --skip trace::tree::tests
    sanitized thread -Zbuild-std -p radwalk-cluster --test suite -- --skip fuzz::
}

# Trees with more rays and facets than one take Miri longer than ten minutes.
miri() {
    local miri=(cargo +nightly miri test --locked --no-fail-fast --lib)
    "${miri[@]}" -p radwalk-pages -p radwalk-parallel
    RUSTFLAGS="-Ctarget-feature=+avx2,+fma,+bmi1,+bmi2,+lzcnt,+popcnt" \
        "${miri[@]}" -p radwalk-radiosity -- simd:: a_start_within_the_slack_of_a_plane
}

for part in "${@:-list memory address thread miri}"; do
    for each in $part; do
        echo "== $each"
        "$each"
    done
done
