#!/usr/bin/env bash
# Whether a commit gives the same binary wherever it is built: two clones, in two folders with a name of cargo's folder of their own, built by
# scripts/dist.sh.
#
#     scripts/reproducible.sh [COMMIT]      default: HEAD
#
# Takes two release builds, some minutes each on two cores. Where the binaries differ, it says which of their sections do.
set -euo pipefail
cd "$(dirname "$0")/.."
commit="$(git rev-parse --verify "${1:-HEAD}^{commit}")"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

build() {
    local clone="$scratch/$1" home="$scratch/$2"
    mkdir -p "$home"
    # Packages that were fetched are shared; only the folder has another name.
    ln -s "${CARGO_HOME:-$HOME/.cargo}"/* "$home/"
    git clone --quiet --no-checkout . "$clone"
    git -C "$clone" checkout --quiet --detach "$commit"
    (cd "$clone" && env -u CARGO_TARGET_DIR CARGO_HOME="$home" scripts/dist.sh "$clone/dist" >&2)
    find "$clone/dist" -name 'radwalk-*' ! -name '*.sha256' ! -name '*image*'
}

first="$(build first home)"
second="$(build a/second/clone another/home/of/cargo)"
if cmp --silent "$first" "$second"; then
    echo "reproducible: $(git rev-parse --short=12 "$commit") gives $(basename "$first") with SHA-256 $(sha256sum "$first" | cut -c 1-64) in two folders ($(rustc --version))"
    exit 0
fi
echo "reproducible: two builds of $(git rev-parse --short=12 "$commit") differ; sections by size and digest:" >&2
sections() {
    readelf -SW "$1" | sed -n 's/^ *\[ *[0-9]*\] \(\.[^ ]*\) .*/\1/p' | while read -r name; do
        echo "$name $(objcopy -O binary --only-section="$name" --set-section-flags "$name=alloc" "$1" /dev/stdout 2>/dev/null | sha256sum | cut -c 1-16)"
    done
}
diff <(sections "$first") <(sections "$second") >&2 || true
exit 1
