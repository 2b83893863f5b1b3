# SPDX-License-Identifier: Apache-2.0
# Gradients of losses and derivative pictures by a pose: parts merge to the bits of the whole, on any
# number of threads.
scene=$ROOT/scenes/poses.xml
pose=(-D res=16 --spp 16 -p block.pose --set block.pose=.1,0,0,0,.1,0)
importon render "$scene" -D res=16 --spp 32 --seed 3 -o target.exr -q --no-preview
importon gradient "$scene" "${pose[@]}" -T target.exr -t 1 >whole.txt
importon gradient "$scene" "${pose[@]}" -T target.exr -t 2 | cmp - whole.txt && echo "two threads: equal"
for i in 1 2; do importon gradient "$scene" "${pose[@]}" -T target.exr --part $i/2 -o g$i.part -q -t $i; done
importon merge g1.part g2.part >merged.txt
cmp whole.txt merged.txt && echo "gradient of a loss: equal"
# Parts make the pictures of a loss before, one process of the walks that it sweeps.
sets=("${pose[@]}" -p paint.reflectance.value --points sobol --spp 40 --loss log -T target.exr)
importon gradient "$scene" "${sets[@]}" >whole.txt
for i in 1 2; do importon gradient "$scene" "${sets[@]}" --part $i/2 -o g$i.part -q; done
importon merge g1.part g2.part >merged.txt
cmp whole.txt merged.txt && echo "with sets of points: equal"
importon jacobian "$scene" "${pose[@]}" -q --json -o whole -t 2 >whole.json
for i in 1 2; do importon jacobian "$scene" "${pose[@]}" --part $i/2 -o j$i.part -q; done
importon merge j1.part j2.part -q --json -o merged >merged.json
(cd whole && for f in *.exr; do importon compare "$f" "../merged/$f" | grep max; done)
