# SPDX-License-Identifier: Apache-2.0
# A texture comes back as a picture; the loss falls. Intervals of an earlier fit do not stay beside it.
scene=(importon fit "$ROOT/scenes/textured.xml" -D width=32 -D height=24 --picture-spp 4 -q)
importon render "$ROOT/scenes/textured.xml" -D width=32 -D height=24 --spp 64 -q -o t.exr || exit 9
mkdir result
cp t.exr result/floor.reflectance.data.interval.exr
cp t.png result/floor.reflectance.data.interval.png
"${scene[@]}" --target t.exr -p 'floor.*' --set floor.reflectance.data=0.95 --spp 32 -n 30 \
    --no-intervals -o result >table.txt || exit 9
ls result | grep floor
python3 - <<'END'
import csv
loss = [float(r["loss"]) for r in csv.DictReader(open("result/loss.csv"))]
assert sum(loss[-5:]) < 0.5 * sum(loss[:5]), loss
END
