#!/usr/bin/env bash
# Makes the pages of docs/results again, all that have a command in scripts/results.tsv or those that are named.
# Usage: scripts/results.sh ROOMS KEPT [PAGE.md]...
# ROOMS has the rooms by others that pages name, which are fetched by whoever measures; KEPT keeps references and environments for the next time.
set -euo pipefail
cd "$(dirname "$0")/.."

ROOMS="$1"
KEPT="$2"
shift 2
mkdir -p "$KEPT"
cargo build --quiet --release --locked --workspace --bin radwalk --bin radwalk-lab
built="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release"
LAB="$built/radwalk-lab"
RADWALK="$built/radwalk"
export ROOMS KEPT LAB RADWALK
failed=()
while IFS=$'\t' read -r page _ command; do
    case "$page" in '#'* | '') continue ;; esac
    [ -n "$command" ] || continue
    [ $# -eq 0 ] || [[ " $* " == *" $page "* ]] || continue
    echo "$page: $command" >&2
    bash -c "$command" </dev/null || failed+=("$page")
done <scripts/results.tsv
[ ${#failed[@]} -eq 0 ] || { echo "not made: ${failed[*]}" >&2; exit 1; }
