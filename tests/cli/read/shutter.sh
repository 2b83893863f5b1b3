# SPDX-License-Identifier: Apache-2.0
# The time integral of a reading, its mean over the shutter times how long that is open, is
# linear in the shutter: of a lamp at rest it grows with the time, of one that varies it is
# that of the lamp's course (a broken line), and parts add up to the whole; from either end.
cat >shutter.xml <<'X'
<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/></integrator>
<default name="times" value="0:1, 1:1"/><default name="open" value="0"/><default name="close" value="1"/>
<shape type="disk"><bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>
<sensor type="irradiancemeter"><float name="shutter_open" value="$open"/><float name="shutter_close" value="$close"/>
<film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/><rfilter type="box"/></film></sensor></shape>
<shape type="disk"><transform name="to_world"><rotate y="1" angle="180"/><translate z="1"/></transform>
<bsdf type="diffuse"><float name="reflectance" value="0.5"/></bsdf>
<emitter type="area"><string name="times" value="$times"/></emitter></shape></scene>
X
python3 - <<'END'
import json
import subprocess

seed = 0


def integral(times, a, b, end):
    global seed
    seed += 1
    out = subprocess.run(["importon", "read", "shutter.xml", "-m", "mono", "--spp", "40000", "--seed", str(seed), "--from", end,
                          "-D", "times=" + times, "-D", "open=%g" % a, "-D", "close=%g" % b, "--json"],
                         check=True, capture_output=True, text=True).stdout
    r = json.loads(out)["readings"][0]
    assert 0 < r["se"] < 0.02 * r["value"], r
    return r["value"] * (b - a), r["se"] * (b - a)


def same(what, a, b):
    z = (a[0] - b[0]) / (a[1] ** 2 + b[1] ** 2) ** 0.5
    assert abs(z) < 4.5, (what, a, b, z)


for end in "sensor", "lights":
    rest = integral("0:1, 1:1", 0, 1, end)
    for close in 0.25, 0.5, 4:
        same("at rest", integral("0:1, 1:1", 0, close, end), (rest[0] * close, rest[1] * close))
    course = "0:1, 0.5:3, 1:0"
    whole, first, second = (integral(course, a, b, end) for a, b in ((0, 1), (0, 0.3), (0.3, 1)))
    same("parts", (first[0] + second[0], (first[1] ** 2 + second[1] ** 2) ** 0.5), whole)
    # 1 + 4 t to .3; the rest of 1 + .75.
    same("first", first, (rest[0] * 0.48, rest[1] * 0.48))
    same("second", second, (rest[0] * 1.27, rest[1] * 1.27))
print("the integral is linear in the shutter")
END
