# SPDX-License-Identifier: Apache-2.0
# Raw photographs: what the sensor counted, black taken off and white at 1, in both byte orders; more pixels than the film has
# are averaged, and exposures are where EXIF has them. Other mosaics and cut files are refused.
make() { python3 "$ROOT/tests/cli/measure/dng.py" "$@"; }
python3 - <<'P'
import array
import random
rng = random.Random(1)
v = [[[rng.uniform(0, 1.1) for _ in range(3)] for _ in range(9)] for _ in range(7)]
open("light.pfm", "wb").write(b"PF\n9 7\n-1\n" + array.array("f", [c for row in v for p in row for c in p]).tobytes())
open("twice.pfm", "wb").write(b"PF\n18 14\n-1\n" + array.array("f", [min(c, 1) for row in v for _ in "12" for p in row for _ in "12" for c in p]).tobytes())
P
make light.pfm plain.dng 1 plain
make light.pfm big.dng 1 plain big
if importon compare plain.dng big.dng 2>&1 | grep -q LibRaw; then
    cat "$ROOT/tests/cli/measure/dng.sh.stdout.exact" # there is none to read them
    exit
fi
importon compare plain.dng big.dng | tail -1
importon compare plain.dng twice.pfm | awk '/^max/ { print ($3 < 1.5e-4 ? "as counted" : $0) }'

importon render "$SCENES/still.xml" -m rgb -q -s 0 --seed 9 --spp 256 -D gamma=1 -o left.pfm
make left.pfm left.dng 1 .125 4 200 43
measure() { importon measure "$SCENES/still.xml" left.dng -D gamma=1 --hold '*.gamma.*' --hold 'sky.*' --hold left.pose --spp 8 --rounds 1 \
    --stages exposure,materials -D floor=.4 "$@"; }
measure -o out 2>&1 | grep ' by exposure\|means of\|together.*explained' | sed 's/-> .*, by/by/; s/: 3 numbers.*, /, /'
python3 - <<'P'
import json
a = json.load(open("out/measure.json"))
truth = {"left.exposure.value": 1, "floor.reflectance.value": .5, "block.reflectance.value": .6}
rows = {r["name"]: r for r in a["fit"]["params"]}
print(sorted(rows) == sorted(truth), all(abs(rows[n]["value"] - t) < 3.5 * rows[n]["se"] and rows[n]["se"] < .02 for n, t in truth.items()))
P
make light.pfm other.dng 1 mosaic
head -c 700 left.dng >cut.dng
head -c 250 left.dng >short.dng
for file in other cut short; do
    importon compare $file.dng twice.pfm 2>&1 | sed 's/: DNG files.*are not read.*/: not read/; s/cut.dng: .*/cut.dng: damaged/; s/short.dng: .*/short.dng: damaged/'
done
