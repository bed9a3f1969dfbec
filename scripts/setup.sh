#!/usr/bin/env bash
# Installs what Sparing needs beyond git, make, gcc and a Rust toolchain: Embree 4, libclang, OpenEXR.
# Idempotent. Touches nothing outside this checkout but distribution packages.
#   scripts/setup.sh            install what is missing
#   scripts/setup.sh --check    only say what is missing; exit 1 if anything is
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
prefix=$root/.deps/embree4
stamp=$prefix/.complete

# Fall-back for distributions without Embree 4 (Debian 12, Ubuntu 22.04), x86-64 only:
# Intel's library as the Python package "embreex" ships it, headers from Debian 13's development package.
wheel_version=4.4.0.post1
wheel_sha256=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
headers_version=4.3.3+dfsg-1
headers_sha256=674a8b3d1a00612f46730da29f4cc146267b4917bbf0242113d0568429e78726

say()  { printf 'setup: %s\n' "$*"; }
fail() { printf 'setup: error: %s\n' "$*" >&2; exit 1; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"
    elif command -v sudo >/dev/null; then sudo "$@"
    else fail "root or sudo is needed for: $*"; fi
}

# --- what is there ------------------------------------------------------------------------------
have_embree_headers() { # DIR: does DIR/embree4/rtcore_config.h say major version 4?
    grep -qs 'RTC_VERSION_MAJOR 4' "$1/embree4/rtcore_config.h"
}
have_embree() {
    if [ -n "${EMBREE_DIR:-}" ]; then
        have_embree_headers "$EMBREE_DIR/include" ||
            fail "EMBREE_DIR=$EMBREE_DIR has no include/embree4/rtcore_config.h of version 4; unset it to let this script choose"
        return 0
    fi
    { have_embree_headers /usr/include || have_embree_headers /usr/local/include; } && return 0
    [ "$(cat "$stamp" 2>/dev/null)" = "$wheel_sha256 $headers_sha256" ]
}
have_libclang() {
    compgen -G '/usr/lib/llvm-*/lib/libclang[-.]*so*' || compgen -G '/usr/lib/libclang[-.]*so*' ||
        compgen -G '/usr/lib64/libclang[-.]*so*' || compgen -G '/usr/lib/*-linux-gnu/libclang[-.]*so*'
}
have_openexr() {
    [ -f /usr/include/OpenEXR/openexr.h ] || [ -f /usr/local/include/OpenEXR/openexr.h ]
}

# --- distribution packages ----------------------------------------------------------------------
apt_ready=
apt_install() {
    command -v apt-get >/dev/null ||
        fail "no apt-get here. Install these by hand and run again: Embree 4 (headers and library), libclang, OpenEXR 3.1 or later"
    if [ -z "$apt_ready" ]; then
        say "apt-get update"
        as_root apt-get update -qq || say "apt-get update failed; trying with the lists that are there"
        apt_ready=1
    fi
    say "apt-get install $*"
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null ||
        fail "apt-get could not install: $*"
}

check_hash() { # FILE SHA256
    echo "$2  $1" | sha256sum -c --quiet - >/dev/null 2>&1 ||
        fail "$(basename "$1") does not have the pinned sha256 $2; it was not used"
}

# --- Embree -------------------------------------------------------------------------------------
distribution_embree_version() {
    apt-cache policy libembree-dev 2>/dev/null | sed -n 's/ *Candidate: //p'
}

fetch_wheel() { # DIR
    python3 -m pip --version >/dev/null 2>&1 || apt_install python3-pip
    say "fetching the Embree library (Python package embreex $wheel_version)"
    python3 -m pip download --quiet --no-deps --only-binary=:all: --dest "$1" \
        --python-version 3.11 --implementation cp --abi cp311 \
        --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 "embreex==$wheel_version" ||
        fail "could not fetch embreex $wheel_version. Set EMBREE_DIR to an Embree 4 installation instead"
    check_hash "$1"/embreex-*.whl "$wheel_sha256"
}

# A private apt state with this machine's own sources, the release name replaced: nothing of the system changes.
fetch_headers() { # DIR
    local state=$1/apt codename
    codename=$(. /etc/os-release; echo "${VERSION_CODENAME:-}")
    mkdir -p "$state"/{lists/partial,cache/archives/partial,sources.d}
    : > "$state/status"
    for f in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
        [ -f "$f" ] && grep -qE "(^| )$codename( |\$)" "$f" && grep -q debian "$f" || continue
        sed "s/\b$codename\b/trixie/g" "$f" > "$state/sources.d/$(basename "$f")"
    done
    local opts=(-o Dir::State="$state" -o Dir::State::status="$state/status" -o Dir::State::lists="$state/lists"
        -o Dir::Cache="$state/cache" -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$state/sources.d"
        -o APT::Sandbox::User="$(id -un)")
    say "fetching the Embree headers (Debian package libembree-dev $headers_version)"
    apt-get "${opts[@]}" update -qq >/dev/null 2>&1 || true
    (cd "$1" && apt-get "${opts[@]}" download -qq "libembree-dev=$headers_version" >/dev/null) ||
        fail "could not fetch libembree-dev $headers_version. Set EMBREE_DIR to an Embree 4 installation instead"
    check_hash "$1"/libembree-dev_*.deb "$headers_sha256"
}

install_embree_prefix() {
    [ "$(uname -m)" = x86_64 ] ||
        fail "this distribution has no Embree 4 and the fall-back is for x86-64 only. Build Embree 4 and set EMBREE_DIR to its prefix"
    local work lib
    work=$(mktemp -d "$root/.deps/tmp.XXXXXX")
    trap 'rm -rf "$work"' EXIT
    fetch_wheel "$work"
    fetch_headers "$work"
    mkdir -p "$work/wheel" "$work/headers" "$work/prefix/lib"
    python3 -m zipfile -e "$work"/embreex-*.whl "$work/wheel"
    dpkg-deb -x "$work"/libembree-dev_*.deb "$work/headers"
    cp -r "$work/headers/usr/include" "$work/prefix/include"
    cp "$work"/wheel/embreex.libs/* "$work/prefix/lib/"
    lib=$(cd "$work/prefix/lib" && ls libembree4-*.so.4)
    ln -s "$lib" "$work/prefix/lib/libembree4.so"
    echo "$wheel_sha256 $headers_sha256" > "$work/prefix/.complete"
    rm -rf "$prefix"
    mv "$work/prefix" "$prefix"
    rm -rf "$work"
    trap - EXIT
    say "Embree 4.4.0 is in .deps/embree4"
}

install_embree() {
    mkdir -p "$root/.deps"
    if command -v apt-get >/dev/null; then
        [ -n "$(distribution_embree_version)" ] || { say "apt-get update"; as_root apt-get update -qq || true; apt_ready=1; }
        case "$(distribution_embree_version)" in
            4.*) apt_install libembree-dev; return ;;
        esac
        say "this distribution has no Embree 4 (libembree-dev: $(distribution_embree_version)); using a prefix in the checkout"
        install_embree_prefix
    else
        fail "no Embree 4 found. Install your distribution's package (embree-devel, embree) or set EMBREE_DIR to its prefix"
    fi
}

# --- main ---------------------------------------------------------------------------------------
missing=()
have_libclang >/dev/null || missing+=(libclang)
have_openexr  || missing+=(openexr)
have_embree   || missing+=(embree4)
command -v cargo >/dev/null || fail "no cargo found. Install a Rust toolchain (rustup.rs) first"
command -v cc >/dev/null || fail "no C compiler found. Install gcc first"

if [ ${#missing[@]} = 0 ]; then
    say "nothing is missing"
    exit 0
fi
if [ "${1:-}" = --check ]; then
    say "missing: ${missing[*]}"
    exit 1
fi
for m in "${missing[@]}"; do
    case $m in
        libclang) apt_install libclang-dev ;;
        openexr)  apt_install libopenexr-dev ;;
        embree4)  install_embree ;;
    esac
done
say "done"
