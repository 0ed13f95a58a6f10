#!/usr/bin/env bash
# Pictures by radwalk and by Mitsuba 3 of the same rooms, and docs/results/pictures.md about them. Mitsuba and a denoiser are installed
# from PyPI into FOLDER, which also keeps the references; LLVM 19 and Chromium from the system's packages where they are missing. A SCENE is a job, a scene or a mesh.
# Usage: scripts/pictures.sh FOLDER [--samples N] [NAME=SCENE]...
set -euo pipefail
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
llvm() { ldconfig -p | grep -oE '/[^ ]*libLLVM[^ /]*' | grep -E 'LLVM(-|\.so\.)(1[7-9]|2[0-9])' | sort -V | head -n 1; }

folder="$1"
shift
if [ -z "${DRJIT_LIBLLVM_PATH:-$(llvm)}" ] || ! command -v chromium > /dev/null || ! python3 -c 'import venv, ensurepip' 2> /dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq libllvm19 chromium python3-venv
fi
export DRJIT_LIBLLVM_PATH="${DRJIT_LIBLLVM_PATH:-$(llvm)}"
if [ ! -d "$folder/venv" ]; then
    python3 -m venv "$folder/venv"
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check 'mitsuba>=3.9,<4' numpy pillow pyoidn
fi
cargo build --quiet --release --locked --workspace --bin radwalk --bin radwalk-lab
built="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release"
python3 scripts/pictures/page_sizes.py "$built/radwalk" "$built/radwalk-lab" "$folder/pages"
"$folder/venv/bin/python" scripts/pictures/pictures.py "$built/radwalk" "$folder" docs/results/pictures.md \
    room=configs/room.toml cornell=configs/cornell.toml "$@"
