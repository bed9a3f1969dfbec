#!/bin/sh
# Runs the tests of the wrappers of C libraries under valgrind's memcheck; fails on any error or definite leak. Nothing is
# suppressed.
#   scripts/valgrind.sh [CRATE...]    all three without a name
# valgrind has no AVX-512, so Embree's kernels are limited to AVX2; ISA="sse2 avx2" runs its tests with both. PROPTEST_CASES is
# the number of random cases of a property, 24 unless it is set.
set -eu
cd "$(dirname "$0")/.."
root=$PWD
command -v valgrind >/dev/null ||
    { echo "valgrind is missing; install it first, on Debian and Ubuntu: apt-get install valgrind" >&2; exit 1; }
[ $# -gt 0 ] || set -- embree4 openexr-core libsvm-oracle

# Embree that is not in the system's folders is found as the wrapper's tests do.
library=${EMBREE_DIR:-$root/.deps/embree4}
for folder in lib lib64 lib/x86_64-linux-gnu; do
    if [ -d "$library/$folder" ]; then
        LD_LIBRARY_PATH=$library/$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    fi
done
export LD_LIBRARY_PATH="${LD_LIBRARY_PATH:-}"
export PROPTEST_CASES="${PROPTEST_CASES:-24}" RUST_BACKTRACE=0

for crate in "$@"; do
    [ -d "$root/crates/$crate" ] || { echo "there is no crate $crate" >&2; exit 2; }
    cd "$root/crates/$crate"
    tests=$(cargo test --no-run --message-format=json 2>/dev/null | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
    [ -n "$tests" ] || { echo "the tests do not build: see cargo test --no-run -p $crate" >&2; exit 1; }
    kernels=-
    [ "$crate" != embree4 ] || kernels=${ISA:-avx2}
    for isa in $kernels; do
        export EMBREE4_TEST_CONFIG="isa=$isa"
        for test in $tests; do
            case $test in */examples/*) continue ;; esac
            echo "== $crate, $(basename "$test"), $isa"
            valgrind --quiet --error-exitcode=9 --leak-check=full --show-leak-kinds=definite \
                --errors-for-leak-kinds=definite "$test" --test-threads=1 --quiet
        done
    done
done
echo "no errors"
