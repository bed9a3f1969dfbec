#!/bin/sh
# Runs the wrapper's tests under valgrind's memcheck; fails on any error or definite leak. Nothing is suppressed.
set -eu
cd "$(dirname "$0")"
export RUST_BACKTRACE=0 PROPTEST_CASES="${PROPTEST_CASES:-24}"
tests=$(cargo test --no-run --message-format=json 2>/dev/null | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p')
[ -n "$tests" ] || { echo "the tests do not build: see cargo test --no-run" >&2; exit 1; }
for test in $tests; do
    case $test in */examples/*) continue ;; esac
    echo "== $(basename "$test")"
    valgrind --quiet --error-exitcode=9 --leak-check=full --show-leak-kinds=definite \
        --errors-for-leak-kinds=definite "$test" --test-threads=1 --quiet
done
echo "no errors"
