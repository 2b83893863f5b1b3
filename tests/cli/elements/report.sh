# SPDX-License-Identifier: Apache-2.0
# What a page of finite elements is made of: the answer is the command's own, and the rest agrees with it.
scene=$ROOT/scenes/elements/d.xml
options="-D res=16 --lux floor --plane 0,0.4,0,0,0,1,1,0,0 --beam light_left=20 --stop 5 -q"
importon elements "$scene" $options --report r || exit 9
ls r
importon elements "$scene" $options --sensitivity --json -o own.exr >own.json || exit 9
importon compare r/picture.exr own.exr --json | grep -o '"max_abs":0,'
importon elements "$scene" $options --image importance -o own.exr --overwrite || exit 9
importon compare r/importance.exr own.exr --json | grep -o '"max_abs":0,'
python3 - <<'END'
import json, math
page, own, mesh = (json.load(open(p)) for p in ("r/elements.json", "own.json", "r/mesh.json"))
for a in page, own:
    for s in a["steps"]: del s["seconds"]
print("the answer is the command's own:", page == own)
e, n = mesh["elements"], len(mesh["elements"])
print("elements stand for the leaves:", mesh["n_leaves"] == own["leaves"] and sum(x["leaves"] for x in e) <= own["leaves"], 100 < n <= 3000)
near = lambda a, b, t=1e-5: abs(a - b) <= t * abs(b) + 1e-12
print("links add up:", all(near(sum(l[1] for l in x["links"]) + x["rest"], x["illuminance"]) for x in e if x["illuminance"]))
print("links come from what is there:", all(0 <= l[0] < n + len(mesh["others"]) for x in e for l in x["links"]))
def area(x):
    p = [x["corners"][k:k + 3] for k in range(0, len(x["corners"]), 3)]
    u, v = ([b - a for a, b in zip(p[0], q)] for q in (p[1], p[-1]))
    return math.sqrt((u[1] * v[2] - u[2] * v[1]) ** 2 + (u[2] * v[0] - u[0] * v[2]) ** 2 + (u[0] * v[1] - u[1] * v[0]) ** 2)
plane = [x for x in e if mesh["shapes"][x["shape"]] is None]
told = {m["name"]: m["value"] for m in own["measurements"]}
print("the plane's elements have its measurement:", near(sum(area(x) * x["illuminance"] for x in plane) / sum(map(area, plane)), told["0,0.4,0,0,0,1,1,0,0"]))
for m in mesh["maps"]:
    mean = sum(m["illuminance"]) / len(m["illuminance"])
    print(m["name"], m["width"] * m["height"] == len(m["illuminance"]), m["measured"] == told[m["name"]], abs(mean / told[m["name"]] - 1) < .06)
lamps = {}
for r in own["sensitivity"]:
    if r["emission"]: lamps.setdefault(r["name"].rsplit("[", 1)[0], []).append(r)
print("lamps ranked:", [l["name"] for l in mesh["lamps"]] == sorted(lamps, key=lambda k: -sum(r["share"] for r in lamps[k]))
      and all(near(l["share"], sum(r["share"] for r in lamps[l["name"]]), 1e-12) and near(l["share_error"], sum(r["share_error"] for r in lamps[l["name"]]), 1e-12) for l in mesh["lamps"]))
END
importon report r -q || exit 9
grep -o '"kind":"[a-z]*"' r/report.html | sort
# Another folder's files are not ours to replace.
mkdir s; echo mine >s/mesh.json
importon elements "$scene" $options --report s
cat s/mesh.json
