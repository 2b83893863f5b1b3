# SPDX-License-Identifier: Apache-2.0
# A foreign block that is not masked does not lead the last fit: it has the stages' weights, and says so.
importon render "$SCENES/still.xml" -m mono -q -s 0 --seed 9 --spp 256 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.01 1 8,8,10,8
importon measure "$SCENES/still.xml" left.ppm -m mono -p left.exposure.value --set left.exposure.value=1.5 \
    --spp 16 --rounds 1 --no-masks >out || exit 9
grep -o 'the last fit ended worse than it began' out
grep '^left.exposure.value ' out | awk '{ print ($3 > .97 && $3 < 1.03) ? "right" : $3 }'
