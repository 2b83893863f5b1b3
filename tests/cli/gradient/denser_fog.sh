# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: walks by the million take five times as long there.
# A fog whose extinction is 1.2 of that of its target: no walk of 2048 is dropped as infinite.
fog=$ROOT/scenes/fog.xml
importon render "$fog" -q -D res=16 --spp 64 --seed 1 -o t.exr >/dev/null 2>&1 || exit 9
at="-D res=16 --spp 8 --set fog.sigma_t=0.3 -p fog.sigma_t --target t.exr"
for seed in 1 2 3; do
    importon gradient "$fog" $at --seed $seed >said 2>&1
    echo "gradient $? $(grep -c -E 'drop|infinite' said)"
    importon fit "$fog" $at --seed $seed --optimizer lm --iterations 3 -o lm$seed >said 2>&1
    echo "lm $? $(grep -c -E 'drop|infinite' said)"
    importon fit "$fog" $at --seed $seed --optimizer lbfgs --iterations 3 -o lbfgs$seed >said 2>&1
    echo "lbfgs $? $(grep -c -E 'drop|infinite' said)"
done
