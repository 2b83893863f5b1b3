# SPDX-License-Identifier: Apache-2.0
# What cannot be cut, or does not belong together.
furnace=$ROOT/scenes/furnace.xml
importon render "$furnace" --spp 4 --part 1/2
importon render "$furnace" --spp 4 --part 3/2 -o x.part
importon render "$furnace" --spp 4 --part 1/2 --time 3 -o x.part
importon check "$furnace" --part 1/2 -o x.part
importon render "$furnace" --spp 4 --part 1/2 -o a.part -q
importon merge a.part
importon render "$furnace" --spp 8 --part 2/2 -o b.part -q
importon merge a.part b.part
importon merge a.part a.part
echo text >c.part
importon merge a.part c.part
importon render "$furnace" --spp 4 --part 2/2 -o c.part -q
echo "exit $?"
importon merge nothere.part
echo "exit $?"
