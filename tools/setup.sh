#!/bin/sh
# Puts in place what SAC needs to be built and tested; when all of it is there, nothing happens.
#
# usage: tools/setup.sh [need ...]      `./sac` and `make setup` call it
#   build    make, gcc, the AVR tools, simavr, ncurses, Python, Unity (what is looked after when no need is given)
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
    trap 'rm -rf "$tools/apt" "$tools"/*.part' EXIT
    mkdir -p "$private/none" "$private/lists/partial" "$private/cache/archives/partial"
    # Security mirrors hold no whole release; of the others the first that has this one is taken.
    # shellcheck disable=SC2016 # apt's own placeholder
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

# The checksum `signed` takes what apt has verified, in whichever version the release has now.
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
        [ "$2" = signed ] || [ "$sum" = "$2" ] || fail "$1 has the SHA-256 $sum instead of $2 and is not used"
        dpkg -x "$debs"/*.deb "$folder"
        shift 2
    done
}

# -- the two compilers -----------------------------------------------------------------------------------------------

avr_version() { avr-gcc -dumpversion 2>/dev/null || echo none; }

# Programs of a release newer than this machine's C library run through their own release's loader, a small script each.
wrap_programs() { # FOLDER
    (
        cd "$1"
        loader=$(find usr -name 'ld-linux*.so.*' | head -n 1)
        find usr/bin usr/lib/avr/bin usr/lib/gcc/avr -type f -perm -u+x ! -name '*.so*' | while read -r program; do
            [ "$(head -c 4 "$program" | tail -c 3)" = ELF ] || continue
            mv "$program" "$program.elf"
            up=$(dirname "$program" | sed 's,[^/]*,..,g')
            cat >"$program" <<END
#!/bin/sh
self=\$(readlink -f "\$0")
top=\${self%/*}/$up
exec "\$top/$loader" --library-path "\$top/${loader%/*}" --argv0 "\$self" "\$self.elf" "\$@"
END
            chmod +x "$program"
        done
    )
}

need_reference() {
    [ "$(avr_version)" != 5.4.0 ] && [ ! -e "$tools/avr-5.4/ready" ] || return 0
    case $(dpkg --print-architecture) in
    amd64)
        gcc=1d0723749c4cbd55eb2478795a581dd29783150e3340a72c4aa7606d96109fbd
        binutils=cbda4048ad79ddc82239afcbf0ed00f1a961deb2d4523aabc2e7ec00eb8cde83
        ;;
    *) return 0 ;; # the system's own compiler builds the image
    esac
    say "fetching avr-gcc 5.4, the reference compiler"
    unpack bookworm "$tools/avr-5.4" "gcc-avr=1:5.4.0+Atmel3.6.2-3" $gcc \
        "binutils-avr=2.26.20160125+Atmel3.6.2-4" $binutils \
        "avr-libc=1:2.0.0+Atmel3.6.2-3" a7adb563082d291c49fe5f4a483fca18d27f30627c2c8a520c5e23578d0fa5af
    touch "$tools/avr-5.4/ready"
}

need_newer() {
    [ "$(avr_version)" != 14.2.0 ] && [ ! -e "$tools/avr-14.2/ready" ] || return 0
    if [ "$(dpkg --print-architecture)" != amd64 ]; then
        say "avr-gcc 14.2 is only fetched on amd64"
        return 0
    fi
    say "fetching avr-gcc 14.2"
    rm -rf "$tools/avr-14.2"
    unpack trixie "$tools/avr-14.2" \
        "gcc-avr=1:14.2.0-2" e1c9985199b9329bcb3efd7a720e9f0b82b8705e80efc883945e0f4be6a915fd \
        "binutils-avr=2.43.50.20250108-1" d1b81c9a828371037a22a6daa75d1c88ac22941df2f9d729b2305b57cc940854 \
        "avr-libc=1:2.2.1-1" 7a5574cd3dad522d72de1304c4e9c15b730b217a7d6a5182c2d7e296ba6b528f \
        libc6 signed libgmp10 signed libmpc3 signed libmpfr6 signed libzstd1 signed zlib1g signed
    # Other languages and manuals: three quarters of the size.
    rm -rf "$tools"/avr-14.2/usr/share "$tools"/avr-14.2/usr/lib/gcc/avr/14.2.0/cc1plus \
        "$tools"/avr-14.2/usr/lib/gcc/avr/14.2.0/crab1 "$tools"/avr-14.2/usr/bin/*rs "$tools"/avr-14.2/usr/bin/avr-lto-dump
    wrap_programs "$tools/avr-14.2"
    touch "$tools/avr-14.2/ready"
}

# -- needs -----------------------------------------------------------------------------------------------------------

need_unity() {
    [ ! -e /usr/share/cmock/vendor/unity/src/unity.c ] && [ ! -e "$tools/unity/unity.c" ] || return 0
    say "fetching Unity"
    unpack trixie "$tools/unity.part" cmock=2.5.3+git40-g379a9a8-2 \
        166e45090937251892363d10860b5e7aa5353d5553fde2cbaba514760ba3785e
    rm -rf "$tools/unity"
    mv "$tools/unity.part/usr/share/cmock/vendor/unity/src" "$tools/unity"
}

need_build() {
    want_command make make
    want_command gcc gcc
    want_file /usr/include/stdio.h libc6-dev
    want_command avr-gcc gcc-avr
    want_command avr-objdump binutils-avr
    want_file /usr/lib/avr/include/avr/io.h avr-libc
    want_file /usr/include/simavr/sim_avr.h libsimavr-dev
    want_file /usr/include/libelf.h libelf-dev
    want_file /usr/include/ncurses.h libncurses-dev
    want_command python3 python3
    install_missing
    need_reference
    need_unity
}

[ $# -gt 0 ] || set -- build
for need in "$@"; do
    case $need in
    build) need_build ;;
    newer) need_newer ;;
    flash)
        want_command avrdude avrdude
        install_missing
        ;;
    format)
        want_command clang-format clang-format
        install_missing
        ;;
    *) fail "tools/setup.sh does not know '$need'" ;;
    esac
done
