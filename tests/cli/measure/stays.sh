# SPDX-License-Identifier: Apache-2.0
# Where what cameras see has no derivative by their poses, they stay, and the rest is measured.
sed 's/value="24"/value="12"/; s/value="18"/value="9"/; /id="block"/s/.*/<bsdf type="roughdielectric" id="block"><string name="distribution" value="ggx"\/><\/bsdf><\/shape>/' "$SCENES/still.xml" >glass.xml
importon render glass.xml -m mono -q -s 0 --seed 9 --spp 64 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.01 1
importon measure glass.xml left.ppm -m mono -D floor=.45 --hold '*.gamma.*' --hold '*.exposure.*' \
    --hold 'block*' --stages cameras,materials --spp 8 --rounds 1 --no-masks --noise .0104 >out
echo "exit $?"
grep -o "^round 1[:,] cameras stay: stage cameras\|^round 1, [a-z]*: [0-9]* number" out
