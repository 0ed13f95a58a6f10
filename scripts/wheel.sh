#!/usr/bin/env bash
# The wheel of the Python package: one for all Pythons from 3.10 on (abi3), tried in an empty environment.
#
#     scripts/wheel.sh [FOLDER]      default: dist
#
# Its tag names the C library that it needs, which is that of this machine at most. `ZIG=1` links against that of manylinux2014 instead, by
# the linker of zig, which pip brings. `TARGET=aarch64-unknown-linux-gnu` makes the wheel of another processor, where the compiler has its
# standard library (of Debian: `libstd-rust-web-dev:arm64`, with RUSTC=/usr/bin/rustc). Such a wheel is not tried here.
set -euo pipefail
cd "$(dirname "$0")/.."
folder="${1:-dist}"
machine="$(uname -m)"
target="${TARGET:-$machine}"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

python3 -m venv "$scratch/tools"
"$scratch/tools/bin/pip" install --quiet --disable-pip-version-check "maturin${ZIG:+[zig]}>=1.8,<2"
PATH="$scratch/tools/bin:$PATH" maturin build --quiet --release --strip --locked ${TARGET:+--target "$TARGET"} \
    ${ZIG:+--zig --compatibility manylinux2014} --manifest-path crates/python/Cargo.toml --out "$folder"
wheel="$(ls -t "$folder"/radwalk-*.whl | head -n 1)"
case "$wheel" in
*-abi3-manylinux*_"${target%%-*}".whl | *-abi3-macosx*.whl) ;;
*)
    echo "wheel: $wheel is not for every Python, not for every Linux, or not for ${target%%-*}" >&2
    exit 1
    ;;
esac

# It has to run with numpy alone, and to count factors with scipy.
if [ "${target%%-*}" = "$machine" ]; then
    python3 -m venv "$scratch/empty"
    pip() { "$scratch/empty/bin/pip" --quiet --disable-pip-version-check install --only-binary :all: "$@"; }
    pip "$wheel"
    cube="$PWD/configs/cube54.toml"
    cd "$scratch"
    empty/bin/python -c 'import sys, radwalk; radwalk.run(sys.argv[1], paths=1000, progress=False)' "$cube"
    pip scipy
    empty/bin/python - "$cube" <<'END'
import sys, radwalk
factors = radwalk.factors(sys.argv[1], rays=1024, progress=False)
assert factors.shape == (54, 56) and (factors.sum(axis=1) == 1.0).all()
END
    cd "$OLDPWD"
else
    echo "wheel: a machine of ${target%%-*} has to try it" >&2
fi
echo "wheel: $wheel, $(wc -c < "$wheel") bytes"
