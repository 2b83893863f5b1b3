# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# A field of numbers is summed up: its range, its least certain numbers, and its intervals as a second picture.
python3 - "$ROOT/scenes/textured.xml" <<'END'
import math, re, sys
with open("small.ppm", "wb") as f:
    f.write(b"P6\n8 6\n255\n" + bytes(int(127 + 100 * math.sin(1.7 * i)) for i in range(3 * 8 * 6)))
open("small.xml", "w").write(re.sub(r'value="[^"]*waves.png"', 'value="small.ppm"', open(sys.argv[1]).read()))
END
importon render small.xml -D width=24 -D height=18 --spp 64 --se -q --no-preview -o t.exr || exit 9
importon fit small.xml -D width=24 -D height=18 --target t.exr -p floor.reflectance.data --optimizer lm --spp 16 -n 2 \
    --picture-spp 16 -q -o r >/dev/null || exit 9
importon report r -q || exit 9
python3 - <<'END'
import base64, json, re, struct, zlib
data = json.loads(re.search(r'id="data">(.*?)</script>', open("r/report.html").read(), re.S)[1])
p = next(i["data"] for i in data["items"] if i["kind"] == "fit")["params"][0]
def numbers(name):
    i = next(i for i in data["items"] if i.get("name") == name)
    plane = i["width"] * i["height"]
    packed = zlib.decompress(base64.b64decode(i["pixels"])) # low bytes, then high bytes
    halves = struct.unpack("<%de" % (3 * plane), bytes(b for pair in zip(packed[:3 * plane], packed[3 * plane:]) for b in pair))
    return [halves[c * plane + k] * i["scale"] for k in range(plane) for c in range(3)]
v, half = numbers("floor.reflectance.data"), numbers("floor.reflectance.data.interval")
near = lambda a, b: abs(a - b) < 1e-3
print("the field:", p["count"] == len(v) == 144, near(p["least"], min(v)), near(p["most"], max(v)), near(p["mean"], sum(v) / 144))
print("intervals:", p["n_intervals"] == sum(h == h for h in half), 0 < p["n_intervals"] <= 144)
worst = p["least_certain"]
at = [int(re.search(r"\[(\d+)\]", w["name"])[1]) for w in worst]
print("least certain:", len(worst) == 5, all(a["se"] >= b["se"] for a, b in zip(worst, worst[1:])),
      all(near((w["hi95"] - w["lo95"]) / 2, half[k]) and near(w["value"], v[k]) for w, k in zip(worst, at)))
END
