# SPDX-License-Identifier: Apache-2.0
# The same bits on any number of threads; another seed has others.
for run in '-t 1' '-t 3' '-t 1 --seed 1'; do
    importon plan "$ROOT/scenes/cornell.xml" -D res=16 --spp 16 -p 'white.*' --exposures 1,2 --json $run >"run${run//[^0-9]/}"
done
cmp run1 run3 && echo same
cmp -s run1 run11 || echo other
