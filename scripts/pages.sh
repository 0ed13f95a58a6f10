#!/bin/sh
# Pages of results: which are older than the kernel that they speak of, or all of them made anew.
#
#   scripts/pages.sh          says of each page of docs/results when it was written, and how many commits have changed the kernel since
#   scripts/pages.sh make     runs the command that each page names in its first lines (hours)
#
# Exits with 1 where a page is older than the kernel.
set -eu
cd "$(dirname "$0")/.."
kernel="crates/radiosity/src crates/judge/src/partition crates/results/src/pilot.rs"

command_of() {
    head -n 12 "$1" | grep -o '`[^`]*`' | tr -d '`' | grep -m 1 -E '^(cargo|radwalk|scripts/)' || true
}

older=0
for page in docs/results/*.md; do
    if [ "${1:-}" = make ]; then
        command=$(command_of "$page")
        [ -n "$command" ] || { echo "$page names no command" >&2; exit 2; }
        echo "$page: $command"
        PATH="target/release:$PATH" sh -c "$command"
        continue
    fi
    written=$(git log -1 --format=%h -- "$page")
    since=$(git rev-list --count "$written..HEAD" -- $kernel)
    [ "$since" -eq 0 ] || older=1
    echo "$page: $(git log -1 --format='%h of %cs' -- "$page"), kernel changed $since times since"
done
exit $older
