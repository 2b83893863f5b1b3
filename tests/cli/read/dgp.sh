# SPDX-License-Identifier: Apache-2.0
# Daylight glare probability as text and JSON, its illuminance against the grid's; too little light; what
# does not go together.
cat >eyes.xml <<X
<scene version="3.0.0">
    <include filename="$ROOT/scenes/daylit.xml"/>
    <shape type="rectangle">
        <transform name="to_world"> <scale x="3" y="2"/> <translate x="3" y="2" z="1.2"/> </transform>
        <sensor type="irradiancemeter" id="eyes">
            <boolean name="virtual" value="true"/>
            <string name="at" value="points"/>
            <vector name="facing" x="1" y="0" z="0"/>
            <string name="units" value="photometric"/>
            <sampler type="independent"> <integer name="sample_count" value="16384"/> </sampler>
            <film type="hdrfilm"> <integer name="width" value="2"/> <integer name="height" value="1"/> </film>
        </sensor>
    </shape>
</scene>
X
sky="-m mono -D illuminance=25000 --sensor 1"
importon read eyes.xml $sky --dgp --dgp-cells 32 --json >dgp.json || exit 9
importon read eyes.xml $sky --grid --seed 5 --csv grid.csv >grid.txt || exit 9
importon read eyes.xml $sky --dgp --dgp-cells 16 --dgp-threshold 1e6 --json >none.json || exit 9
python3 - <<'X'
import csv, json
d, none = (json.load(open(f))["glare"][0] for f in ("dgp.json", "none.json"))
grid = list(csv.DictReader(open("grid.csv")))
assert d["width"] == 2 and d["view_cells"] == 32 and d["cells"] == [[0, 0], [1, 0]] and d["threshold"] == 5 and len(grid) == len(d["dgp"]) == len(d["points"]) == 2
for r, E, p, x, se in zip(grid, d["illuminance"], d["points"], d["dgp"], d["se"]):
    value, error = (float(r[k]) for k in ("value", "se"))
    assert abs(value - E) < 8 * error and error < .02 * value, (value, error, E)
    assert all(abs(float(r[k]) - c) < 1e-6 for k, c in zip("xyz", p)) and .2 < x < .7 and 0 < se < .01
for E, x in zip(none["illuminance"], none["dgp"]):
    assert abs(5.87e-5 * E + .16 - x) < 1e-9
X
importon read eyes.xml -m mono --sensor 1 --dgp --dgp-cells 8 | sed -n 2p
importon read eyes.xml $sky --dgp --grid
importon read eyes.xml -m mono --dgp
importon read eyes.xml -m mono --sensor 0 --dgp
importon read eyes.xml -m mono --sensor 1 --dgp --dgp-cells 10
