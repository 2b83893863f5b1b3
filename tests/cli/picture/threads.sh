# SPDX-License-Identifier: Apache-2.0
# The same bits on 1, 2 and 3 threads.
for n in 1 2 3; do
    importon render "$ROOT/scenes/cornell.xml" -D res=24 --spp 8 -q -t $n -o $n.pfm || exit 9
done
cmp 1.pfm 2.pfm && cmp 1.pfm 3.pfm
