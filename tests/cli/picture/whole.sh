# SPDX-License-Identifier: Apache-2.0
# One set of points a pixel: no standard errors, the same picture from parts, and no gradients.
box=$ROOT/scenes/cornell.xml
render=(importon render "$box" -D res=16 --spp 16 --points whole -q --no-preview)
"${render[@]}" --json -o whole.exr | grep -o '"se":[^}]*' | sort -u
"${render[@]}" -t 2 -o whole.pfm && "${render[@]}" -t 1 -o one.pfm && cmp whole.pfm one.pfm
for k in 1 2; do "${render[@]}" -o $k.part --part $k/2; done
importon merge 1.part 2.part -q -o parts.pfm && cmp whole.pfm parts.pfm
importon gradient "$box" -D res=16 --spp 16 --points whole
echo $?
importon read "$box" -D res=16 --spp 16 --points whole
echo $?
"${render[@]}" --pixel 3,4 --sample 2 | head -n 1
"${render[@]}" --verify-sampling -o checked.exr
echo $?
importon render "$box" -D res=16 --points whole --time 1 -o timed.exr
echo $?
