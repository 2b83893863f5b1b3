# SPDX-License-Identifier: Apache-2.0
# Walks guided by finite elements: another picture with the same mean and less noise; scenes that
# elements cannot take say so.
scene=$ROOT/scenes/elements/b.xml
importon render "$scene" -m mono -D res=16 --spp 256 -q -o a.exr --json >a.json || exit 9
importon render "$scene" -m mono -D res=16 --spp 256 -q -o b.exr --guide --json >b.json || exit 9
importon gradient "$scene" -m mono -D res=16 --spp 16 -q --guide --guide-share 0.2 --guide-roulette 1 -p 'light*' >g.txt || exit 9
importon render "$ROOT/scenes/stam.xml" --guide -q -o c.exr 2>&1 | grep -c 'finite elements take'
python3 - <<END
import json
a, b = (json.load(open(f + ".json"))["channels"][0] for f in "ab")
print(b["se"] < 0.8 * a["se"], abs(a["mean"] - b["mean"]) < 4 * (a["se"] + b["se"]))
END
