#!/usr/bin/env bash
# Makes docs/results/lamps.md: births at lamps and figures of planes by the laboratory, and lamps beside Mitsuba and beside other readers.
# Usage: scripts/lamps.sh LAB RADWALK KEPT
# KEPT is a folder that is kept, in which whoever measures puts
#   files/       .ies and .ldt files of catalogues, such as those in the repositories holg/eulumdat-rs and
#                echowuzangye/CU-calculations-based-on-IES-file of GitHub
#   ies2rad      the program of Radiance, built from its sources (https://github.com/NREL/Radiance)
# Mitsuba, luxpy and eulumdat-py come from PyPI, into KEPT/venv. Mitsuba's LLVM variants need a libLLVM on the machine.
set -euo pipefail
lab="$(realpath "$1")"
radwalk="$(realpath "$2")"
kept="$(realpath -m "$3")"
cd "$(dirname "$0")/.."

fail() { echo "lamps: $1" >&2; exit 1; }
[ -d "$kept/files" ] || fail "there is no folder $kept/files; put .ies and .ldt files there, such as those of https://github.com/holg/eulumdat-rs"
[ -x "$kept/ies2rad" ] || fail "there is no program $kept/ies2rad; build it from https://github.com/NREL/Radiance and copy it there"
[ -d "$kept/venv" ] || python3 -m venv "$kept/venv"
# luxpy does not run with later versions of numpy.
packages=("numpy<2.1" matplotlib pandas luxpy eulumdat-py "mitsuba>=3.5,<4")
"$kept/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: "${packages[@]}" ||
    "$kept/venv/bin/python" -W ignore -c 'import luxpy, mitsuba, pyldt' ||
    fail "PyPI does not answer and $kept/venv lacks ${packages[*]}; install them there from wheels"
"$lab" lamps docs/results
"$kept/venv/bin/python" -W ignore scripts/lamps.py "$radwalk" "$kept/files" --ies2rad "$kept/ies2rad"
