# SPDX-License-Identifier: Apache-2.0
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q -o missing/picture.exr
