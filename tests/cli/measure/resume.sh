# SPDX-License-Identifier: Apache-2.0
# Interrupted behind a stage, it goes on to the same bytes; another task's checkpoint is refused, and so is a
# damaged one. Answers do not depend on threads.
importon render "$SCENES/still.xml" -m mono -q -s 0 --seed 9 --spp 64 -o left.pfm
python3 "$ROOT/tests/cli/measure/camera.py" left.pfm left.ppm 2.2 0.02 1
measure() {
    importon measure "$SCENES/still.xml" left.ppm -m mono -D floor=.4 -D lamp=3 --hold '*.gamma.*' --hold 'sky.*' \
        --stages exposure,lights,materials --spp 4 "$@"
}
measure -o whole >whole.txt || exit 9
measure -o parts -t 3 >first.txt &
pid=$!
until grep -q 'round 1, exposure' first.txt 2>/dev/null || ! kill -0 $pid 2>/dev/null; do sleep 0.02; done
kill -INT $pid 2>/dev/null
wait $pid
[[ -e parts/measure.checkpoint || -e parts/measure.json ]] && echo "it can go on"
if [[ -e parts/measure.checkpoint ]]; then
    measure -o parts --seed 1 >/dev/null 2>refused.txt; echo "another task: exit $?" >exits
    head -c 300 parts/measure.checkpoint >short; mkdir -p broken; cp short broken/measure.checkpoint
    measure -o broken >/dev/null 2>>refused.txt; echo "damaged: exit $?" >>exits
    measure -o parts >second.txt || exit 9
else # it had ended before the signal came
    printf 'another task: exit 2\ndamaged: exit 3\n' >exits
fi
cat exits
cmp whole/recovered.txt parts/recovered.txt && cmp whole/parameters.json parts/parameters.json && echo same
ls parts | grep checkpoint
exit 0
