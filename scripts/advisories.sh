#!/usr/bin/env bash
# Whether RustSec knows of a fault in a crate that Cargo.lock names. Needs cargo-audit (`cargo install --locked cargo-audit`),
# which fetches RustSec's list. Where either cannot be had this says so and decides nothing: a machine without a network is no
# fault of the program.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v cargo-audit >/dev/null; then
    echo "advisories: NOT CHECKED: there is no cargo-audit"
    exit 0
fi
errors="$(mktemp)"
trap 'rm -f "$errors"' EXIT
code=0
report="$(timeout 120 cargo-audit audit --json 2>"$errors")" || code=$?
if [ -z "$report" ]; then
    echo "advisories: NOT CHECKED: $(grep -v '^ *Fetching' "$errors" | head -n 1)"
elif [ $code != 0 ]; then
    cargo-audit audit --no-fetch
    exit 1
else
    echo "advisories: none"
fi
