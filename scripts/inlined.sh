#!/usr/bin/env bash
# Whether the kernels of a program are compiled for their instruction set as a whole: a closure of several intrinsics that is
# not inlined is not, and each intrinsic in it is a call. Names the calls and fails where there are some. Needs binutils.
# Usage: scripts/inlined.sh [PROGRAM], target/release/radwalk if not said.
set -euo pipefail
cd "$(dirname "$0")/.."
program="${1:-target/release/radwalk}"

calls="$(objdump -d -C --no-show-raw-insn "$program" | awk '
    / <.*>:$/ { kernel = match($0, /::on_avx(2|512)/) ? $2 : "" }
    kernel && /\tcall/ && /core_arch|closure|core::array::/ { print kernel, $0 }
    / <.*>:$/ && /::on_avx/ { kernels++ }
    END { if (!kernels) print "no kernels found" }')"
if [ -n "$calls" ]; then
    echo "$calls" >&2
    exit 1
fi
