# SPDX-License-Identifier: Apache-2.0
# Parts of a run merge to its bits, from any folder of parts, in any order, and with what is
# asked of the output given at the end.
furnace=$ROOT/scenes/furnace.xml
importon render "$furnace" --spp 20 --seed 3 -o whole.exr -q --no-preview
for i in 1 2 3; do
    importon render --spp=20 --se "$furnace" --seed 3 --part $i/3 -o p$i.part -q -t $((1 + i % 2))
done
importon merge p3.part p1.part -q -o some.part
importon merge p2.part some.part -q -o merged.exr
importon compare whole.exr merged.exr | grep max

importon gradient "$furnace" --spp 16 >whole.txt
for i in 1 2; do importon gradient "$furnace" --spp 16 --part $i/2 -o g$i.part -q; done
importon merge g1.part g2.part >merged.txt
cmp whole.txt merged.txt && echo "gradient: equal"

importon jacobian "$furnace" --spp 8 -p '*radiance*' -q --json -o whole >whole.json
for i in 1 2; do importon jacobian "$furnace" --spp 8 -p '*radiance*' --part $i/2 -o j$i.part -q; done
importon merge j1.part j2.part -q --json -o merged >/dev/null
(cd whole && for f in *.exr; do importon compare "$f" "../merged/$f" | grep max; done)
