# SPDX-License-Identifier: Apache-2.0
# The pages are clean, and the first one has every option the program has.
for page in "$ROOT"/man/*.[0-9]; do
    command -v mandoc >/dev/null && mandoc -Tlint -Wwarning "$page"
done
for command in render gradient jacobian check fit compare info bend bench; do
    importon help $command | grep -o -- ' --[a-z-]*' | sed 's/ --//'
done | sort -u | while read -r option; do
    grep -q -- "-$option\b" "$ROOT/man/importon.1" || echo "not in the manual: --$option"
done
