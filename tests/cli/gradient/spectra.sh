# SPDX-License-Identifier: Apache-2.0
# A plot for each spectrum that is given by points, none for other parameters; an older file of another kind stays.
importon gradient "$ROOT/scenes/cornell.xml" -D res=8 -m spectral --spp 16 -q --spectra plots >table || exit 9
ls plots
python3 - <<'END'
import re, xml.dom.minidom
rows = [l.split() for l in open("table") if l.startswith("red.reflectance.values")]
svg = xml.dom.minidom.parse("plots/red.reflectance.values.svg")
curve = [p for p in svg.getElementsByTagName("path") if p.getAttribute("fill") == "none"][0].getAttribute("d")
points = [(float(x), float(y)) for x, y in re.findall(r"[ML]([-\d.]+) ([-\d.]+)", curve)]
assert len(points) == len(rows) and all(a[0] < b[0] for a, b in zip(points, points[1:]))
# SVG's y falls where the gradient rises; the spectrum is given at equal steps.
g = [float(r[-2]) for r in rows[1:-1]]
y = [p[1] for p in points[1:-1]]
assert g.index(max(g)) == y.index(min(y)), (g, y)
END
echo notes >plots/white.reflectance.values.svg
importon gradient "$ROOT/scenes/cornell.xml" -D res=8 -m spectral --spp 4 -q --spectra plots >/dev/null
