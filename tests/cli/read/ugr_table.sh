# SPDX-License-Identifier: Apache-2.0
# The table of glare ratings of a photometric file, as text and JSON; what has none.
importon info "$ROOT/scenes/lamps/batwing.ies" --ugr-table --flux 4000 --json >t.json || exit 9
importon info "$ROOT/scenes/lamps/batwing.ies" --ugr-table --flux 4000 >t.txt || exit 9
python3 - <<'X'
import json
t = json.load(open("t.json"))["glare_tables"][0]
assert t["luminaire"] == "batwing" and t["flux"] == 4000 and t["spacing"] == .25
assert len(t["rooms"]) == len(t["across"]) == len(t["along"]) == 19 and t["rooms"][10] == [4, 8] and t["reflectances"][4] == [.3, .3, .2]
rows = [line.split() for line in open("t.txt") if line[:1].isdigit()]
assert len(rows) == 19
for row, across, along in zip(rows, t["across"], t["along"]):
    assert [float(x) for x in row[3:]] == [round(x, 1) for x in across + along], row
assert t["across"][10][0] > t["along"][10][0] + 1
# Darker rooms have a darker background; deeper ones more luminaires in view.
assert all(u[0] < u[1] < u[4] for u in t["across"] + t["along"]) and t["across"][0][0] < t["across"][5][0]
X
importon info "$ROOT/scenes/office.xml" -m mono --ugr-table | grep -c 'UGR with'
importon info "$ROOT/scenes/lamps/downlight.ies" --ugr-table >/dev/null
importon info "$ROOT/scenes/cornell.xml" --ugr-table
importon info "$ROOT/scenes/cornell.xml" --flux 1000
importon info "$ROOT/scenes/lamps/opal.ldt" --ugr-table --spacing 3
importon render "$ROOT/scenes/lamps/opal.ldt"
