#!/usr/bin/env bash
# A release: one static binary, its checksum, and a container image where podman, docker or buildah is there.
#
#     scripts/dist.sh [FOLDER]      default: dist
#
# The binary is linked against musl and runs on any x86-64 (or AArch64) Linux. Where the compiler's target for musl cannot be had
# it is linked statically against glibc, and this says so. The folders of the sources and of cargo are not in it: the same commit and compiler give
# the same bytes anywhere (scripts/reproducible.sh).
set -euo pipefail
cd "$(dirname "$0")/.."
folder="${1:-dist}"
machine="$(uname -m)"
version="$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)"

target="$machine-unknown-linux-musl"
flags="-C target-feature=+crt-static"
if ! rustc --print target-libdir --target "$target" | xargs test -d; then
    rustup target add "$target" || {
        target="$machine-unknown-linux-gnu"
        echo "dist: there is no standard library for musl here: static against glibc instead" >&2
    }
fi
flags="$flags --remap-path-prefix=$PWD=/radwalk --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo"
RUSTFLAGS="$flags" cargo build --release --locked --target "$target" --bin radwalk
built="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/$target/release/radwalk"

name="radwalk-$version-$target"
mkdir -p "$folder"
install -m 755 "$built" "$folder/$name"
strip "$folder/$name" 2>/dev/null || echo "dist: without strip the binary keeps its line tables" >&2
if readelf -lW "$folder/$name" | grep -q INTERP; then
    echo "dist: $folder/$name asks for a dynamic loader: it is not static" >&2
    exit 1
fi

# It has to run, and to find the answer that the tests know, before anything is made of it.
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
"$folder/$name" run configs/cube54.toml --paths 100000 --out "$scratch/out" --quiet
"$folder/$name" audit "$scratch/out" --share 1 --quiet
(cd "$folder" && sha256sum "$name" > "$name.sha256")
echo "dist: $folder/$name, $(stat -c %s "$folder/$name") bytes"

mkdir "$scratch/image"
install -m 755 "$folder/$name" "$scratch/image/radwalk"
image="$folder/radwalk-$version-image.tar"
engine="$(command -v podman || command -v docker || true)"
if [ -n "$engine" ] && "$engine" info >/dev/null 2>&1; then
    "$engine" build --tag "radwalk:$version" --file scripts/Containerfile "$scratch/image"
    "$engine" run --rm "radwalk:$version" --version
    "$engine" save "radwalk:$version" > "$image"
elif command -v buildah >/dev/null; then
    # buildah needs no daemon.
    export BUILDAH_ISOLATION=chroot STORAGE_DRIVER=vfs
    store() { buildah --root "$scratch/store" --runroot "$scratch/state" "$@"; }
    store build --tag "radwalk:$version" --file scripts/Containerfile "$scratch/image"
    store run "$(store from "radwalk:$version")" -- /radwalk --version
    store push "radwalk:$version" "docker-archive:$image:radwalk:$version"
else
    echo "dist: no container image: neither podman, nor docker with its daemon, nor buildah is there"
    exit 0
fi
gzip --force "$image"
echo "dist: $image.gz, image radwalk:$version"
