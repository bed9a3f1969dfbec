#!/usr/bin/env bash
# Installs what Sparing needs beyond git, make, gcc and a Rust toolchain: Embree 4, libclang, OpenEXR, and for the
# tests libSVM with its tools.
# Idempotent. Touches nothing outside this checkout but distribution packages.
#   scripts/setup.sh            install what is missing
#   scripts/setup.sh --check    only say what is missing; exit 1 if anything is
#
# EMBREE_DIR, OPENEXR_DIR and LIBCLANG_PATH name installations of your own; this script then leaves them alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
prefix=$root/.deps/embree4
stamp=$prefix/.complete
PATH=$PATH:${HOME:-/root}/.cargo/bin

# Fall-back for Debian 12, which has Embree 3 only (x86-64): Intel's library as the Python package "embreex"
# ships it, and the headers of Debian 13's development package.
wheel_version=4.4.0.post1
wheel_sha256=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f
headers_version=4.3.3+dfsg-1
headers_release=trixie
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
    [ -f "$stamp" ] && [ "$(<"$stamp")" = "$wheel_sha256 $headers_sha256" ]
}
any_file() { # PATTERN...: does any pattern match?
    local pattern
    for pattern in "$@"; do compgen -G "$pattern" >/dev/null && return 0; done
    return 1
}
have_libclang() { # the library (not libclang-cpp) and clang's own headers
    [ -n "${LIBCLANG_PATH:-}" ] && return 0
    any_file /usr/lib/llvm*/lib/libclang.so /usr/lib/llvm*/lib{,64}/libclang-[0-9]*.so* \
        /usr/lib{,64}/libclang.so* /usr/lib/*-linux-gnu/libclang-[0-9]*.so* &&
        any_file /usr/lib/llvm*/lib/clang/*/include/stddef.h /usr/lib{,64}/clang/*/include/stddef.h
}
have_openexr() { # 3.1 or later: the first with the C API
    if [ -n "${OPENEXR_DIR:-}" ]; then
        [ -f "$OPENEXR_DIR/include/OpenEXR/openexr.h" ] ||
            fail "OPENEXR_DIR=$OPENEXR_DIR has no include/OpenEXR/openexr.h; unset it to let this script choose"
        return 0
    fi
    [ -f /usr/include/OpenEXR/openexr.h ] || [ -f /usr/local/include/OpenEXR/openexr.h ]
}
have_libsvm() { # the library, loaded by tests, and the tools; only Debian's packages are known here
    command -v apt-get >/dev/null || return 0
    command -v svm-train >/dev/null && command -v svm-predict >/dev/null && command -v svm-scale >/dev/null &&
        any_file /usr/lib/*-linux-gnu/libsvm.so.[34] /usr/lib{,64}/libsvm.so.[34] /usr/local/lib/libsvm.so.[34]
}
find_missing() { # sets `missing`
    missing=()
    have_libclang || missing+=(libclang)
    have_openexr  || missing+=(openexr)
    have_embree   || missing+=(embree4)
    have_libsvm   || missing+=(libsvm)
}

# --- distribution packages ----------------------------------------------------------------------
apt_ready=
apt_update() {
    [ -z "$apt_ready" ] || return 0
    apt_ready=1
    say "apt-get update"
    as_root apt-get -o APT::Update::Error-Mode=any update -qq || say "apt-get update failed; trying with the package lists that are there"
}
apt_install() {
    command -v apt-get >/dev/null ||
        fail "no apt-get here. Install by hand and run again: Embree 4 (headers and library), libclang, OpenEXR 3.1 or later"
    apt_update
    say "apt-get install $*"
    # Fresh machines often run their automatic updates now: wait for the lock. What apt says matters only if it fails.
    local said
    said=$(as_root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 \
        install -y -qq --no-install-recommends "$@" 2>&1) || {
        printf '%s\n' "$said" | tail -n 20 >&2
        fail "apt-get could not install $*; see its message above"
    }
}

check_hash() { # FILE SHA256
    local found
    found=$(sha256sum "$1")
    [ "${found%% *}" = "$2" ] || fail "$(basename "$1") has sha256 ${found%% *}, pinned is $2; it was not used"
}

# --- Embree -------------------------------------------------------------------------------------
distribution_embree_version() {
    apt-cache policy libembree-dev 2>/dev/null | sed -n 's/ *Candidate: //p'
}

own_embree="Install Embree 4 yourself and set EMBREE_DIR to its prefix instead"

fetch_wheel() { # DIR
    python3 -m pip --version >/dev/null 2>&1 || apt_install python3-pip
    say "fetching the Embree library (Python package embreex $wheel_version)"
    python3 -m pip download --quiet --no-cache-dir --disable-pip-version-check --no-deps --only-binary=:all: \
        --dest "$1" --python-version 3.11 --implementation cp --abi cp311 \
        --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 "embreex==$wheel_version" ||
        fail "could not fetch the Python package embreex $wheel_version; see the message above. $own_embree"
    check_hash "$1"/embreex-*.whl "$wheel_sha256"
}

# A private apt state with this machine's own sources, the release name replaced: nothing of the system changes.
# The pinned hash is the check, so it does not matter whether this machine knows that release's signing key.
fetch_headers() { # DIR
    local state=$1/apt log=$1/apt.log id codename file
    id=$(. /etc/os-release; echo "${ID:-}")
    codename=$(. /etc/os-release; echo "${VERSION_CODENAME:-}")
    [ "$id" = debian ] && [ -n "$codename" ] || fail "the fall-back for Embree is for Debian only. $own_embree"
    mkdir -p "$state"/{lists/partial,cache/archives/partial,sources.d}
    : > "$state/status"
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources; do
        grep -qsw "$codename" "$file" || continue
        sed -E "/^ *deb-src /d; s/^Types:.*/Types: deb/; s/\b$codename\b/$headers_release/g" \
            "$file" > "$state/sources.d/$(basename "$file")"
    done
    local opts=(-o Dir::State="$state" -o Dir::State::status="$state/status" -o Dir::State::lists="$state/lists"
        -o Dir::Cache="$state/cache" -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$state/sources.d"
        -o Acquire::Languages=none -o Acquire::AllowInsecureRepositories=true
        -o APT::Get::AllowUnauthenticated=true -o APT::Sandbox::User=root)
    say "fetching the Embree headers (Debian package libembree-dev $headers_version)"
    apt-get "${opts[@]}" update -qq >"$log" 2>&1 || true # a source that is not needed may fail
    (cd "$1" && apt-get "${opts[@]}" download -qq "libembree-dev=$headers_version" >>"$log" 2>&1) || {
        sed -n 's/^[EW]: /  apt-get: /p' "$log" | sort -u | head -n 8 >&2
        fail "could not fetch the package libembree-dev $headers_version of $headers_release from this machine's package sources. $own_embree"
    }
    check_hash "$1"/libembree-dev_*.deb "$headers_sha256"
}

install_embree_prefix() {
    [ "$(uname -m)" = x86_64 ] ||
        fail "this distribution has no Embree 4, and the fall-back is for x86-64 only. $own_embree"
    local library
    mkdir -p "$root/.deps"
    work=$(mktemp -d "$root/.deps/tmp.XXXXXX")
    trap 'rm -rf "$work"' EXIT
    fetch_wheel "$work"
    fetch_headers "$work"
    mkdir -p "$work/wheel" "$work/headers" "$work/prefix/lib"
    python3 -m zipfile -e "$work"/embreex-*.whl "$work/wheel"
    dpkg-deb -x "$work"/libembree-dev_*.deb "$work/headers"
    cp -r "$work/headers/usr/include" "$work/prefix/include"
    cp "$work"/wheel/embreex.libs/* "$work/prefix/lib/"
    library=$(cd "$work/prefix/lib" && ls libembree4-*.so.4)
    ln -s "$library" "$work/prefix/lib/libembree4.so"
    echo "$wheel_sha256 $headers_sha256" > "$work/prefix/.complete"
    rm -rf "$prefix"
    mv "$work/prefix" "$prefix"
    say "Embree ${wheel_version%.post*} is in .deps/embree4"
}

install_embree() {
    command -v apt-get >/dev/null ||
        fail "no Embree 4 found. Install your distribution's package (embree-devel, embree) or set EMBREE_DIR to its prefix"
    [ -n "$(distribution_embree_version)" ] || apt_update
    local version
    version=$(distribution_embree_version)
    case $version in
        4.*) apt_install libembree-dev; return ;;
    esac
    say "this distribution has no Embree 4 (libembree-dev: ${version:-none}); putting one into .deps"
    install_embree_prefix
}

# --- main ---------------------------------------------------------------------------------------
check=
case ${1:-} in
    '') ;;
    --check) check=1 ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$root/scripts/setup.sh" >&2; exit 2 ;;
esac
command -v cargo >/dev/null || fail "no cargo found. Install a Rust toolchain first (rustup, see rust-lang.org)"
command -v cc >/dev/null || fail "no C compiler found. Install gcc first"
find_missing
if [ ${#missing[@]} = 0 ]; then
    say "nothing is missing"
    exit 0
fi
if [ -n "$check" ]; then
    say "missing: ${missing[*]}"
    exit 1
fi
for m in "${missing[@]}"; do
    case $m in
        libclang) apt_install libclang-dev ;;
        openexr)  apt_install libopenexr-dev ;;
        embree4)  install_embree ;;
        libsvm)   apt_install libsvm3 libsvm-tools ;;
    esac
done
find_missing
[ ${#missing[@]} = 0 ] ||
    fail "still missing after installing: ${missing[*]}. Your distribution's version may be too old (OpenEXR 3.1 is needed)"
say "done"
