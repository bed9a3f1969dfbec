#!/usr/bin/env bash
# Fuzzes the parsers: needs a nightly toolchain and cargo-fuzz (cargo install cargo-fuzz).
#   scripts/fuzz.sh SECONDS [TARGET...]    each target for so long; all targets without a name
# Seeds come from the tests' files and fuzz/seeds; what is found lies in fuzz/artifacts.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
PATH=$PATH:${HOME:-/root}/.cargo/bin
seconds=${1:?usage: scripts/fuzz.sh SECONDS [TARGET...]}
shift
[ $# -gt 0 ] || set -- svm_model svm_range svm_data svm_card scene_ply scene_obj scene_gltf scene_pbrt
data=crates/sparing-svm/tests/data
scenes=crates/sparing-scene/tests

seed() { # TARGET FILE...: small files make good seeds
    local folder=fuzz/corpus/$1
    shift
    mkdir -p "$folder"
    find "$@" -size -8k -exec cp {} "$folder" \;
}
for target in "$@"; do
    case $target in
        scene_pbrt) seed "$target" "$scenes"/malformed/*.pbrt "$scenes"/fixtures/*.pbrt ;;
        svm_model) seed "$target" "$data"/*.model ;;
        svm_range) seed "$target" "$data"/*range.txt ;;
        svm_data)  seed "$target" "$data"/*.queries "$data"/scale-*put.txt ;;
        svm_card)  seed "$target" fuzz/seeds/svm_card/*.toml ;;
        scene_ply) seed "$target" "$scenes"/malformed/*.ply "$scenes"/fixtures/*.ply ;;
        scene_obj) seed "$target" "$scenes"/malformed/*.obj "$scenes"/fixtures/*.obj ;;
        scene_gltf) seed "$target" "$scenes"/malformed/*.gltf "$scenes"/malformed/*.glb ;;
        *) echo "unknown target $target" >&2; exit 2 ;;
    esac
    # 512 MiB and 2 s an input are far beyond what the limits of the targets allow.
    cargo +nightly fuzz run "$target" -- -max_total_time="$seconds" -max_len=8192 -rss_limit_mb=512 -timeout=2
done
