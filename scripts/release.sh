#!/usr/bin/env bash
# A release by one command: the static binary and its archive, a container image, the wheel, the packages for `cargo install`, a list of parts,
# and the checksums of all.
#
#     scripts/release.sh [FOLDER]      default: dist; it must be empty
#
# `ZIG=1` links the wheel for manylinux2014 (scripts/wheel.sh). `VERIFY=0` leaves out that cargo builds every package by itself, which takes half
# an hour on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."
folder="${1:-dist}"
version="$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)"

fail() { echo "release: $1" >&2; exit 1; }
[ -z "$(git status --porcelain)" ] || fail "the tree has changes that are not committed, which no version names; commit them"
grep -q "^## $version" CHANGELOG.md || echo "release: CHANGELOG.md has no section $version yet; scripts/version.py $version makes it" >&2
mkdir -p "$folder"
[ -z "$(ls -A "$folder")" ] || fail "$folder is not empty; name another folder, or remove what is in it"

scripts/dist.sh "$folder"
binary="$(basename "$(ls "$folder"/radwalk-"$version"-*.sha256)" .sha256)"
scripts/sbom.py "${binary#radwalk-"$version"-}" > "$folder/radwalk-$version.cdx.json"
scripts/wheel.sh "$folder"

cargo package --workspace --locked $([ "${VERIFY:-1}" = 1 ] || echo --no-verify)
target="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')"
mkdir "$folder/crates"
cp "$target"/package/*-"$version".crate "$folder/crates/"

# The archive has the same bytes for the same sources: names in order, no owner, the time of the commit.
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
name="$scratch/$binary"
mkdir "$name"
install -m 755 "$folder/$binary" "$name/radwalk"
cp LICENSE README.md CHANGELOG.md "$folder/radwalk-$version.cdx.json" "$name/"
git archive HEAD configs docs/guide docs/reference | tar x -C "$name"
tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$(git log -1 --format=%ct)" -C "$scratch" -cf - "$binary" |
    gzip --no-name -9 > "$folder/$binary.tar.gz"

rm -f "$folder"/*.sha256
(cd "$folder" && find . -type f ! -name SHA256SUMS -printf '%P\n' | sort | xargs -d '\n' sha256sum > SHA256SUMS)
echo "release: radwalk $version is in $folder:"
cat "$folder/SHA256SUMS"
