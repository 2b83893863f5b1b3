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
bad=0
for file in "${files[@]}"; do
    if ! "$format" "$file" | cmp -s - "$file"; then
        echo "$file: run tools/check_format.sh --fix" >&2
        bad=1
    fi
done
exit "$bad"
