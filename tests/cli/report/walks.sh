# SPDX-License-Identifier: Apache-2.0
# Walks of named pixels, and the shares of parameters: lights carry all of every walk, and pixels add up.
mkdir r
importon render "$ROOT/scenes/cornell.xml" -D res=8 --spp 16 -q --se -o r/picture.exr
importon report r --scene "$ROOT/scenes/cornell.xml" -D res=8 -D spp=16 --walks 3,5 --walks 4,1 -q || exit 9
python3 - <<'END'
import json, re
data = json.loads(re.search(r'id="data">(.*?)</script>', open("r/report.html").read(), re.S)[1])
d = next(i["data"] for i in data["items"] if i["kind"] == "walks")
names = [p["name"] for p in d["params"]]
light = names.index("light.radiance.value")
print(names)
print([p["pixel"] for p in d["pixels"]], len(d["walks"]), len(d["walk_shares"]))
near = lambda a, b: abs(a - b) <= 1e-6 * abs(b) + 1e-12
mean = lambda w: sum(w["radiance"]) / len(w["radiance"])
print("lights carry each walk:", all(near(s[light], mean(w)) for w, s in zip(d["walks"], d["walk_shares"])))
for k, p in enumerate(d["pixels"]):
    own = [i for i, w in enumerate(d["walks"]) if w["pixel"] == p["pixel"]]
    r = sum(mean(d["walks"][i]) for i in own) / len(own)
    white = sum(d["walk_shares"][i][0] for i in own) / len(own) / r
    print("pixel", p["walks"] == len(own) == 16, near(p["radiance"], r), near(p["shares"][light][0], 1), near(p["shares"][0][0], white), p["se"] > 0)
END
importon report r --scene "$ROOT/scenes/cornell.xml" -D res=8 --walks 9,0
importon report r --scene "$ROOT/scenes/cornell.xml" -D res=8 --walks a
importon report r --scene "$ROOT/scenes/furnace.xml" -D res=8 --walks 2 -q && grep -o '"walk_shares"' r/report.html
