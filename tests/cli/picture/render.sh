# SPDX-License-Identifier: Apache-2.0
# Talk on stderr, a preview beside the picture, provenance inside it.
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 --seed 3 -o picture.exr --se || exit 9
ls
grep -ac 'importon render .*furnace.xml -D res=8 --spp 4 --seed 3 -o picture.exr --se' picture.exr
