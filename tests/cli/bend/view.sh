# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: output/overwrite draws all of these pictures too.
# Pictures of a problem: axes around them, a colour bar or the wavelengths' colours beside
# them; --json answers what they show.
cat >w.xml <<'END'
<scene version="3.0.0">
    <medium type="graded">
        <volume type="rod"><float name="n0" value="1.6"/><float name="g" value="0.4"/></volume>
        <float name="step" value="0.05"/>
        <vector name="cauchy" value="1.55, 0.02, 0"/>
        <surface type="plane"><float name="offset" value="3"/></surface>
    </medium>
    <rays type="beam"><integer name="count" value="60"/><float name="radius" value="0.5"/>
        <float name="start" value="-1"/><string name="wavelengths" value="0.45 0.55 0.65"/></rays>
    <target type="spot"/>
    <target type="image"><string name="filename" value="t.pfm"/>
        <vector name="corner" value="-0.6,0.6,0"/><vector name="u" value="1.2,0,0"/><vector name="v" value="0,-1.2,0"/></target>
</scene>
END
python3 - <<'END'
import struct
open("t.pfm", "wb").write(b"Pf\n8 8\n-1.0\n" + struct.pack("<64f", *range(64)))
END
importon bend view w.xml -q --json -o w >w.json || exit 9
ls w
python3 - <<'END'
import json, struct, zlib
a = json.load(open("w.json"))
assert a["folder"] == "w" and a["stats"]["traced"] == 180, a
assert [s["axis"] for s in a["slices"]] == ["x", "y", "z"] and 1.5 < a["slices"][2]["index_min"] < 1.6
spot, image = a["targets"]
assert spot["type"] == "spot" and spot["rays"] == 180 and 0 < spot["rms_spot"] < 0.1
assert abs(spot["picture_width"] - 6 * spot["rms_spot"]) < 1e-12 and image["type"] == "image"

def pixels(path):  # an 8-bit PNG as rows of (r, g, b)
    b, at, data = open(path, "rb").read(), 8, b""
    while at < len(b):
        n, tag = struct.unpack(">I4s", b[at : at + 8])
        body = b[at + 8 : at + 8 + n]
        if tag == b"IHDR":
            w, h, depth, kind = struct.unpack(">IIBB", body[:10])
        if tag == b"IDAT":
            data += body
        at += 12 + n
    assert depth == 8 and kind == 2
    data, rows, before = zlib.decompress(data), [], bytes(3 * w)
    for y in range(h):
        f, r = data[y * (3 * w + 1)], bytearray(data[y * (3 * w + 1) + 1 : (y + 1) * (3 * w + 1)])
        for x in range(3 * w):
            left, up, corner = r[x - 3] if x >= 3 else 0, before[x], before[x - 3] if x >= 3 else 0
            p = left + up - corner
            near = min((abs(p - v), i, v) for i, v in enumerate((left, up, corner)))[2]
            r[x] = (r[x] + (0, left, up, (left + up) // 2, near)[f]) & 255
        rows.append([tuple(r[3 * x : 3 * x + 3]) for x in range(w)])
        before = r
    return rows

def count(rows, test):
    return sum(test(*p) for row in rows for p in row)
# Beside the plot area: three squares of 14 x 14 pixels in the wavelengths' colours.
p = pixels("w/spot-0.png")
side = [row[-140:] for row in p]
assert count(side, lambda r, g, b: b > 200 and r < 120) == count(side, lambda r, g, b: r > 200 and b < 120) == 196
# Inside it: rays of all three.
inside = [row[110:618] for row in p[30:538]]
assert count(inside, lambda r, g, b: b > r + 60) > 20 and count(inside, lambda r, g, b: r > b + 60) > 20
# Numbers of the axes are black on white, left of the plot area and below it.
for name in ("spot-0", "rays-x", "slice-z", "image-1", "target-1"):
    p = pixels("w/%s.png" % name)
    black = lambda r, g, b: r + g + b < 30
    assert count([row[:100] for row in p], black) > 100 and count(p[550:], black) > 100, name
# The colour bar of the index is dark below and light above.
bar = [row[645] for row in pixels("w/slice-z.png")][30:538]
assert bar[0] > (200, 200, 200) and bar[-1] < (60, 60, 60) and bar == sorted(bar, reverse=True)
END
