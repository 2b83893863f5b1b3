# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# The plume's numbers come back from deflections, the same with 1 and 2 threads.
for t in 1 2; do
    importon bend fit "$ROOT/scenes/bend/plume.xml" -D count=25 -n 60 -q -t $t --json -o out$t >$t.json ||
        exit 9
done
ls out1
python3 - <<'END'
import json
a, b = (json.load(open(f"{t}.json")) for t in (1, 2))
assert a["field"] == b["field"] and a["value"] == b["value"]
f = a["field"]
want = dict(n0=1, b=-0.003, width=0.3, x=0.1, y=-0.05, z=0.2)
assert all(abs(f[k] - want[k]) < 1e-3 * abs(want[k]) for k in want), f
END
