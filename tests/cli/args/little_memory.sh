# SPDX-License-Identifier: Apache-2.0
# Where there is no memory for Embree, that is what is said; and a list of settings that does not fit is an
# error, not the end of the list.
nm -D "$BUILD/lib/libimporton.so" | grep -qE '__(asan|tsan|ubsan)' && exit 0 # they need more than there is here
for ((k = 40000; k <= 100000; k += 4000)); do
    (ulimit -v $k; importon info "$ROOT/scenes/furnace.xml" -t 1 2>&1 >/dev/null) | grep -E 'no device|error [0-9]'
done
(ulimit -v 400000; importon info "$ROOT/scenes/furnace.xml" -t 1 --set @/dev/zero 2>&1 >/dev/null) |
    grep -vx 'importon: --set @/dev/zero: Cannot allocate memory'
exit 0
