# SPDX-License-Identifier: Apache-2.0
# Single numbers of a pose stay where they are, and are said to be held; indices that there are not are refused.
sed 's/value="24"/value="12"/; s/value="18"/value="9"/' "$SCENES/still.xml" >small.xml
importon render small.xml -m mono -q -s 0 --seed 9 --spp 64 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.01 1
measure() {
    importon measure small.xml left.ppm -m mono --stages cameras --hold '*.exposure.*' --hold 'sky.*' --spp 4 -n 2 --rounds 1 \
        --no-masks --noise .0104 "$@" 2>&1 | sed -n 's/^\(left.pose.[3-5].\) .*  held$/\1 held/p; /no number/p; /no such/p'
}
measure --hold 'left.pose[3-5]'
measure --hold '*.pose[3-6]'
measure --hold 'sky.*,lfet.pose' 2>&1
