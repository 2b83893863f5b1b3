# SPDX-License-Identifier: Apache-2.0
# Walks guided by finite elements: another picture with the same mean and less noise; scenes that
# elements cannot take say so. Light walks take it in every command, those from both ends in none.
scene=$ROOT/scenes/elements/b.xml
importon render "$scene" -m mono -D res=16 --spp 256 -q -o a.exr --json >a.json || exit 9
importon render "$scene" -m mono -D res=16 --spp 256 -q -o b.exr --guide --json >b.json || exit 9
importon gradient "$scene" -m mono -D res=16 --spp 16 -q --guide --guide-share 0.2 --guide-roulette 1 -p 'light*' >g.txt || exit 9
importon render "$ROOT/scenes/stam.xml" --guide -q -o c.exr 2>&1 | grep -c 'finite elements take'
offices=$ROOT/scenes/elements/offices.xml
importon render "$offices" -m mono -D res=4 --spp 64 -q --from lights --guide -o c.exr --json | grep -o '"complete":true'
importon gradient "$offices" -m mono -D res=4 --spp 8 -q --from lights --guide --guide-share .25 -p 'wall*' | grep -c reflectance
importon check --draws-time 0.1 "$offices" -m mono -D res=4 --spp 8 -q --from lights --guide -p 'wall*' | grep -c '^ends'
importon render "$offices" -m mono -D res=4 -D integrator=bdpt --guide -q -o c.exr 2>&1 | grep -c 'follow no guide'
importon render "$offices" -m mono -D res=4 --from lights --guide --guide-roulette 1 -q -o c.exr 2>&1 | grep -c 'leave it out'
python3 - <<END
import json
a, b = (json.load(open(f + ".json"))["channels"][0] for f in "ab")
print(b["se"] < 0.8 * a["se"], abs(a["mean"] - b["mean"]) < 4 * (a["se"] + b["se"]))
END
