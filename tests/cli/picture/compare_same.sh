# SPDX-License-Identifier: Apache-2.0
# Two renders of one scene with different seeds have one expectation.
for seed in 1 2; do
    importon render "$ROOT/scenes/cornell.xml" -D res=32 --spp 64 -q --seed $seed --se -o $seed.exr || exit 9
done
importon compare 1.exr 2.exr | tail -n 1
exit "${PIPESTATUS[0]}"
