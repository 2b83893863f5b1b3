# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# A photograph of something else is named, and a file without what the others have in EXIF.
importon render "$SCENES/still.xml" -m mono -q -s 1 --seed 9 --spp 128 -o right.pfm
importon render "$ROOT/scenes/board.xml" -m mono -D width=24 -D height=18 -q --seed 9 --spp 128 -o left.pfm
for name in left right; do python3 "$ROOT/tests/cli/measure/camera.py" $name.pfm $name.ppm 2.2 0.01 1; done
importon measure "$SCENES/still.xml" left.ppm right.ppm -m mono --hold 'sky.*' --hold '*.gamma.*' --stages exposure,lights,materials \
    --rounds 1 --spp 8 | sed -n 's/: its chi-square is .*: is it/: is it/p'
