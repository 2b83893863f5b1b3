# SPDX-License-Identifier: Apache-2.0
# Daylight of a year as text, JSON, table and plan; what does not go together; damaged weather.
python3 "$ROOT/scenes/make_weather.py" >town.epw || exit 9
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=64 --year town.epw --json --csv y.csv --svg y.svg >y.json || exit 9
python3 - <<'X'
import csv, json, xml.etree.ElementTree as tree
y = json.load(open("y.json"))["years"][0]
rows = list(csv.DictReader(open("y.csv")))
assert len(rows) == y["width"] * y["height"] == len(y["points"]) and y["hours"] == 3650 and y["weather"]["hours"] == 8760
assert "mean [lx]" in rows[0] and "exposure_se [lx h]" in rows[0] and "sunlit_hours [h]" in rows[0], rows[0]
for r, p in zip(rows, y["points"]):
    assert abs(float(r["autonomy"]) - p["autonomy"]["value"]) < 1e-4 and 0 <= p["autonomy"]["value"] <= 1, r
    assert all(abs(float(r[k]) - x) < 1e-6 for k, x in zip("xyz", p["point"])), r
    assert abs(sum(u["value"] for u in p["useful"]) - 1) < .02 and p["mean"]["se"] > 0
mean = sum(p["mean"]["value"] for p in y["points"]) / len(rows)
assert abs(mean / y["average"]["mean"]["value"] - 1) < 1e-9
names = [e.tag.split("}")[1] for e in tree.parse("y.svg").getroot().iter()]
assert names.count("rect") == 1 + len(rows) + 64
X
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=64 --year town.epw --hours 9,17 --wanted 500 | sed -n 1,2p
sed '1s/,50,10,1,/,50,10,13,/' town.epw >noon.epw
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=4 --year noon.epw >/dev/null
sed '1s/,50,10,1,/,-50,-10,-1,/' town.epw >south.epw
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=4 --year south.epw 2>/dev/null | sed -n 2p
importon read "$ROOT/scenes/daylit.xml" --year town.epw --grid
importon read "$ROOT/scenes/office.xml" --year town.epw
importon read "$ROOT/scenes/office.xml" --year town.epw --sensor 0
importon read "$ROOT/scenes/daylit.xml" -m spectral --year town.epw
importon read "$ROOT/scenes/daylit.xml" --year none.epw
importon read - --year - <"$ROOT/scenes/daylit.xml"
importon read "$ROOT/scenes/daylit.xml" --year - </dev/null
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=16 --year - --json -q <town.epw >/dev/null || exit 9
importon read "$ROOT/scenes/daylit.xml" --year town.epw --hours 18,8
importon read "$ROOT/scenes/daylit.xml" -m mono -D spp=1024 --year town.epw --hours 23,24 | sed -n '1p; $p'
sed 100d town.epw >hole.epw
importon read "$ROOT/scenes/daylit.xml" --year hole.epw
sed '300s/,[0-9]*,999999,999999/,9999,999999,999999/' town.epw >missing.epw
importon read "$ROOT/scenes/daylit.xml" --year missing.epw
