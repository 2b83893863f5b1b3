# SPDX-License-Identifier: Apache-2.0
# What is measured is told by name; planes face u x v; the mean of the picture is that of `gradient`,
# luminance has its own name.
scene=$ROOT/scenes/elements/b.xml
common=(-m mono -D res=16 --eps 1e-2 --no-image --progress never)
importon elements "$scene" "${common[@]}" || exit 9
importon elements "$scene" "${common[@]}" --lux floor --plane .3,.5,.3,0,0,.4,.4,0,0 --plane .3,.5,.3,.4,0,0,0,0,.4 || exit 9
importon elements "$ROOT/scenes/cornell.xml" -D res=16 --no-image --json -q >e.json || exit 9
importon render "$ROOT/scenes/cornell.xml" -D res=16 --spp 256 --json -q -o a.exr >r.json || exit 9
python3 - <<END
import json
e, r = json.load(open("e.json")), json.load(open("r.json"))
mean = sum(c["mean"] for c in r["channels"]) / 3
print(abs(e["measure"] / mean - 1) < 0.03, abs(e["luminance"] / mean - 1) > 0.05)
END
