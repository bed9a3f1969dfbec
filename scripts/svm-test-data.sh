#!/usr/bin/env bash
# Writes crates/sparing-svm/tests/data again: made-up data, models of every kind trained on them by libSVM's svm-train,
# libSVM's own decision values (.values: prediction, then one value a machine, one line a row of the queries), and
# what svm-scale makes of a file. Needs Debian's libsvm-tools and libsvm3 (scripts/setup.sh installs them).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=crates/sparing-svm/tests/data
cargo build --quiet -p testkit --example svm-data
cargo build --quiet -p libsvm-oracle --example decision-values
make=target/debug/examples/svm-data
values=target/debug/examples/decision-values
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"
rm -f "$out"/*.model "$out"/*.values "$out"/*.queries "$out"/*.txt

"$make" blobs 60 4 2 1 0.2 > "$work/two"
"$make" blobs 80 4 4 2 0.2 > "$work/four"
"$make" curve 50 3 3 0.2   > "$work/curve"
"$make" blobs 20 4 4 4 0.3 > "$out/blobs.queries"
"$make" curve 20 3 5 0.3   > "$out/curve.queries"

types=(c_svc nu_svc one_class epsilon_svr nu_svr)
kernels=(linear polynomial rbf sigmoid)
train() { # NAME TYPE KERNEL DATA QUERIES
    svm-train -q -s "$2" -t "$3" -d 3 -g 0.5 -r 0.25 -c 4 -n 0.25 -p 0.125 "$work/$4" "$out/$1.model"
    "$values" "$out/$1.model" "$out/$5.queries" > "$out/$1.values"
}
for kernel in "${!kernels[@]}"; do
    for type in 0 1; do
        train "${types[$type]}-${kernels[$kernel]}-2" "$type" "$kernel" two blobs
        train "${types[$type]}-${kernels[$kernel]}-4" "$type" "$kernel" four blobs
    done
    train "${types[2]}-${kernels[$kernel]}" 2 "$kernel" two blobs
    for type in 3 4; do
        train "${types[$type]}-${kernels[$kernel]}" "$type" "$kernel" curve curve
    done
done

# Feature 9 is constant; features 3 and 5 are constant in the first half only.
"$make" pixels 40 6 0.1 | awk 'NR <= 20 { for (i = 2; i <= NF; i++) if ($i ~ /^[35]:/) $i = "" } { print $0, "9:4" }' |
    tr -s ' ' > "$out/scale-input.txt"
head -n 20 "$out/scale-input.txt" > "$work/first"
svm-scale -l -1 -u 1 -y 0 1 -s "$out/scale-range.txt" "$work/first" > /dev/null 2>&1
svm-scale -r "$out/scale-range.txt" "$out/scale-input.txt" > "$out/scale-output.txt" 2>/dev/null
du -ch "$out" | tail -n 1
