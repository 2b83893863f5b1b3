#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# For packagers: a build that is optimised by profile and at link time (GCC), in two steps.
#
#     tools/build_profiled.sh BUILD [OPTION OF meson setup]...
#
# The library is compiled with counters, renders and differentiates the scenes of this
# repository (a minute), and is compiled again; do not edit it meanwhile. Results have the same bits as those of any
# other build.
set -euo pipefail
cd "$(dirname "$0")/.."
[[ $# -ge 1 && $1 != -* ]] || { sed -n '4,10s/^# \{0,1\}//p' "$0" >&2; exit 2; }
build=$1
shift
# Code that the training does not reach is optimised as usual, not for size.
meson setup "$build" -Db_pgo=generate -Dc_args="${CFLAGS-} -fprofile-update=atomic" "$@"
ninja -C "$build" cli/importon

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
importon=$(realpath "$build")/cli/importon
train() {
    "$importon" render scenes/cornell.xml -D res=64 --spp 32 -q --no-preview -o "$work/cornell.exr"
    "$importon" render scenes/textured.xml -D width=80 -D height=60 --spp 32 -q --no-preview -o "$work/textured.exr"
    "$importon" gradient scenes/cornell.xml -D res=64 --spp 32 -q -T "$work/cornell.exr" >/dev/null
    "$importon" gradient scenes/textured.xml -D width=80 -D height=60 --spp 32 -q -T "$work/textured.exr" >/dev/null
    "$importon" render scenes/stam.xml --spp 4 -q --no-preview -o "$work/stam.exr"
    "$importon" render scenes/lamps.xml --spp 1 -q --no-preview -o "$work/lamps.exr"
    "$importon" render scenes/fog.xml -D res=32 --spp 8 -q --no-preview -o "$work/fog.exr"
    "$importon" gradient scenes/fog.xml -D res=32 --spp 8 -q >/dev/null
    "$importon" render scenes/cornell.xml -m spectral -D res=32 --spp 16 -q --no-preview -o "$work/spectral.exr"
    "$importon" check scenes/cornell.xml -D res=16 --paths 50 --fresh-spp 4 -q >/dev/null || true
    "$importon" fit scenes/cornell.xml -D res=16 -T "$work/fit.exr" --spp 16 -n 3 --optimizer lm -q -p 'red.*' -o "$work/fit" >/dev/null || true
}
"$importon" render scenes/cornell.xml -D res=16 --spp 64 -q --no-preview -o "$work/fit.exr"
train
# The library's other build, which the loader takes for processors without AVX2.
export GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2
train
unset GLIBC_TUNABLES

meson configure "$build" -Db_pgo=use -Db_lto=true \
    -Dc_args="${CFLAGS-} -fprofile-partial-training -Wno-missing-profile -Wno-psabi"
ninja -C "$build"
