# SPDX-License-Identifier: Apache-2.0
# A wall 5 % darker is found.
importon render "$ROOT/scenes/cornell.xml" -D res=32 --spp 64 -q --seed 1 --se -o a.exr || exit 9
importon render "$ROOT/scenes/cornell.xml" -D res=32 --spp 64 -q --seed 2 --se -o b.exr \
    --set white.reflectance.value=0.65 || exit 9
importon compare a.exr b.exr | tail -n 1
exit "${PIPESTATUS[0]}"
