#!/usr/bin/env bash
# Renders the demo scene with the release build and prints where the pictures are and what it took.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p out
status=0
target/release/sparing render scenes/demo.pbrt -o out/demo.exr -o out/demo.png --layers --stats out/demo.json || status=$?
# 130: interrupted, with the picture so far saved.
[ "$status" = 0 ] || [ "$status" = 130 ] || exit "$status"

# The statistics have one number a line.
awk -v folder="$PWD/out" '
    /"[a-z_]+": *[0-9.eE+-]+,?$/ { name = $1; gsub(/[":]/, "", name); number[name] = $2 + 0 }
    END {
        seconds = number["render_seconds"]; if (seconds <= 0) seconds = 1e-9
        print ""
        print "pictures    " folder "/demo.png"
        print "            " folder "/demo.exr (linear, with layers)"
        printf "size        %d x %d, %.0f samples per pixel\n", number["width"], number["height"], number["average_spp"]
        printf "time        %.1f s of rendering on %d threads, %.2f s of loading and building\n",
            number["render_seconds"], number["threads"], number["load_seconds"] + number["build_seconds"]
        printf "speed       %.2f million samples/s, %.1f million rays/s\n",
            number["samples"] / seconds / 1e6, number["rays_per_second"] / 1e6
        printf "memory      %.0f MiB at most\n", number["peak_memory_bytes"] / 1048576
        print "statistics  " folder "/demo.json"
    }' out/demo.json
exit "$status"
