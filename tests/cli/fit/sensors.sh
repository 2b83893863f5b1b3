# SPDX-License-Identifier: Apache-2.0
# Targets without @N belong to the sensors in order, one each; what else they could mean is not guessed.
# Three lamps of a dark room, each seen by a sensor of its own.
python3 - >scene.xml <<'P'
print('<scene version="3.0.0"><integrator type="direct"/>')
for k in range(3):
    print(f'''<sensor type="perspective"><float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="{10 * k},0,3" target="{10 * k},0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><translate x="{10 * k}"/></transform>
    <emitter type="area" id="lamp{k}"><rgb name="radiance" value="{k + 1}"/></emitter></shape>''')
print('</scene>')
P
for k in 0 1 2; do importon render scene.xml -s $k --spp 2 -q -o $k.exr || exit 9; done
fit=(importon fit scene.xml --spp 2 -n 20 --optimizer lm --no-intervals -p 'lamp*' -q)
for k in 0 1 2; do fit+=(--set lamp$k.radiance.value=5); done
"${fit[@]}" -T 0.exr -T 1.exr -T 2.exr --json >ordered.json || exit 9
"${fit[@]}" -T 2.exr@2 -T 0.exr@0 -T 1.exr@1 --json >named.json || exit 9
python3 - <<'P'
import json
for name in ("ordered", "named"):
    a = json.load(open(name + ".json"))
    for p in a["params"]:
        assert abs(p["value"] - 1 - int(p["name"][4])) < 1e-3, (name, p)
    assert a["warning"] is None, a["warning"]
P
"${fit[@]}" -T 0.exr -T 1.exr@1 -T 2.exr; echo "exit $?" >&2
"${fit[@]}" -T 0.exr -T 1.exr; echo "exit $?" >&2
"${fit[@]}" -T 0.exr -T 1.exr -T 2.exr -s 1; echo "exit $?" >&2
# One target goes through --sensor, as ever.
"${fit[@]}" -p lamp1.radiance.value -T 1.exr -s 1 >table || exit 9
# All through one sensor: much of the pictures is left over, and that is said.
"${fit[@]/-q/--progress=never}" -T 0.exr@0 -T 1.exr@0 -T 2.exr@0 >table
