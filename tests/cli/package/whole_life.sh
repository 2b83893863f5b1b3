# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: what it calls is run there by other transcripts.
# The program of libimporton.3 compiles under strict warnings, runs, and finds the parameter again; a
# name that does not exist is an error with its message.
sed -n '/^\.Ss A host/,/^\.Ed/p' "$ROOT/man/libimporton.3" | sed -n '/^#include/,/^}/p' | sed 's/\\e/\\/g' >life.c
grep -q imp_fit life.c || echo "the page has no program"
cc -std=c11 -Wall -Wextra -Werror -I"$ROOT/include" life.c -L"$BUILD/lib" -limporton -o life || exit 9
cat >scene.xml <<'END'
<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0,-4,1" target="0,0,0" up="0,0,1"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>
</sensor>
<shape type="sphere"><float name="radius" value="0.8"/>
<bsdf type="diffuse" id="ball"><rgb name="reflectance" value="0.5,0.4,0.3"/></bsdf></shape>
<emitter type="constant"><float name="radiance" value="1"/></emitter></scene>
END
export LD_LIBRARY_PATH=$BUILD/lib
./life scene.xml ball.reflectance >answer || exit 9
# loss, three derivatives, and three intervals around what the picture was made with
awk '/^loss/ {n++} /^d\/d/ {n++} / in / {k++; truth = .6 - .1 * k; sure = ($6 - $4) / 4
    n += $6 > $4 && $4 - sure < truth && truth < $6 + sure}
    END {if (n != 7) {print "not as it should be:"; exit 1}}' answer || cat answer
[ -s picture.exr ] || echo "there is no picture"
./life scene.xml bal.reflectance
echo "exit $?"
