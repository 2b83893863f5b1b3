# SPDX-License-Identifier: Apache-2.0
cd "$ROOT/scenes" || exit 9
importon selftest -q --samples 12000 material cornell.xml | head -3
importon selftest -q --json --samples 12000 light cornell.xml | python3 -c '
import json, sys
a = json.load(sys.stdin)
print(a["command"], a["subject"], a["failed"], [r["contract"] for r in a["rows"]])'
importon selftest camera cornell.xml >/dev/null
env --default-signal=INT "$(type -P importon)" selftest material cornell.xml --samples 1000000000 --progress always 2>"$OLDPWD/told" &
for ((k = 0; k < 200; k++)); do [[ -s $OLDPWD/told ]] && break; sleep 0.1; done
kill -INT $!
wait $!
echo $?
grep -o 'cornell.xml: .* cancelled' "$OLDPWD/told"
importon selftest -q --samples 12000 shape cornell.xml | head -3
importon selftest phases cornell.xml
