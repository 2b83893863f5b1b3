#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Is every C file as clang-format 14 (Debian 12's) leaves it? With --fix: make it so.
# Other versions lay some lines out otherwise, so without that one the test is skipped.
cd "$(dirname "$0")/.." || exit 1
format=$(command -v clang-format-14 || command -v clang-format) || exit 77
"$format" --version | grep -q 'version 14\.' || exit 77
mapfile -d '' files < <(find include src cli tests bench fuzz examples -name '*.[ch]' -print0)
if [[ ${1-} == --fix ]]; then
    exec "$format" -i "${files[@]}"
fi
set -o pipefail
# A process reads many files: starting one for each took most of the time.
unformatted=$(printf '%s\0' "${files[@]}" | xargs -0 -n 60 -P "$(nproc)" "$format" --dry-run 2>&1 |
    sed -nE 's/^([^: ]+\.[ch]):[0-9].*clang-format.*/\1/p' | sort -u) || exit 1
[[ -z $unformatted ]] && exit 0
sed 's/$/: run tools\/check_format.sh --fix/' <<<"$unformatted" >&2
exit 1
