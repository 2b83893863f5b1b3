# SPDX-License-Identifier: Apache-2.0
# The ball's reflectance comes back, and its interval holds the truth.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" -D res=8 --spp 1024 -q --seed 1 --se -o t.exr || exit 9
importon fit "$scene" -D res=8 --spp 32 -q --target t.exr --set ball.reflectance.value=0.8 \
    -p 'ball.*' --optimizer lm --json -o result >answer.json || exit 9
ls result
python3 - <<'END'
import json
a = json.load(open("answer.json"))
assert json.load(open("result/parameters.json"))["params"] == a["params"]
(p,) = a["params"]
assert p["start"] == 0.8 and abs(p["value"] - 0.5) < 0.01, p
assert p["lo95"] < p["value"] < p["hi95"] and abs(p["value"] - 0.5) < 5 * p["se"], p
END
# What was recovered goes into the next command.
importon info "$scene" --set @result/recovered.txt --json | python3 -c '
import json, sys
a = json.load(open("answer.json"))["params"][0]
(p,) = [p for p in json.load(sys.stdin)["params"] if p["name"] == a["name"]]
assert abs(p["value"][0] - a["value"]) < 1e-8, (p, a)'
# A target that lies where its copy would go is left alone.
mkdir again
cp t.exr again/target.exr
importon fit "$scene" -D res=8 --spp 4 -q --target again/target.exr -p 'ball.*' -n 1 --no-intervals -o again >/dev/null || exit 8
cmp t.exr again/target.exr
printf '# a comment\n\nball.reflectance.value=much\n' >bad.txt
importon info "$scene" --set @bad.txt
importon info "$scene" --set @no.txt
