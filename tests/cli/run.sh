#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Golden transcripts: run.sh FOLDER OF THE PROGRAM, FOLDER OF CASES. A case is a script NAME.sh
# with what it must do beside it:
#
#     NAME.sh.exit          its exit code (default 0)
#     NAME.sh.stdout.exact  NAME.sh.stderr.exact   what it prints, to the letter
#     NAME.sh.stdout.glob   NAME.sh.stderr.glob    the same, with * for numbers and versions
#
# What has no file must print nothing there. Scripts run in an empty folder with SCENES (our
# small scenes), ROOT (the project) and BUILD set, and importon on the PATH. Prints TAP.
# A script that says `# Not under sanitizers: reason` is left out there, unless IMP_TESTS=all; in place of
# a folder, `left` means these, of the folders that plain builds leave to sanitizers.
# UPDATE=1 writes the .exact and .exit files that do not match, to be read before committing.
set -u
here=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$here/../.." && pwd)
export PATH=$1:$PATH SCENES=$here/scenes ROOT BUILD=$1/.. LC_ALL=C
unset TMPDIR
count=0 failed=0

# matches FILE PATTERN-FILE: only * is special in our patterns (JSON is full of brackets).
matches() {
    local text pattern
    text=$(cat "$1"; echo x) pattern=$(cat "$2"; echo x)
    pattern=${pattern//\\/\\\\} pattern=${pattern//\[/\\[} pattern=${pattern//\?/\\?}
    # shellcheck disable=SC2053
    [[ $text == $pattern ]]
}

# check CASE STREAM FILE: 0 if the stream is as expected.
check() {
    local expected=$1.$2
    if [[ -f $expected.glob ]]; then matches "$3" "$expected.glob"; return; fi
    if [[ -f $expected.exact ]]; then cmp -s "$3" "$expected.exact" && return 0
    else [[ ! -s $3 ]] && return 0; fi
    [[ ${UPDATE:-} ]] && cp "$3" "$expected.exact"
    return 1
}

scripts=("$here/$2"/*.sh)
if [[ $2 == left ]]; then
    mapfile -t scripts < <(grep -l '^# Not under sanitizers: ' "$here"/*/*.sh | grep -vE '/(package|pages)/[^/]*$')
fi
for script in "${scripts[@]}"; do
    name=$(basename "$(dirname "$script")")/$(basename "$script" .sh)
    if [[ ${IMP_SANITIZED:-} && ${IMP_TESTS:-} != all ]] && reason=$(grep -m1 '^# Not under sanitizers: ' "$script"); then
        count=$((count + 1))
        echo "ok $count - $name # SKIP ${reason#*: }"
        continue
    fi
    scratch=$(mktemp -d)
    mkdir "$scratch/cwd"
    (cd "$scratch/cwd" && OUT=$scratch/cwd exec bash "$script") \
        >"$scratch/stdout" 2>"$scratch/stderr" </dev/null
    code=$?
    sed -i "s|$ROOT|ROOT|g" "$scratch/stdout" "$scratch/stderr" # the same everywhere
    expected=0 verdict=ok reason=
    [[ -f $script.exit ]] && expected=$(<"$script.exit")
    if ((code != expected)); then
        verdict='not ok' reason+=" exit $code, expected $expected;"
        [[ ${UPDATE:-} ]] && echo "$code" >"$script.exit"
    fi
    check "$script" stdout "$scratch/stdout" || verdict='not ok' reason+=" stdout differs;"
    check "$script" stderr "$scratch/stderr" || verdict='not ok' reason+=" stderr differs;"
    count=$((count + 1))
    echo "$verdict $count - $name$reason"
    if [[ $verdict != ok ]]; then
        failed=$((failed + 1))
        sed 's/^/# stdout: /' "$scratch/stdout" | head -n 40
        sed 's/^/# stderr: /' "$scratch/stderr" | head -n 40
    fi
    rm -rf "$scratch"
done
echo "1..$count"
((failed == 0))
