#!/usr/bin/env bash
# Pictures by radwalk and by Mitsuba 3 of the same rooms, and docs/results/pictures.md about them. Mitsuba and a denoiser are installed
# from PyPI into FOLDER, which also keeps the references. A libLLVM of 17 or later and Chromium must be on the machine. A SCENE is a job, a scene or a mesh.
# Usage: scripts/pictures.sh FOLDER [--samples N] [NAME=SCENE]...
set -euo pipefail
cd "$(dirname "$0")/.."

folder="$1"
shift
if [ ! -d "$folder/venv" ]; then
    python3 -m venv "$folder/venv"
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check 'mitsuba>=3.9,<4' numpy pillow pyoidn
fi
cargo build --quiet --release --locked --workspace --bin radwalk --bin radwalk-lab
built="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release"
python3 scripts/pictures/page_sizes.py "$built/radwalk" "$built/radwalk-lab" "$folder/pages"
"$folder/venv/bin/python" scripts/pictures/pictures.py "$built/radwalk" "$folder" docs/results/pictures.md \
    room=configs/room.toml cornell=configs/cornell.toml "$@"
