# SPDX-License-Identifier: Apache-2.0
# What answers say of themselves: samples taken, the mean of what, what red is, units, pictures drawn.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" -D res=8 --spp 16 -q -o target.exr || exit 9
importon gradient "$scene" -D res=8 -T target.exr --spp 1 -q --json >loss.json || exit 9
importon gradient "$scene" -D res=8 -T target.exr --spp 2 -q --json >two.json || exit 9
cmp loss.json two.json # 2 samples were taken, and are reported
importon gradient "$scene" -D res=8 --spp 1 -q --json | grep -o '"spp":[0-9]*'
importon gradient "$scene" -D res=8 --spp 5 -q --json | grep -o '"spp[_a-z]*":[0-9]*' | xargs
importon gradient "$scene" -D res=8 --spp 5 -T target.exr -q --json | grep -o '"spp[_a-z]*":[0-9]*' | xargs
for spp in 1 17; do # replicates have one size, and Gauss-Newton wants four samples
    for optimizer in adam lm; do
        importon fit "$scene" -D res=8 -T target.exr --spp $spp -n 1 --optimizer $optimizer -q -p 'sky*' --json |
            grep -o '"spp[_a-z]*":[0-9]*' | xargs
    done
done
importon jacobian "$scene" -D res=8 --spp 5 -q -o J5 --json | grep -o '"spp[_a-z]*":[0-9]*' | xargs
importon check --draws-time 0.1 "$scene" -D res=8 --spp 5 --paths 20 -q --json | grep -o '"spp[_a-z]*":[0-9]*' | xargs
importon gradient "$scene" -D res=8 --spp 4 -q | head -n 1 | grep -o '(.*'
importon jacobian "$scene" -D res=8 --spp 16 -q -o J --json >jacobian.json || exit 9
importon jacobian "$scene" -D res=8 --spp 16 -q -o J | grep -c 'is blue, .* red$'
importon fit "$scene" -D res=8 -T target.exr --spp 4 --optimizer lm -q -p 'sky*' --set sky.radiance=2 | sed -n 's/.*\] *//p'
python3 - <<'P'
import csv, json, os
for c, row in zip(json.load(open("jacobian.json"))["controls"], csv.DictReader(open("J/controls.csv"))):
    assert c["file"] == "J/" + row["file"] and abs(c["red"] - float(row["red"])) <= 1e-8 * c["red"], (c, row)
    assert c["mean"] <= c["red"], c # the picture is positive
P
