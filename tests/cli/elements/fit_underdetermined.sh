# SPDX-License-Identifier: Apache-2.0
# Fewer targets than numbers is said, unless a price picks one answer; --stop 0 never stops for stillness.
scene=$ROOT/scenes/elements/b.xml
common=(-D res=16 --eps 2e-2 --no-image)
fit=(--fit -p 'light_left*' -p 'light_back*' -p 'light_ceiling*' --lux floor=1 --lux back=1 --lux left=1)
importon elements "$scene" "${common[@]}" "${fit[@]}" 2>&1 >/dev/null | grep underdetermined
importon elements "$scene" "${common[@]}" "${fit[@]}" --tikhonov 'light*=1e-6' 2>&1 >/dev/null | grep -c underdetermined
for stop in 0 50; do
    importon elements "$scene" -m mono -D res=16 --eps 1e-2 --no-image --lux floor --stop $stop 2>&1 | grep -Eo '(the measurements no longer change|the smallest tolerance was reached)'
done
