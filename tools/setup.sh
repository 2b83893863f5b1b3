# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
#
# Sourced by ./quickstart and ./test: install what is missing, configure, build.

packages=(meson ninja-build gcc libc6-dev pkg-config libembree-dev libopenexr-dev libnlopt-dev
    libpng-dev libjpeg-dev libexpat1-dev libjansson-dev zlib1g-dev libsuitesparse-dev libmicrohttpd-dev
    libexif-dev libtiff-dev libraw-dev)

say() {
    if [[ -t 2 ]]; then printf '\033[1m== %s\033[0m\n' "$*" >&2; else echo "== $*" >&2; fi
}
die() { printf '%s\n' "$0: $*" >&2; exit 1; }

# install_packages NAME...: with apt, asking for sudo only if not root.
install_packages() {
    local missing=() name log as_root=()
    if ! command -v dpkg-query >/dev/null; then
        command -v meson >/dev/null ||
            die "this is no Debian: install by hand what these are called there: $*"
        return 0
    fi
    for name in "$@"; do
        dpkg-query -W -f '${db:Status-Status}\n' "$name" 2>/dev/null | grep -qx installed ||
            missing+=("$name")
    done
    ((${#missing[@]})) || return 0
    say "installing ${missing[*]}"
    if ((EUID != 0)); then
        command -v sudo >/dev/null || die "not root, and no sudo: install ${missing[*]}"
        as_root=(sudo)
    fi
    log=$(mktemp)
    # Another program may hold the installer's lock: apt-get waits for it, for as long as this.
    local wait=(-o DPkg::Lock::Timeout=600)
    if ! "${as_root[@]}" apt-get check -qq >"$log" 2>&1 && grep -q 'get lock' "$log"; then
        say "another program holds the installer's lock: waiting for it, 10 minutes at most"
    fi
    # An old list may still do.
    "${as_root[@]}" apt-get "${wait[@]}" update -qq >"$log" 2>&1 || true
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get "${wait[@]}" install -y -qq --no-install-recommends "${missing[@]}" >>"$log" 2>&1 ||
        { cat "$log" >&2; die "apt-get could not install ${missing[*]}"; }
    rm -f "$log"
}

# configure FOLDER [meson options]: once; later calls only build.
configure() {
    local folder=$1
    shift
    [[ -f $folder/build.ninja ]] && return 0
    meson setup "$folder" "$@" >"$folder.log" 2>&1 ||
        { cat "$folder.log" >&2; die "meson could not configure $folder"; }
    rm -f "$folder.log"
}
# build FOLDER [target...]
build() {
    local folder=$1
    shift
    ninja -C "$folder" "$@" >"$folder/ninja.log" 2>&1 ||
        { tail -n 40 "$folder/ninja.log" >&2; die "$folder does not build"; }
}
