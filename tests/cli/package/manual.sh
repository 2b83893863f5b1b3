# SPDX-License-Identifier: Apache-2.0
# The pages are clean, and the first one has every option that the program has, and no other.
for page in "$ROOT"/man/*.[0-9]; do
    command -v mandoc >/dev/null && mandoc -Tlint -Wwarning "$page"
done
options() {
    importon help | sed -n 's/^  \([a-z-]*\) .*/\1/p' | while read -r command; do
        importon help "$command" | grep -oE '^ +(-., )?--[a-z-]+' | sed 's/.*--//'
    done | sort -u
}
manual() {
    grep -o -E '(^\.(It )?|[ ])(Fl|, Fl|Op Fl) -[a-z][a-z-]*' "$ROOT/man/importon.1" |
        sed 's/.* -//' | sort -u
}
(($(options | wc -l) > 40)) || echo "too few options: the form of the help has changed"
comm -23 <(options) <(manual) | sed 's/^/not in the manual: --/'
comm -13 <(options) <(manual) | grep -vx version |
    sed 's/^/in the manual only: --/'
grep -q '@recovered.txt' "$ROOT/man/importon.1" || echo "recovered.txt is not explained"
grep -qi 'noisy' "$ROOT/man/importon.1" || echo "the verdict noisy is not explained"
