# SPDX-License-Identifier: Apache-2.0
# Options that would do nothing where they stand are refused.
furnace=$ROOT/scenes/furnace.xml
for option in --mask=p.exr --loss=l1 --epsilon=1 '--tikhonov=*=1' '--stay=*=1' '--smooth=*=1'; do
    importon gradient "$furnace" "$option" --spp 1
done
importon render "$furnace" --sample 3
importon render "$furnace" --count 3
ls
# What another optimiser, or another loss, has is not ignored.
importon render "$furnace" --spp 4 -q -o t.exr
for options in '--optimizer lm --lr .1' '--optimizer lbfgs --momentum .5' '--optimizer mma --control-variate on' \
    '--optimizer slsqp --allocation variance' '--memory 10' '--optimizer lm --headroom 2' '--epsilon 3' '--loss l1 --epsilon 3' '--lr 100'; do
    # shellcheck disable=SC2086
    importon fit "$furnace" --target t.exr --spp 4 -n 1 -q $options
    [[ $? == 2 ]] || echo "fit $options"
done
exit 0
