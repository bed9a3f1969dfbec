#!/bin/sh
# Kills renders at random moments and resumes them, COUNT times in all (100 unless given), and compares each picture that comes out with the
# one of an uninterrupted render, byte for byte of all layers' values. Needs `cargo build --release`.
#
#     scripts/kill.sh [COUNT]
set -eu
cd "$(dirname "$0")/.."
count=${1:-100}
sparing=$PWD/target/release/sparing
[ -x "$sparing" ] || { echo "build first: cargo build --release" >&2; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 1' INT TERM
scene=$PWD/scenes/cornell-box.pbrt
render="render $scene --size 128x128 --policy svm --spp 128 --max-spp 2048 --layers --progress none"
cd "$folder"
# shellcheck disable=SC2086
"$sparing" $render -o whole.exr
kills=0 pictures=0
while [ "$kills" -lt "$count" ]; do
    # shellcheck disable=SC2086
    "$sparing" $render -o part.exr --checkpoint c.exr --checkpoint-interval 30ms --resume 2>/dev/null &
    pid=$!
    # Between 50 and 900 ms; $RANDOM is not in every shell.
    milliseconds=$(awk -v seed="$kills$(date +%N)" 'BEGIN { srand(seed); print 50 + int(850 * rand()) }')
    sleep "$(awk -v ms="$milliseconds" 'BEGIN { print ms / 1000 }')"
    if kill -KILL $pid 2>/dev/null; then
        kills=$((kills + 1))
    fi
    wait $pid 2>/dev/null || true
    if [ -f part.exr ]; then
        "$sparing" compare part.exr whole.exr --json > difference.json
        grep -Eq '"mse": *0(\.0)?,' difference.json || { echo "after $kills kills the picture differs" >&2; exit 1; }
        pictures=$((pictures + 1))
        rm -f part.exr c.exr
    fi
done
echo "$kills kills, $pictures pictures finished on the way, all of them the same as the uninterrupted one"
# The last render, to its end.
# shellcheck disable=SC2086
"$sparing" $render -o part.exr --checkpoint c.exr --resume 2>/dev/null
"$sparing" compare part.exr whole.exr --json > difference.json
grep -Eq '"mse": *0(\.0)?,' difference.json || { echo "the last picture differs" >&2; exit 1; }
