# SPDX-License-Identifier: Apache-2.0
# One pixel tells nothing of its own noise: intervals that cannot hold it say so. With standard errors
# in the target, or with many pixels, there is nothing to say.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" -m mono -D res=1 --spp 64 -q --se -o se.exr || exit 9
importon render "$scene" -m mono -D res=1 --spp 64 -q -o plain.exr || exit 9
importon render "$scene" -m mono -D res=8 --spp 64 -q -o large.exr || exit 9
fit=(importon fit "$scene" -m mono --set ball.reflectance.value=0.6 -p 'ball.*' --optimizer lm --spp 16)
"${fit[@]}" -D res=1 --target plain.exr >plain.txt
"${fit[@]}" -D res=1 --target plain.exr --no-intervals >none.txt
"${fit[@]}" -D res=1 --target se.exr >se.txt
"${fit[@]}" -D res=8 --target large.exr >large.txt
