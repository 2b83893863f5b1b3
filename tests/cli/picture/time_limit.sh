# SPDX-License-Identifier: Apache-2.0
# --time stops early with a valid picture, and that is no failure.
importon render "$ROOT/scenes/furnace.xml" --spp 100000000 --time 0.3 -q -o a.exr || exit 9
importon compare a.exr a.exr | tail -n 1
