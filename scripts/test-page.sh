#!/usr/bin/env bash
# The script of report.html against the program: what its sliders show is what `radwalk combine` writes.
set -euo pipefail
cd "$(dirname "$0")/.."

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if ! command -v node >/dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq nodejs
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
# With the features of the whole workspace, so that what other builds have made serves here, too.
cargo build --quiet --locked --workspace --bin radwalk
radwalk="${RADWALK:-$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/debug/radwalk}"
"$radwalk" run configs/lamps.toml --paths 20000 --out "$scratch/run" --quiet
"$radwalk" combine "$scratch/run" --set left=0.3 --set right=1.7 --out "$scratch/mix" --quiet
"$radwalk" combine "$scratch/run" --set left=0 --set right=1.5 --set rest=0 --out "$scratch/dark" --quiet
cat >"$scratch/many.toml" <<'END'
[material.black]
reflectance = 0.0
[material.lamp]
reflectance = 0.5
emittance = 3.0
[material.wall]
reflectance = 0.6
[[surface]]
material = "black"
quad = [[0,0,0], [1,0,0], [0,1,0]]
patches = [60, 60]
[[surface]]
material = "lamp"
quad = [[0,0,1], [0,1,1], [1,0,1]]
patches = [4, 4]
[[surface]]
material = "wall"
quad = [[0,0,0], [0,1,0], [0,0,1]]
patches = [60, 60]
END
"$radwalk" run "$scratch/many.toml" --paths 100000 --set method.walk=shooting --out "$scratch/many" --quiet
PAGES="$scratch" node --test crates/report/web/test/*.test.mjs
