#!/bin/sh
# Fuzzes the decoder, the handshake and the coordinator for so many seconds each (default 600), from the kept corpus.
# Needs a nightly compiler and cargo-fuzz (`cargo install cargo-fuzz`). What it finds on its way is left in
# crates/cluster/fuzz/found.
set -eu
cd "$(dirname "$0")/../crates/cluster"
export ASAN_OPTIONS=quarantine_size_mb=16
for target in decoder handshake coordinator; do
    mkdir -p "fuzz/found/$target"
    # No input may need 64 MB at once or 10 s; what the sanitiser itself holds is part of the 512 MB.
    cargo +nightly fuzz run "$target" "fuzz/found/$target" "fuzz/corpus/$target" -- -max_total_time="${1:-600}" \
        -rss_limit_mb=512 -malloc_limit_mb=64 -timeout=10 -max_len=4096
done
