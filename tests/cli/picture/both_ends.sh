# SPDX-License-Identifier: Apache-2.0
# bdpt with points in sets; its walks from the sensor alone, kept in a file and read again.
cat >both.xml <<'XML'
<scene version="3.0.0">
    <default name="integrator" value="bdpt"/>
    <integrator type="$integrator"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
        <sampler type="multijitter"><integer name="sample_count" value="256"/></sampler>
        <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="6"/><rfilter type="box"/></film>
    </sensor>
    <shape type="sphere" id="ball"><float name="radius" value=".7"/></shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value=".5"/><rotate x="1" angle="90"/><translate y="1.5"/></transform>
        <emitter type="area"/>
    </shape>
</scene>
XML
mean() { # of a picture with its error: the command, behind its arguments
    importon "$@" --json | python3 -c 'import json, sys; a = json.load(sys.stdin); print(a["value"], a["se"])'
}
importon render both.xml -q --no-manifest --no-preview --se -o bdpt.exr || exit 9
importon render both.xml -q --no-manifest --no-preview --se -D integrator=path -o path.exr || exit 9
importon compare bdpt.exr path.exr --json >pair.json
python3 -c '
import json
a = json.load(open("pair.json"))
print("bdpt agrees with path", abs(a["mean_test"] - a["mean_reference"]) < 0.01 * a["mean_reference"])' 
importon record both.xml -q --from sensor --pictures -o both.walks || exit 9
mean what-if both.walks | python3 -c 'v, s = map(float, input().split()); print("walks are read again", v > 0, s > 0)'
