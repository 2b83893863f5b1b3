# SPDX-License-Identifier: Apache-2.0
# Numbers that are held have no interval in a plan, are not what it leaves open, and do not count in its gain; derivatives by
# them are not shown, and --hold without them is refused. A lens that no scene can have is the caller's mistake.
S=$SCENES/still.xml
plan() { importon plan "$S" -m mono -p 'floor.*' -p left.pose --spp 16 --seed 3 "$@"; }
plan --hold 'left.pose[3-5]' >held
sed -n 's/^\(left.pose.*\)  held$/\1 held/p; /not determined by/p' held
plan -s 0 -s 1 --hold 'left.pose' --json >all.json
importon plan "$S" -m mono -p 'floor.*' --spp 16 --seed 3 --json >alone.json
python3 - <<'P'
import json
gains = [{r["name"]: r["gain"] for r in json.load(open(f))["ranking"]} for f in ("all.json", "alone.json")]
print([abs(gains[0][k] / gains[1][k] - 1) < .05 for k in sorted(gains[1])])
P
importon read "$S" -m mono -p left.pose --hold 'left.pose[1-5]' --spp 2 -s 0 | sed -n 's/^    d.d \(left[^ ]*\)  *held/\1/p'
importon jacobian "$S" -m mono -p left.pose --hold 'left.pose[1-5]' --spp 1 -o out | grep -c ' held$'
ls out/*.exr
for bad in "read $S -m mono --hold floor.* --spp 1" "plan $S -m mono -p left.pose --hold left.pose --spp 1" \
    "render $S -m mono --set left.opencv_k1=-9 --spp 1 -o a.pfm"; do
    importon $bad >/dev/null
    echo "exit $?"
done
