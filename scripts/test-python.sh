#!/usr/bin/env bash
# The Python package from wheel to figure: builds the wheel, installs it into a clean virtual environment beside numpy alone, then
# adds what the tests and the notebook take, and runs both. The answers are held against those of the binary.
set -euo pipefail
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if ! command -v python3 >/dev/null || ! python3 -c 'import venv, ensurepip' 2>/dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq python3 python3-venv
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
python3 -m venv "$scratch/tools"
"$scratch/tools/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.8,<2'
"$scratch/tools/bin/maturin" build --quiet --profile dev --locked --manifest-path crates/python/Cargo.toml --out "$scratch/wheel"
# With the features of the whole workspace, so that what other builds have made serves here, too.
cargo build --quiet --locked --workspace --bin radwalk
RADWALK="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/debug/radwalk"
export RADWALK

python3 -m venv "$scratch/clean"
pip() { "$scratch/clean/bin/pip" --quiet --disable-pip-version-check install --only-binary :all: "$@"; }
pip "$scratch"/wheel/radwalk-*.whl
# Nothing but numpy is needed to walk.
(cd "$scratch" && clean/bin/python -c 'import sys, radwalk; radwalk.run(sys.argv[1], paths=1000)' "$OLDPWD/configs/cube54.toml")
pip pytest pandas scipy meshio trimesh matplotlib nbclient ipykernel
# pyvista brings VTK, which is large and not built for every interpreter; its test is skipped where it cannot be had.
pip pyvista || echo "test-python: pyvista cannot be installed here, its test is skipped" >&2
"$scratch/clean/bin/python" -m pytest --quiet -p no:cacheprovider crates/python/tests
