# SPDX-License-Identifier: Apache-2.0
# A quarter-pitch rod in air: a parallel beam meets on the back face; its focal length is
# 1.893939, so a ray at height r leaves at the angle -r/f. Counts are zero.
importon bend trace "$ROOT/scenes/bend/rod.xml" -D radius=0.01 --json -o exits.csv >answer.json || exit 9
python3 - <<'END'
import csv, json
a = json.load(open("answer.json"))
s = a["stats"]
assert s["traced"] == s["rays"] == 400 and a["step_error"] < 1e-8, a
assert a["targets"][0] < 1e-12 and a["targets"][1] < 1e-12, a
for r in csv.DictReader(open("exits.csv")):
    assert abs(float(r["x"])) < 1e-6 and int(r["flags"]) == 0
END
importon bend trace "$ROOT/scenes/bend/rod.xml" -o - | head -n 1
