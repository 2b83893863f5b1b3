# SPDX-License-Identifier: Apache-2.0
# Every scene of ours loads, in both modes, and every parameter of it says what it is.
for scene in "$ROOT"/scenes/*.xml; do
    [[ $scene == */smoke.xml || $scene == */fire.xml || $scene == */wax.xml ]] && continue # programs make what they read (docs/media.md)
    for mode in rgb mono; do
        importon info -m $mode --json "$scene" >info.json || exit 9
        python3 - <<END
import json
info = json.load(open("info.json"))
assert info["params"] and len({p["name"] for p in info["params"]}) == len(info["params"])
assert all(p["unit"] for p in info["params"])
END
    done
done
# Stam's seven controls, one number each in mono mode (other lists may follow).
importon info -m mono --json "$ROOT/scenes/stam.xml" | python3 -c '
import json, sys
for p in json.load(sys.stdin)["params"]:
    if p["differentiable"]: print(p["name"], *p["value"])'
