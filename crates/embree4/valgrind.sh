#!/bin/sh
# Runs the tests of the wrapper under valgrind's memcheck; fails on any error or leak. Nothing is suppressed.
#
# valgrind has no AVX-512, so Embree's kernels are limited to AVX2. More instruction sets can be named:
#   crates/embree4/valgrind.sh sse2 avx2
set -eu
here=$(cd "$(dirname "$0")" && pwd)
command -v valgrind >/dev/null || { echo "valgrind is not installed: install it with your package manager" >&2; exit 1; }

library=${EMBREE_DIR:-$here/../../.deps/embree4}
for folder in lib lib64 lib/x86_64-linux-gnu; do
    if [ -d "$library/$folder" ]; then
        LD_LIBRARY_PATH=$library/$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    fi
done
export LD_LIBRARY_PATH="${LD_LIBRARY_PATH:-}"
export PROPTEST_CASES="${PROPTEST_CASES:-24}"
export RUST_BACKTRACE=0

cd "$here"
tests=$(cargo test --no-run --message-format=json 2>/dev/null | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
[ -n "$tests" ] || { echo "the tests do not build: see cargo test --no-run" >&2; exit 1; }

for isa in "${@:-avx2}"; do
    export EMBREE4_TEST_CONFIG="isa=$isa"
    for test in $tests; do
        case $test in */examples/*) continue ;; esac
        echo "== $(basename "$test"), $isa"
        valgrind --quiet --error-exitcode=9 --leak-check=full --show-leak-kinds=definite \
            --errors-for-leak-kinds=definite \
            "$test" --test-threads=1 --quiet
    done
done
echo "no errors"
