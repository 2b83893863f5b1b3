# SPDX-License-Identifier: Apache-2.0
# Options that would do nothing where they stand are refused.
furnace=$ROOT/scenes/furnace.xml
for option in --mask=p.exr --loss=l1 --epsilon=1 '--tikhonov=*=1' '--stay=*=1' '--smooth=*=1'; do
    importon gradient "$furnace" "$option" --spp 1
done
importon render "$furnace" --sample 3
importon render "$furnace" --count 3
ls
exit 0
