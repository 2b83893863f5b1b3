# SPDX-License-Identifier: Apache-2.0
# What --fit needs, and what it cannot do.
scene=$ROOT/scenes/elements/b.xml
common=(-m mono -D res=16 --eps 5e-3 -q --no-image)
importon elements "$scene" "${common[@]}" --fit -p 'light*' && exit 9
importon elements "$scene" "${common[@]}" --fit --lux floor=1 && exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor && exit 9
importon elements "$scene" "${common[@]}" --lux floor=1 && exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor=x && exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor=1 --bounds 'light*=3' && exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor=-100 && exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor=1 --bounds 'light*=3,2'
