# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# A lamp that is held at half its radiance is named; where nothing is wrong, nothing is.
importon render "$SCENES/still.xml" -m mono -q -s 0 --seed 9 --spp 256 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.01 1
measure() {
    importon measure "$SCENES/still.xml" left.ppm -m mono -D floor=.4 --hold '*.gamma.*' --hold '*.exposure.*' \
        --stages materials --spp 16 --no-masks --noise .0104 "$@" | grep -o 'may be wrong: [a-z.]*\|together.*explained$' | sed 's/together.*, //' | uniq
}
measure -D lamp=2
echo; measure
