#!/usr/bin/env bash
# Fuzzes the parsers, and the wrapper of Embree (embree_builder): needs a nightly toolchain and cargo-fuzz (cargo install cargo-fuzz).
#   scripts/fuzz.sh SECONDS [TARGET...]    each target for so long; all targets without a name
# Seeds come from the tests' files and fuzz/seeds; what is found lies in fuzz/artifacts.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
PATH=$PATH:${HOME:-/root}/.cargo/bin
seconds=${1:?usage: scripts/fuzz.sh SECONDS [TARGET...]}
shift
[ $# -gt 0 ] || set -- svm_model svm_range svm_data svm_card scene_ply scene_obj scene_gltf scene_pbrt embree_builder
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
        embree_builder) mkdir -p fuzz/corpus/$target ;; # bytes without a form: none is better than others
        *) echo "unknown target $target" >&2; exit 2 ;;
    esac
    # Embree keeps memory of its own for its threads; where it is not in the system's folders, it is found as the wrapper's tests do.
    memory=512
    if [ "$target" = embree_builder ]; then
        memory=2048
        library=${EMBREE_DIR:-$PWD/.deps/embree4}
        for folder in lib lib64 lib/x86_64-linux-gnu; do
            [ ! -d "$library/$folder" ] || export LD_LIBRARY_PATH="$library/$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
        done
    fi
    # 512 MiB and 2 s an input are far beyond what the limits of the targets allow.
    cargo +nightly fuzz run "$target" -- -max_total_time="$seconds" -max_len=8192 -rss_limit_mb=$memory -timeout=2
done
