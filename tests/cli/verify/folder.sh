# SPDX-License-Identifier: Apache-2.0
# Of every file that a fit or a gradient writes, pictures, previews and fields with it, a changed
# byte is found, wherever it is.
cp "$ROOT/scenes/furnace.xml" scene.xml
cat >field.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
<sensor type="orthographic"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><translate z="3"/><rotate y="1" angle="180"/></transform>
<bsdf type="diffuse"><texture type="bitmap" name="reflectance" id="wall"><string name="filename" value="wall.pfm"/><boolean name="raw" value="true"/></texture></bsdf></shape>
<emitter type="constant"/></scene>
X
python3 - <<'P'
import struct
open("wall.pfm", "wb").write(b"PF\n8 8\n-1.0\n" + struct.pack("<192f", *(0.3 + 0.002 * k for k in range(192))))
P
# every NAME MANIFEST FILE...: one byte of each file changed in five places, one after the other
every() {
    python3 - "$@" <<'P'
import subprocess, sys
name, manifest, *files = sys.argv[1:]
bad = []
for file in files:
    good = open(file, "rb").read()
    for k in range(5):
        b = bytearray(good)
        b[(len(b) - 1) * k // 4] ^= 1
        open(file, "wb").write(b)
        r = subprocess.run(["importon", "verify", manifest, "--fraction", "1e-3", "--seed", "1"], capture_output=True, text=True)
        if r.returncode not in ((2, 3) if file == manifest else (1,)): bad.append((file, k, r.returncode))
    open(file, "wb").write(good)
print(name, "%d files:" % len(files), *map(lambda f: f.split("/")[-1], files))
print("not found:", *bad or ["none"])
P
    importon verify $2 | sed "s/verified:/good again:/"
}
importon render scene.xml -D res=8 --spp 8 --seed 3 -q -o target.exr
every render target.exr.manifest target.*
importon fit scene.xml -D res=8 -T target.exr -p 'ball.*' --set ball.reflectance.value=0.8 --spp 8 -n 3 \
    --optimizer lm -q -o result --sheet result/sheet.png >/dev/null
every fit result/manifest result/*
importon render field.xml --spp 4 -q -o wall.exr --no-preview
importon fit field.xml -T wall.exr -p 'wall.*' --stay wall.*=0.01 --spp 4 -n 2 --optimizer lm -q -o field >/dev/null
every 'fit of a field' field/manifest field/*
importon gradient field.xml -T wall.exr --spp 4 -q --textures maps -o answer.txt
every gradient answer.txt.manifest answer.txt* maps/*
