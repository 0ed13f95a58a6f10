#!/usr/bin/env bash
# Makes docs/results/factors.md: factors of made cities and of fetched ones, beside View3D and pyviewfactor.
# Usage: scripts/factors.sh RADWALK KEPT
# KEPT is a folder that is kept, in which whoever measures puts
#   view3d       the program View3D, built from its sources (https://github.com/jasondegraw/View3D)
#   *.stl        cities as binary STL, such as examples/949 of uDALES (https://github.com/uDALES/u-dales)
# pyviewfactor comes from PyPI, into KEPT/venv.
set -euo pipefail
radwalk="$(realpath "$1")"
kept="$(realpath -m "$2")"
cd "$(dirname "$0")/.."

fail() { echo "factors: $1" >&2; exit 1; }
[ -x "$kept/view3d" ] || fail "there is no program $kept/view3d, beside which factors are put; build View3D from https://github.com/jasondegraw/View3D and copy it there"
shopt -s nullglob nocaseglob
cities=("$kept"/*.stl)
shopt -u nocaseglob
[ ${#cities[@]} -gt 0 ] || fail "there is no city $kept/*.stl; copy one there, such as examples/949/geom.949.STL of https://github.com/uDALES/u-dales"
[ -d "$kept/venv" ] || python3 -m venv "$kept/venv"
"$kept/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: numpy scipy pyviewfactor ||
    "$kept/venv/bin/python" -c 'import numpy, scipy, pyviewfactor' ||
    fail "PyPI does not answer and $kept/venv lacks numpy, scipy or pyviewfactor; install them there from wheels"
"$kept/venv/bin/python" scripts/factors.py "$radwalk" --view3d "$kept/view3d" "${cities[@]/#/--stl=}"
