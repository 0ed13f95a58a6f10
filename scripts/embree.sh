#!/usr/bin/env bash
# Whole walks of radwalk on one core against Embree 3 that traces the same rays, on one core and without walking:
# a table of rates and ratios, with AVX-512 and with AVX2, for four scenes and for mesh files, in grey. Needs Debian or Ubuntu; root or sudo for the first
# call, which installs Embree's headers and a C++ compiler. Usage: scripts/embree.sh [ROUNDS [MESH…]], five rounds if not said.
set -euo pipefail
meshes=()
for mesh in "${@:2}"; do meshes+=("$(realpath "$mesh")"); done
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if [ ! -f /usr/include/embree3/rtcore.h ] || ! command -v g++ >/dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq g++ libembree-dev
fi

# Huge pages, for either: the program itself asks for them by its allocator.
export GLIBC_TUNABLES=glibc.malloc.hugetlb=1
build="$(mktemp -d)"
trap 'rm -rf "$build"' EXIT
g++ -std=c++17 -O3 -march=native -Wall -Wextra -o "$build/compare" scripts/embree/compare.cpp -lembree3
cargo run --quiet --release --locked -p radwalk-lab -- embree "$build/compare" "${1:-5}" "${meshes[@]}"
