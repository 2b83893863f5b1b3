# SPDX-License-Identifier: Apache-2.0
# Where there is no memory for Embree, that is what is said.
for ((k = 40000; k <= 100000; k += 4000)); do
    (ulimit -v $k; importon info "$ROOT/scenes/furnace.xml" -t 1 2>&1 >/dev/null) | grep -E 'no device|error [0-9]'
done
exit 0
