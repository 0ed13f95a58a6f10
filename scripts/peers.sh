#!/usr/bin/env bash
# The radiosity of all patches by radwalk and by Mitsuba 3, in one run on this machine: figures of merit
# 1/(mean squared relative error × core-seconds), side by side, for the 54-patch cube, the Cornell box and an interior made by
# rule. Mitsuba is installed from PyPI into a folder that is removed; its LLVM variants need a libLLVM on the machine.
# Embree, which only traces rays, is in scripts/embree.sh. Usage: scripts/peers.sh [SECONDS], of each measurement; 20 if not said.
set -euo pipefail
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if ! python3 -c 'import venv, ensurepip, tomllib' 2>/dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq python3 python3-venv
fi
if ! ldconfig -p | grep -q libLLVM; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq libllvm15 || as_root apt-get install -y -qq libllvm14
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/venv"
"$scratch/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: 'mitsuba>=3.5,<4' numpy
cargo build --quiet --release --locked --bin radwalk
cargo run --quiet --release --locked -p radwalk-lab -- write interior 57000 > "$scratch/interior.toml"
radwalk="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release/radwalk"
"$scratch/venv/bin/python" scripts/peers/peers.py "$radwalk" "$scratch" "${1:-20}" \
    configs/scenes/cube54.toml configs/scenes/cornell.toml "$scratch/interior.toml"
