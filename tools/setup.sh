#!/bin/sh
# Puts in place what SAC needs to be built and tested; when all of it is there, nothing happens.
#
# usage: tools/setup.sh [need ...]      `./sac` and `make setup` call it
#   build    make, gcc, the AVR tools, simavr, Python, Unity (what is looked after when no need is given)
#   newer    the newer avr-gcc that must compile the sources without a warning too
#   flash    avrdude
#   format   clang-format
#
# Packages come from apt. Three things may belong to another Debian release than the running one: Unity (Debian 13's
# package cmock), avr-gcc 5.4 (Debian 12; the reference compiler, so that the image is the same everywhere) and avr-gcc
# 14.2 (Debian 13). They are fetched as signed Debian packages from the mirror that apt already uses, through a
# configuration of apt's own below .tools/, their SHA-256 is compared, and they are unpacked below .tools/: nothing of
# another release is installed on the machine, and root rights are not needed for it.
#
# Errors: a line on stderr that says what to do, exit code 1.
set -eu
cd "$(dirname "$0")/.."
top=$(pwd)
tools=$top/.tools

say() { echo "sac: $*"; }
fail() {
    echo "sac: $*" >&2
    exit 1
}
have() { command -v "$1" >/dev/null 2>&1; }

# -- packages of the running release ---------------------------------------------------------------------------------

missing=''
want_command() { have "$1" || missing="$missing $2"; }
want_file() { [ -e "$1" ] || missing="$missing $2"; }

as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    else
        sudo "$@"
    fi
}

install_missing() {
    [ -n "$missing" ] || return 0
    have apt-get || fail "these Debian packages are needed, and there is no apt-get here:$missing"
    [ "$(id -u)" = 0 ] || have sudo ||
        fail "as root, please: apt-get update && apt-get install --no-install-recommends$missing"
    say "installing with apt:$missing"
    log=$(mktemp)
    # shellcheck disable=SC2086 # $missing is a list of words
    if as_root apt-get -qq update >"$log" 2>&1 && as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y \
        -o Dpkg::Use-Pty=0 install --no-install-recommends $missing >>"$log" 2>&1 </dev/null; then
        rm -f "$log"
    else
        tail -n 20 "$log" >&2
        rm -f "$log"
        fail "apt-get could not install:$missing"
    fi
    missing=''
}

# -- packages of another release -------------------------------------------------------------------------------------

private_apt_get() { # RELEASE ARGUMENT ...
    private=$tools/apt/$1
    shift
    apt-get -qq -o Dir::Etc::SourceList="$private/sources.list" -o Dir::Etc::SourceParts="$private/none" \
        -o Dir::Etc::Preferences="$private/none/none" -o Dir::Etc::PreferencesParts="$private/none" \
        -o Dir::State::Lists="$private/lists" -o Dir::Cache="$private/cache" -o APT::Default-Release= \
        -o APT::Sandbox::User="$(id -un)" -o Acquire::Languages=none "$@"
}

private_apt_update() { # RELEASE
    private=$tools/apt/$1
    [ ! -e "$private/ready" ] || return 0
    have apt-get || fail "there is no apt-get here"
    for keyring in /usr/share/keyrings/debian-archive-keyring.gpg /usr/share/keyrings/debian-archive-keyring.pgp; do
        [ ! -e "$keyring" ] || break
    done
    [ -e "$keyring" ] || fail "Debian's archive keyring is missing: apt-get install debian-archive-keyring"
    mkdir -p "$private/none" "$private/lists/partial" "$private/cache/archives/partial"
    # Security mirrors hold no whole release; of the others the first that has this one is taken.
    for site in $(apt-get indextargets --format '$(SITE)' | grep -v security | sort -u); do
        echo "deb [signed-by=$keyring] $site $1 main" >"$private/sources.list"
        if private_apt_get "$1" -o APT::Update::Error-Mode=any update >"$private/log" 2>&1; then
            touch "$private/ready"
            return 0
        fi
    done
    cat "$private/log" >&2 || true
    fail "none of the mirrors that apt uses here has Debian's $1"
}

unpack() { # RELEASE FOLDER PACKAGE=VERSION SHA256 [PACKAGE=VERSION SHA256 ...]
    release=$1
    folder=$2
    shift 2
    private_apt_update "$release"
    mkdir -p "$folder"
    while [ $# -gt 0 ]; do
        debs=$tools/apt/debs
        rm -rf "$debs"
        mkdir -p "$debs"
        (cd "$debs" && private_apt_get "$release" download "$1") || fail "could not download $1"
        sum=$(sha256sum "$debs"/*.deb | cut -d ' ' -f 1)
        [ "$sum" = "$2" ] || fail "$1 has the SHA-256 $sum instead of $2 and is not used"
        dpkg -x "$debs"/*.deb "$folder"
        shift 2
    done
}

trap 'rm -rf "$tools/apt" "$tools"/*.part' EXIT

# -- needs -----------------------------------------------------------------------------------------------------------

need_build() {
    want_command make make
    want_command gcc gcc
    want_file /usr/include/stdio.h libc6-dev
    want_command avr-gcc gcc-avr
    want_command avr-objdump binutils-avr
    want_file /usr/lib/avr/include/avr/io.h avr-libc
    want_file /usr/include/simavr/sim_avr.h libsimavr-dev
    want_file /usr/include/libelf.h libelf-dev
    want_command python3 python3
    install_missing
    need_unity
}

need_unity() {
    [ ! -e /usr/share/cmock/vendor/unity/src/unity.c ] && [ ! -e "$tools/unity/unity.c" ] || return 0
    say "fetching Unity"
    unpack trixie "$tools/unity.part" cmock=2.5.3+git40-g379a9a8-2 \
        166e45090937251892363d10860b5e7aa5353d5553fde2cbaba514760ba3785e
    mv "$tools/unity.part/usr/share/cmock/vendor/unity/src" "$tools/unity"
}

[ $# -gt 0 ] || set -- build
for need in "$@"; do
    case $need in
    build) need_build ;;
    *) fail "tools/setup.sh does not know '$need'" ;;
    esac
done
