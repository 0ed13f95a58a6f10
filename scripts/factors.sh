#!/usr/bin/env bash
# Makes docs/results/factors.md: View3D is built from its sources, pyviewfactor is installed from PyPI, both into a folder that is kept.
# Usage: scripts/factors.sh RADWALK KEPT
set -euo pipefail
radwalk="$(realpath "$1")"
mkdir -p "$2"
kept="$(realpath "$2")"
cd "$(dirname "$0")/.."

[ -d "$kept/View3D" ] || git clone --quiet --depth 1 https://github.com/jasondegraw/View3D "$kept/View3D"
sources=(ctrans getdat heap misc polygn readvf savevf test3d v3main view3d viewobs viewpp viewunob tmpstore)
(cd "$kept/View3D/src" && cc -O2 -w -fcommon "${sources[@]/%/.c}" -lm -o "$kept/view3d")
[ -d "$kept/venv" ] || python3 -m venv "$kept/venv"
"$kept/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: numpy scipy pyviewfactor
"$kept/venv/bin/python" scripts/factors.py "$radwalk" --view3d "$kept/view3d"
