# SPDX-License-Identifier: Apache-2.0
# --time is kept where one round of all samples would take hours: what fits is the answer.
SECONDS=0
timeout 60 importon gradient "$ROOT/scenes/furnace.xml" --json --spp 100000000 --time 0.5 >a.json || exit 9
((SECONDS <= 30)) || echo "took $SECONDS s"
python3 - <<'END'
import json
a = json.load(open("a.json"))
assert 4 <= a["spp"] < 100000000, a["spp"]
assert abs(a["value"] - 0.5) < 5 * a["se"] + 1e-6, a
END
# Derivative pictures have samples in every pixel whatever the time, and a mean of all.
scene=$ROOT/scenes/cornell.xml
importon jacobian "$scene" -D res=64 --spp 1000000 --time 0.01 -p 'red.*' -o J --json >j.json || exit 9
importon gradient "$scene" -D res=64 --spp 64 -p 'red.*' --json >a.json || exit 9
python3 - <<'END'
import json
a, j = json.load(open("a.json")), json.load(open("j.json"))["picture"]
assert j["se"] > 0 and abs(a["value"] - j["mean"]) < 4.5 * (a["se"]**2 + j["se"]**2)**.5, (a["value"], a["se"], j)
END
# No check is no pass.
importon check "$scene" -D res=64 --time 0.001
echo "exit $?" >&2
