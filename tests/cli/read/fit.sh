# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# A number is a target: the pendant is dimmed until the desk has 400 lx.
importon fit "$ROOT/scenes/desk.xml" -m mono --spp 2000 -p batwing.scale.value -T =400+-1@0 -q -o F >/dev/null || exit 9
importon read "$ROOT/scenes/desk.xml" -m mono --spp 20000 --set @F/recovered.txt --json >answer.json 2>/dev/null ||
    { ls F >&2; exit 8; }
python3 - <<'END'
import json
r = json.load(open("answer.json"))["readings"][0]
assert abs(r["value"] - 400) < 8, r
END
