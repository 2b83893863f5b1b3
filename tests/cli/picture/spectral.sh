# SPDX-License-Identifier: Apache-2.0
# Bins of wavelengths in the layout for spectral EXR, seen by a reader of our own, and by
# OpenEXR's of PyPI where it is installed. The lamp's spectrum is linear: a bin's mean is
# its value in the middle, (l - 300)/100.
cat >lamp.xml <<'XML'
<scene version="3.0.0">
    <integrator type="direct"/>
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/><rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="1024"/></sampler>
        <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform></sensor>
    <shape type="sphere"><float name="radius" value="3"/><emitter type="area" id="lamp"><spectrum name="radiance" value="350:.5, 850:5.5"/></emitter></shape>
</scene>
XML
cat >see.py <<'PY'
import array, json, math, struct, sys, zlib

def exr(path):
    """Texts, and values of the channels by name, of a float EXR with one block."""
    data = open(path, "rb").read()
    at, texts, names = 8, {}, []
    def word():
        nonlocal at
        end = data.index(b"\0", at)
        text, at = data[at:end].decode(), end + 1
        return text
    while name := word():
        kind, size = word(), struct.unpack_from("<i", data, at)[0]
        at, value = at + 4 + size, data[at + 4:at + 4 + size]
        if kind == "string": texts[name] = value.decode()
        if kind == "box2i": box = struct.unpack("<4i", value)
        if kind == "chlist":
            while value[0]:
                end = value.index(b"\0")
                names.append(value[:end].decode())
                value = value[end + 17:]
    w, h = box[2] - box[0] + 1, box[3] - box[1] + 1
    block, = struct.unpack_from("<q", data, at)
    _, size = struct.unpack_from("<ii", data, block)
    packed = data[block + 8:block + 8 + size]
    if size != 4 * w * h * len(names): # ZIP: differences of bytes, even ones first
        packed = bytearray(zlib.decompress(packed))
        for i in range(1, len(packed)): packed[i] = (packed[i] + packed[i - 1] - 128) & 255
        half = (len(packed) + 1) // 2
        plain = bytearray(len(packed))
        plain[0::2], plain[1::2] = packed[:half], packed[half:]
        packed = bytes(plain)
    values = array.array("f", packed)
    return texts, {n: [v for y in range(h) for v in values[(y * len(names) + k) * w:(y * len(names) + k + 1) * w]] for k, n in enumerate(names)}

texts, seen = exr("s.exr")
print(*seen, sep="\n")
for key in ("spectralLayoutVersion", "emissiveUnits", "polarisationHandedness"): print(key, texts[key])
try:
    import OpenEXR
    with OpenEXR.File("s.exr", separate_channels=True) as file:
        assert sorted(file.channels()) == sorted(seen), file.channels()
        assert all(abs(float(a) - b) < 1e-6 for a, b in zip(file.channels()["S0.475,000000nm"].pixels.ravel(), seen["S0.475,000000nm"]))
except ImportError:
    pass
for name in seen:
    if not name.startswith("S0."): continue
    centre, n = float(name[3:-2].replace(",", ".")), len(seen[name])
    mean, se = sum(seen[name]) / n, math.sqrt(sum(s * s for s in seen["se." + name])) / n
    z = (mean - (centre - 300) / 100) / se
    print(name, "agrees" if abs(z) < 4.5 and se < 0.01 * mean else "differs: %g +- %g, z %.2f" % (mean, se, z))
# Colours made of bins are those of the colour film, but for the width of the bins.
_, whole = exr("w.exr")
_, colours = exr("rgb.exr")
print("colours", all(abs(sum(whole[c]) / sum(colours[c]) - 1) < 0.005 for c in "RGB") or [(sum(whole[c]), sum(colours[c])) for c in "RGB"])
PY
importon render -m spectral lamp.xml -q --no-manifest --bins 400,700,6 --se -o s.exr || exit 9
importon render -m spectral lamp.xml -q --no-manifest --no-preview --bins "360, 830, 47" -o w.exr || exit 9
importon render -m spectral lamp.xml -q --no-manifest --no-preview -o rgb.exr || exit 9
python3 see.py
# It is read back: as a target of the same bins, and what it was.
importon compare s.exr s.exr --json | grep -o '"max_abs":0,'
importon fit -m spectral lamp.xml --bins 400,700,6 --target s.exr --spp 16 --set lamp.radiance.values=1,1 -p lamp.radiance.values --optimizer lm -q --json |
    python3 -c 'import json, sys; print("found", all(abs(p["value"] - t) < 4.5 * p["se"] and p["se"] < 0.3 for p, t in zip(json.load(sys.stdin)["params"], (0.5, 5.5))))'
# As the scene file has it; and what is none.
sed 's/type="hdrfilm">/type="specfilm"><string name="bins" value="400,700,6"\/>/' lamp.xml >own.xml
importon render -m spectral own.xml -q --no-manifest --no-preview --se -o own.exr && importon compare s.exr own.exr --json | grep -o '"max_abs":0,'
for bins in 400,700 400,700,0 400,700,65 700,400,3 0,700,3 400,inf,3 400,700,3x .4,.7,6 ""; do
    importon render -m spectral lamp.xml -q --bins "$bins" -o x.exr
done
importon render lamp.xml -q --bins 400,700,6 -o x.exr
# Films of sensors in shapes, too.
cat >meter.xml <<'XML'
<scene version="3.0.0">
    <integrator type="direct"/>
    <shape type="rectangle"><sensor type="irradiancemeter"><film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape>
    <shape type="sphere"><point name="center" value="0,0,5"/><emitter type="area"><spectrum name="radiance" value="350:.5, 850:5.5"/></emitter></shape>
</scene>
XML
importon render -m spectral meter.xml -q --no-manifest --no-preview --spp 4 --bins 400,700,3 -o m.exr && grep -ao 'S0\.[0-9,]*nm' m.exr | sort -u
# Bins are no target of a film of colours, nor is an array of two numbers; the copy of a target has
# the bins that it was given.
importon fit -m spectral lamp.xml --target s.exr --spp 4 -p lamp.radiance.values -q
importon fit -m spectral lamp.xml --target s.exr --spp 16 -p lamp.radiance.values --bins 400,700,6 -n 1 -q -o found >/dev/null &&
    importon compare s.exr found/target.exr --json | grep -o '"max_abs":0,'
python3 -c 'import struct, sys
head = "{\"descr\": \"<f4\", \"fortran_order\": False, \"shape\": (4, 6, 2), }".replace("\"", chr(39)).ljust(117) + "\n"
sys.stdout.buffer.write(b"\x93NUMPY\1\0" + struct.pack("<H", 118) + head.encode() + bytes(4 * 4 * 6 * 2))' >two.npy
importon fit lamp.xml --target two.npy --spp 4 -p 'lamp.*' -q
