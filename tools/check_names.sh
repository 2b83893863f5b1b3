#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
#     tools/check_names.sh LIBRARY.a
#
# A name means one thing: files below src/ and cli/ have different names, external symbols
# of the static library begin with imp_ and are defined once, and no two headers define the
# same struct, union, enum, inline function or macro.
set -uo pipefail
library=$(realpath "$1")
cd "$(dirname "$0")/.." || exit 1
bad=0

# today WHAT NAME...: what is wrong and waits to be mended; an entry that is right by now
# has to go. Standard input: what is wrong.
today() {
    local what=$1 name found
    shift
    found=$(LC_ALL=C sort -u)
    for name in $found; do
        [[ " $* " == *" $name "* ]] || { echo "$what: $name" >&2; bad=1; }
    done
    for name in "$@"; do
        grep -qxF -- "$name" <<<"$found" ||
            { echo "$what: $name is not wrong any more: take it off the list in $0" >&2; bad=1; }
    done
}
# The words that stand on more than one line of standard input.
twice() { LC_ALL=C sort | uniq -d; }

today "files of one name" \
    adjoint.c adjoint.h basis.c bend.c bend.h build.h check.c compare.c elements.h \
    file.c film.c film.h fit.c gradient.c guide.c guide.h ies.c ies.h image.c info.c \
    jacobian.c mesh.c problem.c problem.h sum.c \
    surface.c sweep.c trace.c \
    < <(find src cli -name '*.[ch]' -printf '%f\n' | twice)

# Sanitizers add names that begin with __.
symbols=$(nm -g --defined-only "$library" | awk 'NF == 3 && $3 !~ /^__/ { print $3 }')
(($(wc -l <<<"$symbols") >= 500)) || { echo "$library: too few symbols" >&2; bad=1; }
today "symbol defined twice" < <(twice <<<"$symbols")
today "symbol without the prefix imp_" \
    bend_medium bend_number bend_placed bend_rays bend_rules bend_sdf bend_surface \
    bend_target bend_volume \
    < <(grep -v '^imp_' <<<"$symbols")

# headers SED-SCRIPT: what it prints, once for each header.
headers() {
    find src include -name '*.h' | while read -r header; do
        sed -nE "$1" "$header" | LC_ALL=C sort -u
    done
}
today "type in two headers" imp__basis \
    < <(headers 's/^(struct|union|enum) (\w+) \{.*/\2/p' | twice)
inlines=$(headers 's/^static inline (\w+ |\*)*\**(\w+)\(.*/\2/p' | grep -v '^__attribute__$')
today "inline function and another in two places" imp__turn \
    < <(printf '%s\n' "$symbols" "$inlines" | twice)
today "inline function without the prefix imp_" \
    bend_place bend_turn el_at el_lobe el_material el_n el_root \
    < <(grep -v '^imp_' <<<"$inlines")
today "macro in two headers" < <(headers 's/^#define (\w+).*/\1/p' | twice)
exit "$bad"
