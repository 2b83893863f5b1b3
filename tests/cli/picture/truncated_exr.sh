# SPDX-License-Identifier: Apache-2.0
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -o a.exr || exit 9
head -c 300 a.exr >cut.exr
importon compare cut.exr a.exr
