#!/usr/bin/env bash
# Runs the kernel's golden-digest test and those of its vectors as AArch64 programs under qemu: the walk must give the
# same bits there. Needs Debian or Ubuntu, and root or sudo for the first call, which installs a cross compiler.
set -euo pipefail
cd "$(dirname "$0")/.."

target=aarch64-unknown-linux-gnu
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }
if ! command -v qemu-aarch64 >/dev/null || ! command -v aarch64-linux-gnu-gcc >/dev/null; then
    as_root apt-get update -qq
    as_root apt-get install -y -qq qemu-user gcc-aarch64-linux-gnu
fi

# The toolchain at hand where it has the target, else Debian's rustc with the AArch64 standard library.
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
    if [ ! -d "/usr/lib/rustlib/$target" ]; then
        as_root dpkg --add-architecture arm64
        as_root apt-get update -qq
        as_root apt-get install -y -qq --no-install-recommends rustc-web libstd-rust-web-dev:arm64
    fi
    export RUSTC=/usr/bin/rustc
fi

export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=qemu-aarch64
# Static: with shared libraries qemu 7.2 was seen to spin for ever in the test harness.
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-C target-feature=+crt-static"
# Counted: a name that no test has would pass.
passes() { # N, what cargo test is given
    local wanted=$1 tests
    shift
    tests=$(cargo test --locked -p radwalk-radiosity --target "$target" --target-dir target/aarch64 "$@")
    echo "$tests"
    grep -q "^test result: ok. $wanted passed" <<<"$tests" || { echo "test-aarch64: not $wanted tests have run" >&2; exit 1; }
}
passes 1 --test suite -- --exact same_bits::tallies_are_the_same_bits_on_every_machine
passes 4 --lib -- simd:: random::rng::tests::a_batch_draws_what_its_walks_would
