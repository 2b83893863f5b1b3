# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: its commands are run there by other transcripts.
# Recipes print what the program prints, and none is longer than 100 lines. That of Python needs
# NumPy; two of geometry take half a minute each, and run where all tests are asked for.
wc -l "$ROOT"/docs/do/*.md | awk '$2 != "total" && $1 > 100 {print $2 ": longer than 100 lines"}'
cd "$ROOT/docs/do" && ls *.md | grep -vx python.md | while read -r page; do
    [[ ${IMP_TESTS-} != all && " camera shape " == *" ${page%.md} "* ]] && continue
    python3 "$ROOT/tools/run_page.py" "$page"
done
mkdir "$OUT/bin" && for python in python3 /usr/bin/python3; do
    "$python" -c 'import numpy' 2>/dev/null || continue
    ln -s "$(command -v "$python")" "$OUT/bin/python3"
    PATH=$OUT/bin:$PATH python3 "$ROOT/tools/run_page.py" python.md
    break
done
