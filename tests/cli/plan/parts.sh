# SPDX-License-Identifier: Apache-2.0
# Parts of a plan merge to the bits of the whole, those of different cuts and those without a candidate, too; what depends on
# earlier answers has no parts, and parts with other candidates do not go together.
plan() { importon plan "$SCENES/still.xml" -m mono --spp 8 -p "floor.*" -p "lamp.radiance.*" "$@"; }
some=(--sphere 0,.2,0,2.6,3,20,60 --exposures 1,2 --have 0 --noise read=.02,shot=.001 -k 2 --of "floor.*" --prior lamp.radiance=1)
plan "${some[@]}" --json >whole.json
for part in 1/2 3/4 4/4; do plan "${some[@]}" --part $part -o part${part/\//of}.part; done
importon merge part*.part --json >merged.json
[[ -s whole.json ]] && cmp merged.json whole.json && echo "two cuts: equal"
for i in 1 2 3; do plan --part $i/3 -o one$i.part -q -t $i; done
plan >one.txt
importon merge one?.part >merged.txt
[[ -s one.txt ]] && cmp merged.txt one.txt && echo "parts without a candidate: equal"
importon merge part1of2.part one2.part one3.part
importon merge part1of2.part part4of4.part
plan --exposures 1,2 --part 1/2 -o b1.part -q
plan --exposures 1,3 --part 2/2 -o b2.part -q
importon merge b1.part b2.part
plan --sphere 0,.2,0,2.6,3 --improve 2 --part 1/2 -o c.part
plan --map tells --part 1/2 -o c.part
