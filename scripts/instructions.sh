#!/usr/bin/env bash
# Instructions of whole walks, a ray, with NEON (AArch64 under qemu) and with AVX2 (valgrind, which knows no AVX-512), and how many times as many
# NEON takes. A row of a table for each scene, in grey. Needs valgrind, qemu-user, gcc-aarch64-linux-gnu and the compiler's target
# aarch64-unknown-linux-gnu.
#
#     scripts/instructions.sh [cube | cornell | TRIANGLES | MESH]…      default: cube cornell 57000
set -euo pipefail
[ $# -gt 0 ] || set -- cube cornell 57000
scenes=()
for scene in "$@"; do scenes+=("$([ -f "$scene" ] && realpath "$scene" || echo "$scene")"); done
cd "$(dirname "$0")/.."

arm=aarch64-unknown-linux-gnu
host=$(rustc -vV | sed -n 's/^host: //p')
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-C target-feature=+crt-static"
for target in "$arm" "$host"; do
    cargo build --quiet --release --locked -p radwalk-lab --target "$target"
done
target=$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cc -shared -fPIC -O2 -o "$scratch/count.so" scripts/instructions/count.c

# counted COMMAND…: its instructions and rays.
counted() { "$@" 2>&1 | awk '/Collected :/ { n = $NF } /^[0-9]+$/ { rays = $1 } END { print n, rays }'; }
neon() { counted qemu-aarch64 -plugin "$scratch/count.so" "$target/$arm/release/radwalk-lab" walk "$@"; }
avx2() { counted valgrind --tool=callgrind --callgrind-out-file=/dev/null "$target/$host/release/radwalk-lab" walk "$@"; }

# a_ray KIND SCENE: of the last 32,768 of 49,152 walks, so that reading and building are left out.
a_ray() { echo "$("$1" 16384 "$2") $("$1" 49152 "$2")" | awk '{ printf "%.0f", ($3 - $1) / ($4 - $2) }'; }

echo "| scene | NEON | AVX2 | NEON ÷ AVX2 |"
echo "|---|---|---|---|"
for scene in "${scenes[@]}"; do
    row="$(a_ray neon "$scene") $(a_ray avx2 "$scene")"
    echo "$row" | awk -v scene="$(basename "$scene")" '{ printf "| %s | %d | %d | %.2f |\n", scene, $1, $2, $1 / $2 }'
done
