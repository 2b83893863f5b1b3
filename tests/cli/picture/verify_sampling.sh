# SPDX-License-Identifier: Apache-2.0
# A picture with the proof of its densities: rows of `check --verify-sampling`, and which light delivers what.
photons=$ROOT/scenes/photons
importon render -q --verify-sampling "$ROOT/scenes/lamps.xml" -m mono -D res=24 --spp 8 --weights kernel=1,emitters=1 --json \
    -o picture.exr | python3 -c '
import json, sys
answer = json.load(sys.stdin)
rows = answer["sampling"]["rows"]
part = {r["param"]: r["value"] for r in rows if r["method"] == "energy"}
lamps = {k: v for k, v in part.items() if k.startswith("emitters: ")}
print(answer["file"], answer["sampling"]["failed"], sorted({r["method"] for r in rows}))
print(len(lamps), abs(sum(lamps.values()) - part["emitters"]) < 1e-6 * part["emitters"])'
ls
echo "+ not with single walks, nor with a picture on stdout"
importon render --verify-sampling "$photons/sky.xml" --pixel 0,0
importon render --verify-sampling "$photons/sky.xml" -o - | wc -c
