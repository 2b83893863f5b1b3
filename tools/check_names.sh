#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
#     tools/check_names.sh LIBRARY.a
#
# A name means one thing: files below src/ and cli/ have different names, external symbols
# of the static library begin with imp_ and are defined once, and no two headers define the
# same struct, union, enum, inline function or macro. Each of these files begins with what it
# holds, and no comment with "Of": its subject comes first.
set -uo pipefail
library=$(realpath "$1")
cd "$(dirname "$0")/.." || exit 1
bad=0

# none WHAT: standard input, a name a line, is what is wrong.
none() {
    local name
    while read -r name; do
        echo "$1: $name" >&2
        bad=1
    done < <(LC_ALL=C sort -u)
}
# The words that stand on more than one line of standard input.
twice() { LC_ALL=C sort | uniq -d; }

none "files of one name" < <(find src cli -name '*.[ch]' -printf '%f\n' | twice)

# Behind the licence and an empty line, a sentence.
none "file that does not begin with what it holds" < <(find src cli mpi -name '*.[ch]' -print0 | xargs -0 awk '
    FNR == 1 { ok = /SPDX-License-Identifier: Apache-2.0$/ }
    FNR == 2 { ok = ok && /^ \*$/ }
    FNR == 3 { if (!ok || !/^ \* ./) print FILENAME; nextfile }')
none "comment that begins with Of" < <(grep -rnE --include='*.[ch]' '/\*+ Of ' src cli mpi | cut -c1-90)

# Sanitizers add names that begin with __.
symbols=$(nm -g --defined-only "$library" | awk 'NF == 3 && $3 !~ /^__/ { print $3 }')
(($(wc -l <<<"$symbols") >= 500)) || { echo "$library: too few symbols" >&2; bad=1; }
none "symbol defined twice" < <(twice <<<"$symbols")
none "symbol without the prefix imp_" < <(grep -v '^imp_' <<<"$symbols")

# headers PATTERN SED-SCRIPT: what the script makes of matches, once for each header.
headers() {
    grep -rHoE --include='*.h' "$1" src include | sed -nE "s/^([^:]*):$2/\1 \2/p" | LC_ALL=C sort -u | cut -d' ' -f2
}
none "type in two headers" < <(headers '^(struct|union|enum) \w+ \{' '\w+ (\w+) .*' | twice)
# A text in lanes (src/math/lane_text.h) has names in WIDE().
inlines=$(headers '^static inline (\w+ |\*)*\**\w+\(' 'static inline.*\b(\w+)\(' | grep -vE '^(__attribute__|WIDE)$')
none "inline function and another in two places" < <(printf '%s\n' "$symbols" "$inlines" | twice)
none "inline function without the prefix imp_" < <(grep -v '^imp_' <<<"$inlines")
# IMP_WIDE and IMP_TEXT are what lane_text.h is given, and undefines.
none "macro in two headers" < <(headers '^#define \w+' '#define (\w+)' | grep -vxE 'IMP_WIDE|IMP_TEXT' | twice)
exit "$bad"
