# SPDX-License-Identifier: Apache-2.0
# A grid as text, JSON, table and plan; what does not go together; a lamp outside, a grid that is half in the dark.
importon read "$ROOT/scenes/office.xml" -m mono -D spp=64 --grid --sensor 1 --ends --json --csv g.csv --svg g.svg >g.json || exit 9
python3 - <<'X'
import csv, json, xml.etree.ElementTree as tree
g = json.load(open("g.json"))["grids"][0]
rows = list(csv.DictReader(open("g.csv")))
assert len(rows) == g["width"] * g["height"] == len(g["value"]) == 45 and g["sensor"] == "task" and g["unit"] == "lx"
for r, p, v, se in zip(rows, g["points"], g["value"], g["se"]):
    assert abs(float(r["value"]) - v) < 1e-5 * v and abs(float(r["se"]) - se) < .01 * se, r
    assert all(abs(float(r[k]) - x) < 1e-6 for k, x in zip("xyz", p)), r
assert abs(sum(g["value"]) / 45 - g["average"]["value"]) < .02 * g["average"]["value"] and abs(g["z"]) < 4.5
low, high = g["minimum"]["interval"]
assert low < g["minimum"]["value"] == min(g["value"]) < high, g["minimum"]
u = g["uniformity"]
assert 0 < u["interval"][0] < u["value"] < u["interval"][1] <= 1
svg = tree.parse("g.svg").getroot()
names = [e.tag.split("}")[1] for e in svg.iter()]
assert names.count("rect") == 1 + 45 + 64 and names.count("path") >= 3
X
importon read "$ROOT/scenes/office.xml" -m mono -D spp=64 --grid --sensor 1 --csv g.csv --svg g.svg -q >/dev/null || exit 9
importon read "$ROOT/scenes/office.xml" -m mono -D spp=64 --ugr --sensor 3 --json --csv u.csv --svg u.svg >u.json || exit 9
python3 - <<'X'
import csv, json, math, xml.etree.ElementTree as tree
u = json.load(open("u.json"))["glare"][0]
rows = list(csv.DictReader(open("u.csv")))
assert u["cells"] == [[int(r["column"]), int(r["row"])] for r in rows] and (u["width"], u["height"], len(rows)) == (8, 5, 40)
assert all(float(r["value"]) == -math.inf if v is None else abs(float(r["value"]) - v) < 1e-5 for r, v in zip(rows, u["ugr"]))
svg = tree.parse("u.svg").getroot()
assert "UGR at most %.1f" % max(v for v in u["ugr"] if v is not None) in "".join(svg.itertext())
X
importon read "$ROOT/scenes/office.xml" --csv g.csv
importon read "$ROOT/scenes/office.xml" --grid --csv g.csv
importon read "$ROOT/scenes/office.xml" --grid -p 'lamp_11.*'
importon read "$ROOT/scenes/office.xml" --shares --ends
importon read "$ROOT/scenes/office.xml" --grid --sensor 9
importon read "$ROOT/scenes/office.xml" --grid --sensor 4
importon read "$ROOT/scenes/office.xml" --grid --spp 1
importon read "$ROOT/scenes/office.xml" --hours 9,17
importon read "$ROOT/scenes/office.xml" --grid --wanted 500
importon read "$ROOT/scenes/cornell.xml" --grid
cat >half.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
<emitter type="ies" id="lost"><string name="filename" value="opal.ldt"/><transform name="to_world"><rotate x="1" angle="180"/><translate z="30"/></transform></emitter>
<shape type="cube"><transform name="to_world"><scale x="1" y="3" z="1"/><translate x="1.7"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform><sensor type="irradiancemeter" id="grid">
<boolean name="virtual" value="true"/><string name="at" value="points"/><string name="units" value="photometric"/>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="1"/></film></sensor></shape></scene>
X
cp "$ROOT/scenes/lamps/opal.ldt" . && importon read half.xml -m mono --spp 64 --grid >/dev/null
room() { # FILE UNITS_IN_A_METRE [UP]: a room of 6 m x 4 m x 2.8 m, and a work plane at .75 m; UP: y is up
python3 - "$2" "${3-z}" >"$1" <<'X'
import sys
u = float(sys.argv[1])
def print(text, out=print):
    if sys.argv[2] == "y":
        text = text.replace("</transform>", '<rotate x="1" angle="-90"/></transform>')
    out(text)
print('<scene version="3.0.0"><integrator type="path"/><emitter type="ies" id="lamp"><string name="filename" value="opal.ldt"/>'
      '<transform name="to_world"><rotate x="1" angle="180"/><translate z="%g"/></transform></emitter>' % (2.7 * u))
print('<shape type="cube"><transform name="to_world"><scale x="%g" y="%g" z="%g"/><translate z="%g"/></transform>'
      '<boolean name="flip_normals" value="true"/></shape>' % (3 * u, 2 * u, 1.4 * u, 1.4 * u))
print('<shape type="rectangle"><transform name="to_world"><scale value="%g"/><translate z="%g"/></transform>'
      '<sensor type="irradiancemeter" id="work"><boolean name="virtual" value="true"/><string name="at" value="points"/><string name="units" value="photometric"/>'
      '<film type="hdrfilm"><integer name="width" value="2"/><integer name="height" value="2"/></film></sensor></shape></scene>' % (u, .75 * u))
X
}
room units.xml 3.28084 y && importon read units.xml -m mono --spp 64 --grid >/dev/null
for u in 1 3.28084 1000; do room units.xml $u && importon read units.xml -m mono --spp 64 --grid >/dev/null; done
